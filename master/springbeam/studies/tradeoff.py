"""Speed against accuracy: a scene run in many configurations, with the errors and the cost of each.

All are judged on the same times, between the macro points too, beside the event-driven monolithic solution of the same
semi-discrete model, so that what is measured is the coupling and the time integration (what the model itself leaves
out, `converge` shows).
"""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cached_property, partial
from time import perf_counter
from typing import Any, ClassVar

import numpy as np

from ..monolithic import event_driven
from ..pictures.diagrams import Diagram, draw_diagrams
from ..results.dense import at
from ..results.distance import distance
from ..results.trajectory import Trajectory
from ..run.outcome import RunStopped
from ..run.runner import run_in_memory
from ..scene import Scene, SceneError, with_changes
from ..scene.frequencies import slowest_frequency
from .comparison import SHORT_SHARE, comparable_until
from .design import RIGID, SOFT, with_keys
from .engine import Measure
from .metrics import costs
from .study import Study
from .tables import Findings, Row, table

#: A run that takes longer than this is given up, and finer ones of its family are not begun [s]; quick: ten times less.
_LIMIT = 10.0
#: Runs longer than this are timed once [s].
_TIMED_ONCE = 3.0
#: Times at which all are judged.
_TIMES = 401
#: Relative errors for which the cheapest configuration is named.
TARGETS = (1e-2, 1e-4, 1e-6, 1e-8)
#: Errors of a tenth of the motion and more are no results.
_NO_RESULT = 0.1

#: Macro steps are the scene's times these, where a run has this many of them.
_STEPS = tuple(2.0**k for k in range(6, -3, -1))
_FEWEST_STEPS = 4
_MOST_STEPS = 20_000
_ADAPTIVE_TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
#: Steps that follow from tolerances resolve the motion: with more turns of the slowest mode [rad] that takes too many.
_MOST_RESOLVED = 2000.0
#: Looser tolerances of IDA, and of the tie.
_LOOSER = {"coupling.tolerance": 1e-6, "spring.relative_tolerance": 1e-4, "spring.absolute_tolerance": 1e-6}


class Tradeoff(Study):
    """All configurations of a scene; coarse to fine in each family."""

    kind: ClassVar[str] = "tradeoff"
    announced: ClassVar[str] = "{} configurations; finer ones of a kind are left out after one that takes too long"

    scene: Scene  #: ends with the compared window
    repeats: int = 3  #: timings of each configuration; their median counts. 1 if quick

    @classmethod
    def of(cls, scene: Scene, until: float | None = None, **settings: Any) -> Tradeoff:
        """Return the study of ``scene`` up to ``until`` [s], or as far as it can be compared.

        Raises SceneError if no reference is defined for the scene.
        """
        event_driven.refuse(scene)
        window = comparable_until(scene) if until is None else min(until, scene.time.t_end)
        remarks = []
        if scene.accuracy is not None:
            left_out = f"accuracy = {scene.accuracy:g} is left out: each configuration has its own scheme and steps"
            remarks.append(left_out)
        scene = with_changes(scene, accuracy=None, time={"t_end": window})
        return cls(scene=scene, remarks=tuple(remarks), **settings)

    def cases(self) -> dict[str, Row]:
        """Return the axes of all configurations that the scene can have, by label; if quick, every third of each.

        They are family, setting, and keys.
        """
        families: dict[str, list[Row]] = {}
        for case in _configurations(self.scene):
            with suppress(SceneError):  # what the scene cannot have
                with_keys(self.scene, case)
                families.setdefault(case["family"], []).append(case)
        return {_label(case): case for cases in families.values() for case in cases[:: 3 if self.quick else 1]}

    def measure(self, known: Mapping[str, Row]) -> Measure:
        """Return what measures a case, or leaves it out if a coarser one of its family was too slow."""
        limit = 0.1 * _LIMIT if self.quick else _LIMIT

        def measure(case: Row) -> Row:
            for name, record in known.items():
                if name.rpartition(", ")[0] == case["family"] and record.get("cost_wall_time", 0.0) > limit:
                    return {"status": "skipped", "error": f"{name} took more than {limit:g} s"}
            return self.record(case)

        return measure

    def record(self, case: Row) -> Row:
        """Run, time and judge a configuration: ``cost_wall_time`` [s] is the median of ``times``, without set-up."""
        began = perf_counter()
        times = list[float]()
        measures = Row()
        try:
            while not times or (len(times) < self.repeats and not self.quick and times[-1] <= _TIMED_ONCE):
                measures = self._measured(case)
                times.append(measures["cost_wall_time"])
        except (event_driven.ReferenceFailure, RunStopped) as failed:
            return {"status": "stopped", "error": str(failed), "cost_wall_time": perf_counter() - began}
        return {"status": "done", "error": "", **measures, "cost_wall_time": statistics.median(times), "times": times}

    def _measured(self, case: Row) -> Row:
        limit = _LIMIT
        began = perf_counter()

        def limited(time: float, phase: str, macro_steps: int) -> None:
            if perf_counter() - began > limit:
                raise RunStopped(f"takes more than {limit:g} s", time)

        run = run_in_memory(with_keys(self.scene, case), limited)
        done = perf_counter()
        at(run, self.times)
        return {
            "cost_wall_time": float(run.summary["wall_time"]) + perf_counter() - done,
            "cost_setup": float(run.summary["setup_time"]),
            **costs(run),
            "cost_macro_steps": int(run.summary.get("macro_steps", 0)),
            **errors(run, self.reference),
        }

    @cached_property
    def times(self) -> np.ndarray:
        """When all are judged [s]."""
        return np.linspace(self.scene.contact_time or 0.0, self.scene.time.t_end, _TIMES)

    @cached_property
    def reference(self) -> Trajectory:
        """The solution of the same model."""
        return event_driven.integrate(self.scene, sample_times=self.times)

    def findings(self, records: Mapping[str, Row]) -> Findings:
        """Name the cheapest configurations, and those that nothing beats."""
        rows = self.rows(records)
        until = self.scene.time.t_end
        best = cheapest(rows)
        front = pareto(rows)
        cells = [(target, *_shown(row)) for target, row in zip(TARGETS, best, strict=True)]
        on_front = [
            (
                _label(row),
                row["error_motion"],
                row.get("error_event_time"),
                1e3 * row["cost_wall_time"],
                1e3 * row["cost_setup"],
                row.get("cost_do_steps"),
            )
            for row in front
        ]
        columns = ("configuration", "error:.1e", "event [s]:.1e", "solve [ms]:.3g", "set-up [ms]:.3g", "doSteps:")
        shown = [
            f"{self.scene.title}: up to t = {until:.6g} s, {len(rows)} configurations",
            table(("error:.0e", "configuration", "solve [ms]:.3g"), cells, "cheapest for an error"),
            table(columns, on_front, "Pareto front"),
        ]
        summary = {"until": until, "cheapest": dict(zip(map(str, TARGETS), best, strict=True)), "front": front}
        return Findings(summary, shown, tables={self.kind: rows}, pictures={self.kind: self._picture(rows, front)})

    def _picture(self, rows: Sequence[Row], front: Sequence[Row]) -> Callable[[], Any]:
        """Return what draws the work–precision diagrams: error over time, and over doStep calls."""
        labels = {"cost_wall_time": "wall time [s]", "cost_do_steps": "doStep calls of both FMUs"}
        diagrams = []
        for cost, label in labels.items():
            curves: dict[str, list[Any]] = {row["family"]: [] for row in rows}
            for row in rows:
                if cost in row and "error_motion" in row:
                    curves[row["family"]].append((row[cost], min(row["error_motion"], 1.0)))
            if cost == "cost_wall_time":
                curves["Pareto front"] = [(row[cost], row["error_motion"]) for row in front]
            diagrams.append(Diagram(label, "largest relative error of u_tip and y", curves))
        title = f"{self.scene.title}: errors up to t = {self.scene.time.t_end:.6g} s"
        return partial(draw_diagrams, diagrams, title, (6.0, 6.5))


def errors(run: Trajectory, exact: Trajectory) -> Row:
    """Return the `distance` of a run from the exact one, that of the times in seconds, and the energy residual."""
    span = float(np.ptp(exact.time))
    apart = distance(run, exact, SHORT_SHARE * span)
    return {
        "error_motion": apart.motion,
        "error_event_time": apart.times * span,
        "error_impulse": apart.impulses,
        "error_energy": float(run.summary["max_energy_residual"]),
    }


def pareto(rows: Iterable[Row]) -> list[Row]:
    """Return the Pareto front, the cheapest first: no other row is both quicker and more accurate."""
    best = _NO_RESULT
    front = []
    for row in sorted((row for row in rows if row["status"] == "done"), key=lambda row: row["cost_wall_time"]):
        if row["error_motion"] < best:
            best = row["error_motion"]
            front.append(row)
    return front


def cheapest(rows: Sequence[Row]) -> list[Row | None]:
    """Return for each of `TARGETS` the cheapest configuration.

    A configuration counts if all finer ones of its family keep the error too: not by luck.
    """
    best: list[Row | None] = []
    for target in TARGETS:
        kept = [row for k, row in enumerate(rows) if row["status"] == "done" and _kept(rows[k:], row["family"], target)]
        best.append(min(kept, key=lambda row: row["cost_wall_time"], default=None))
    return best


def _kept(rows: Iterable[Row], family: str, target: float) -> bool:
    return all(row["error_motion"] <= target for row in rows if row["family"] == family and row["status"] == "done")


def _label(case: Row) -> str:
    return f"{case['family']}, {case['setting']}"


def _shown(row: Row | None) -> tuple[str, float | None]:
    return ("none gets there", None) if row is None else (_label(row), 1e3 * row["cost_wall_time"])


def _configurations(scene: Scene) -> Iterator[Row]:
    """Yield the axes of all configurations, also those that the scene cannot have."""
    schemes: dict[str, Row] = {
        f"{scheme} {degree}": {"coupling.scheme": scheme, "coupling.degree": degree}
        for scheme, degree in (RIGID if scene.contact.rigid else SOFT)
    }
    best = {"energy 2": schemes["energy 2"]}
    looser = {f"{name}, IDA 1e-04": keys | _LOOSER for name, keys in best.items() if scene.spring is not None}
    sizes = [scene.coupling.H * share for share in _STEPS]
    for family, keys in (schemes | looser).items():
        for H in (H for H in sizes if _FEWEST_STEPS <= scene.duration / H <= _MOST_STEPS):
            yield {"family": family, "setting": f"H = {H:.3g}", **keys, "coupling.macro_step": H}
    turns = 0.0 if scene.beam is None or scene.massless else slowest_frequency(scene.beam) * scene.duration
    for family, keys in best.items():
        for tolerance in _ADAPTIVE_TOLERANCES if turns <= _MOST_RESOLVED else ():
            axes = {"family": f"{family} adaptive", "setting": f"{tolerance:.0e}"}
            yield axes | keys | {"coupling.relative_tolerance": tolerance}
