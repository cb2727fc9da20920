"""Speed against accuracy: a scene run in many configurations, with the errors and the cost of each.

All are judged on the same times, between the macro points too, beside the event-driven monolithic solution of the same
semi-discrete model, so that what is measured is the coupling and the time integration. Where the model itself varies
(modes, elements) it is the solution on a finer mesh. scipy solves the same model as a good user would have it do
(`rivals`). Every configuration is timed once in each of several passes, so that two of them are compared in turn.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from time import perf_counter
from typing import Any, ClassVar

import numpy as np
from rich.text import Text

from ..monolithic import event_driven
from ..results.trajectory import Trajectory
from ..run.outcome import RunStopped
from ..run.runner import simulate
from ..scene import Scene, SceneError, with_changes
from ..scene.resolution import mesh_frequency, slowest_frequency
from ..scene.tables import ALL_MODES_UP_TO
from .metrics import costs, errors, motion_errors, worst
from .reference import comparable_until, refuse_without_reference
from .rivals import TOLERANCES, Rival
from .schemes import RIGID, SOFT
from .study import Findings, Row, Study
from .tables import number, table

#: A run that takes longer than this is given up, and finer ones of its family are not begun [s]; quick: ten times less.
_LIMIT = 10.0
#: So long the reference on a finer mesh may take [s].
_LIMIT_FINER = 60.0
#: Runs longer than this are timed once [s].
_TIMED_ONCE = 3.0
#: Times at which all are judged.
_TIMES = 401
#: Methods whose steps are stable up to a few radians of the fastest mode, and how many radians they are let go [rad].
_EXPLICIT, _MOST_TURNS = ("DOP853", "LSODA"), 1e5
#: Contacts shorter than this share of the time are no evidence either way.
_SHORT = 2e-3
#: Relative errors for which the cheapest configuration is named.
TARGETS = (1e-2, 1e-4, 1e-6, 1e-8)

#: Macro steps are the scene's times powers of 2 between these, where a run has this many of them.
_COARSEST, _FINEST = 6, -2
_FEWEST_STEPS, _MOST_STEPS = 4, 20_000
_ADAPTIVE_TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
#: Steps that follow from tolerances resolve the motion: with more turns of the slowest mode [rad] that takes too many.
_MOST_RESOLVED = 2000.0
#: Tolerance of IDA, where it is not the scene's own; that of the tie is a hundredth.
_IDA_TOLERANCE = 1e-4
_MODES = (2, 4, 8, 16, 32, 64, 128)
_MESHES = (0.25, 0.5, 1.0, 2.0)
_DEGREES = (1, 4, 8)
_HIGHEST_DEGREE = 8


class Tradeoff(Study):
    """All configurations of a scene, in passes; coarse to fine in each family."""

    kind: ClassVar[str] = "tradeoff"

    scene: Scene  #: ends with the compared window
    repeats: int = 3  #: timings of each configuration; their median counts. 1 if quick

    @classmethod
    def of(cls, scene: Scene, until: float | None = None, **settings: Any) -> Tradeoff:
        """Return the study of ``scene`` up to ``until`` [s], or as far as it can be compared.

        Raises
        ------
        SceneError
            If no reference is defined for the scene.
        """
        if scene.contact.algorithm:
            raise SceneError("[contact] law = \"paper\": Algorithm 1 has no exact solution to compare with; "
                             'law = "transmission" or "compliance" has')  # fmt: skip
        refuse_without_reference(scene)
        window = comparable_until(scene) if until is None else min(until, scene.time.t_end)
        remarks = []
        if scene.accuracy is not None:
            remarks.append(
                f"accuracy = {scene.accuracy:g} is left out: each configuration has its own scheme and steps"
            )
        scene = with_changes(scene, accuracy=None, time={"t_end": window})
        return cls(scene=scene, remarks=tuple(remarks), **settings)

    @cached_property
    def configurations(self) -> list[Row]:
        """The axes of all configurations that the scene can have: family, setting, and keys or scipy's tolerance."""
        return list(_configurations(self.scene))

    def cases(self) -> dict[str, Row]:
        """Return the configurations of each pass; if quick, every third of a family, once."""
        places: dict[str, int] = {}
        chosen = []
        for case in self.configurations:
            place = places[case["family"]] = places.get(case["family"], -1) + 1
            if not (_hopeless(self.scene, case) or (self.quick and place % 3)):
                chosen.append(case)
        passes = range(1 if self.quick else self.repeats)
        return {_name(case, turn): {**case, "pass": turn} for turn in passes for case in chosen}

    def cost(self) -> str:
        """Say how many configurations there are."""
        cases, passes = self.cases(), 1 if self.quick else self.repeats
        return (
            f"{len(cases) // passes} configurations, timed {passes}×; finer ones of a kind are left out after one that "
            "takes too long"
        )

    def skipped(self, case: Row, records: Mapping[str, Row]) -> Row | None:
        """Leave out what a coarser one of the family was too slow for, and needless timings."""
        first = records.get(_name(case, 0))
        if case["pass"]:
            again = first is not None and first["status"] == "done" and first["cost_wall_time"] <= _TIMED_ONCE
            return None if again else {"status": "skipped", "error": "timed once"}
        family = (_name(other, 0) for other in self.configurations if other["family"] == case["family"])
        slow = next((name for name in family if records.get(name, {}).get("cost_wall_time", 0.0) > self._limit), None)
        if slow is None:
            return None
        return {"status": "skipped", "error": f"{slow.rpartition(',')[0]} took more than {self._limit:g} s"}

    @property
    def _limit(self) -> float:
        return 0.1 * _LIMIT if self.quick else _LIMIT

    def record(self, case: Row) -> Row:
        """Run, time and, in the first pass, judge a configuration: ``cost_wall_time`` [s] is without ``cost_setup``."""
        began, judged = perf_counter(), not case["pass"]
        row: Row = {"status": "done", "error": ""}
        try:
            if "rtol" in case:
                return row | self._by_scipy(case, judged)
            return row | self._by_us(case, judged)
        except event_driven.ReferenceFailure as failed:
            row["error"] = str(failed)
        except RunStopped as stopped:
            row["error"] = str(stopped)
        return {**row, "status": "stopped", "cost_wall_time": perf_counter() - began}

    def _by_us(self, case: Row, judged: bool) -> Row:
        scene, limit, began = self.at(case), _LIMIT, perf_counter()

        def limited(time: float, phase: str, macro_steps: int) -> None:
            if perf_counter() - began > limit:
                raise RunStopped(f"takes more than {limit:g} s", time)

        run = simulate(scene, limited)
        done = perf_counter()
        run.at(self.times)
        row = {
            "cost_wall_time": float(run.summary["wall_time"]) + perf_counter() - done,
            "cost_setup": float(run.summary["setup_time"]),
            **costs(run),
        }
        if judged:
            unknowns = 0 if scene.beam is None else scene.beam.modes_kept
            row |= {"unknowns": unknowns, "cost_macro_steps": int(run.summary.get("macro_steps", 0))}
            reference = self.finer_reference if case["finer"] else self.reference
            row |= errors(run, reference, _SHORT * (self.times[-1] - self.times[0]))
        return row

    def _by_scipy(self, case: Row, judged: bool) -> Row:
        began = perf_counter()
        rival = Rival(self.scene)
        ready, scale = perf_counter(), self.reach
        atol = 1e-3 * case["rtol"] * scale
        solved = rival.solve(case["method"], case["rtol"], atol, self.times, _LIMIT)
        row = {"cost_wall_time": solved.seconds, "cost_setup": ready - began, "cost_evaluations": solved.evaluations}
        return row | (motion_errors(solved.columns, self.reference) if judged else {})

    @cached_property
    def times(self) -> np.ndarray:
        """When all are judged [s]."""
        return np.linspace(self.scene.contact_time or 0.0, self.scene.time.t_end, _TIMES)

    @cached_property
    def reference(self) -> Trajectory:
        """The solution of the same model."""
        return event_driven.simulate(self.scene, sample_times=self.times)

    @cached_property
    def finer_reference(self) -> Trajectory:
        """The solution on a finer mesh. Raises ReferenceFailure if that takes too long."""
        model = finer(self.scene)
        assert model is not None
        return event_driven.simulate(model, sample_times=self.times, time_limit=_LIMIT_FINER)

    @cached_property
    def reach(self) -> float:
        """The largest displacement [m]; scipy's absolute tolerances are relative to it."""
        found = (float(np.abs(self.reference[k]).max()) for k in ("u_tip", "y") if k in self.reference.columns)
        return max(found, default=1.0) or 1.0

    def rows(self, records: Mapping[str, Row]) -> list[Row]:
        """Return a row per configuration: its errors, and the medians of its times."""
        found: dict[str, Row] = {}
        times: dict[str, list[float]] = {}
        cases = self.cases()
        for name, record in records.items():
            case, key = cases[name], name.rpartition(",")[0]
            if not case["pass"]:
                axes = {column: value for column, value in case.items() if column != "pass"}
                found[key] = {"index": len(found), **axes, "unknowns": None, **record}
            if record["status"] == "done":
                times.setdefault(key, []).append(record["cost_wall_time"])
        for key, several in times.items():
            found[key] |= {"cost_wall_time": statistics.median(several), "times": several}
        front = pareto(found.values())
        return [row | {"on_front": row in front} for row in found.values()]

    def findings(self, records: Mapping[str, Row]) -> Findings:
        """Name the cheapest configurations, and those that nothing beats."""
        rows, notes, until = self.rows(records), self.notes(records), self.scene.time.t_end
        best, front = cheapest(rows), pareto(rows)
        cells = [
            (f"{c['error']:.0e}", *_shown(c["co_simulation"]), *_shown(c["scipy"]), number(c["ratio"], ".1f"))
            for c in best
        ]
        names = ("error", "co-simulation", "[ms]", "scipy", "[ms]", "ratio")
        on_front = [
            (_label(row), f"{worst(row):.1e}", number(row.get("error_event_time"), ".1e"),
             *(f"{1e3 * row[cost]:.3g}" for cost in ("cost_wall_time", "cost_setup")),
             str(row.get("cost_do_steps") or ""))
            for row in front
        ]  # fmt: skip
        shown = [
            Text(f"{self.scene.title}: up to t = {until:.6g} s, {len(rows)} configurations"),
            table(names, cells, "cheapest for an error (solve time)", words=("co-simulation", "scipy")),
            table(("configuration", "error", "event [s]", "solve [ms]", "set-up [ms]", "doSteps"), on_front,
                  "Pareto front"),
            *(Text(f"note      {note}") for note in notes),
        ]  # fmt: skip
        told = [
            {"error": c["error"], "ratio": c["ratio"], **{side: _told(c[side]) for side in ("co_simulation", "scipy")}}
            for c in best
        ]
        document = {"until": until, "cheapest": told, "front": list(map(_told, front)), "notes": notes}
        return Findings(document, shown)

    def notes(self, records: Mapping[str, Row]) -> list[str]:
        """Return what was left out, and why."""
        found = list(self.remarks)
        stopped = [row for row in self.rows(records) if row["status"] == "stopped" and "takes more" in row["error"]]
        if stopped:
            names = "; ".join(map(_label, stopped))
            found.append(f"given up after {_LIMIT:g} s, finer ones of their kind not run: {names}")
        if hopeless := dict.fromkeys(c["method"] for c in self.configurations if _hopeless(self.scene, c)):
            turns = f"explicit steps would follow the mesh's fastest mode over {_MOST_TURNS:g} rad"
            found.append(f"not run, {turns}: {', '.join(hopeless)}")
        if self.scene.massless:
            found.append("not run: scipy, since a quasi-static beam has no equation of motion to hand to it")
        return found

    def draw(self, records: Mapping[str, Row], directory: Path) -> list[Path]:
        """Draw the work–precision diagrams: error over time, over doStep calls, and the model's over its size."""
        from .picture import lines, panels

        rows = [row for row in self.rows(records) if np.isfinite(worst(row))]
        same, models = ([row for row in rows if row["finer"] == finer] for finer in (False, True))
        ours = [row for row in same if "rtol" not in row]
        title = f"{self.scene.title}: errors up to t = {self.scene.time.t_end:.6g} s"
        figure, axes = panels(3 if models else 2, 3, (6.0, 6.5), title)
        for ax, mine, cost, words in zip(
            axes, (same, ours, models), ("cost_wall_time", "cost_do_steps", "unknowns"),
            ("wall time [s]", "doStep calls of both FMUs", "unknowns of the beam"), strict=False,
        ):  # fmt: skip
            lines(ax, mine, cost, lambda row: min(worst(row), 1.0), "family")
            ax.set(xlabel=words, ylabel="largest relative error of u_tip and y")
        front = pareto(rows)
        axes[0].plot([row["cost_wall_time"] for row in front], list(map(worst, front)), color="black", linewidth=6.0,
                     alpha=0.15, zorder=0, label="Pareto front")  # fmt: skip
        for ax in axes[2:]:
            ax.legend(fontsize="small")
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", fontsize="small", ncols=6)
        figure.savefig(directory / "tradeoff.png", dpi=110)
        return [directory / "tradeoff.png"]


def pareto(rows: Iterable[Row]) -> list[Row]:
    """Return the Pareto front, the cheapest first: no other row is both quicker and more accurate.

    Errors of a tenth of the motion and more are no results.
    """
    best, front = 0.1, []
    for row in sorted((r for r in rows if r["status"] == "done" and not r["finer"]), key=lambda r: r["cost_wall_time"]):
        if worst(row) < best:
            best = worst(row)
            front.append(row)
    return front


def cheapest(rows: Iterable[Row]) -> list[Row]:
    """Return for each of `TARGETS` the cheapest configuration here and of scipy's, and how much longer scipy takes.

    A configuration counts if all finer ones of its family keep the error too: not by luck. The ratio is the median of
    those of the passes.
    """
    same = [row for row in rows if not row["finer"]]

    def best(ours: bool, target: float) -> Row | None:
        kept = []
        for family in dict.fromkeys(row["family"] for row in same if ("rtol" not in row) == ours):
            done = [row for row in same if row["family"] == family and row["status"] == "done"]
            good = [worst(row) <= target for row in done]
            kept += [row for k, row in enumerate(done) if all(good[k:])]
        return min(kept, key=lambda row: row["cost_wall_time"], default=None)

    found = []
    for target in TARGETS:
        ours, theirs = best(True, target), best(False, target)
        pairs = zip(theirs["times"], ours["times"], strict=False) if ours and theirs else ()
        ratio = statistics.median(their / our for their, our in pairs) if ours and theirs else None
        found.append({"error": target, "co_simulation": ours, "scipy": theirs, "ratio": ratio})
    return found


def _name(case: Row, turn: int) -> str:
    return f"{_label(case)}, {turn}"


def _label(case: Row) -> str:
    return f"{case['family']}, {case['setting']}"


def _shown(row: Row | None) -> tuple[str, str]:
    return ("none gets there", "") if row is None else (_label(row), f"{1e3 * row['cost_wall_time']:.3g}")


def _told(row: Row | None) -> Row | None:
    """Return what is said of a row to programs."""
    if row is None:
        return None
    return {"name": _label(row), "error": worst(row), "solve": row["cost_wall_time"], "setup": row["cost_setup"]}


# -- configurations -------------------------------------------------------------------------------------------------


def _configurations(scene: Scene) -> Iterator[Row]:
    """Yield the axes of all configurations, those left out that the scene cannot have."""
    for family, setting, keys, of_finer in (*_steps(scene), *_tolerances(scene), *_models(scene)):
        tables: dict[str, dict[str, Any]] = {}
        for name, value in keys.items():
            tables.setdefault(name.partition(".")[0], {})[name.partition(".")[2]] = value
        try:
            with_changes(scene, **tables)
        except SceneError:
            continue
        yield {"family": family, "setting": setting, "finer": of_finer, **keys}
    for method, tolerances in TOLERANCES.items():
        for rtol in () if scene.massless else tolerances:
            axes = {"family": method, "setting": f"rtol {rtol:.0e}", "finer": False}
            yield axes | {"method": method, "rtol": rtol}


def _steps(scene: Scene) -> Iterator[tuple[str, str, Row, bool]]:
    """Yield all schemes with equal steps, the best ones with a looser tolerance of IDA too, and `auto`."""
    sizes = [scene.coupling.H * 2.0**k for k in range(_COARSEST, _FINEST - 1, -1)]
    sizes = [H for H in sizes if _FEWEST_STEPS <= scene.duration / H <= _MOST_STEPS]
    families: list[tuple[str, str, int, Row]] = [
        (f"{scheme} {degree}", scheme, degree, {}) for scheme, degree in _schemes(scene)
    ]
    if scene.spring is not None:
        looser = {"coupling.tolerance": 1e-2 * _IDA_TOLERANCE, "spring.relative_tolerance": _IDA_TOLERANCE,
                  "spring.absolute_tolerance": 1e-2 * _IDA_TOLERANCE}  # fmt: skip
        families += [(f"{s} {d}, IDA {_IDA_TOLERANCE:.0e}", s, d, looser) for s, d in _best(scene)]
    for family, scheme, degree, more in [*families, ("auto", "auto", 0, {})]:
        for H in sizes:
            keys = {"coupling.scheme": scheme, "coupling.degree": degree, "coupling.macro_step": H, **more}
            yield family, f"H = {H:.3g}", keys, False


def _schemes(scene: Scene) -> tuple[tuple[str, int], ...]:
    return RIGID if scene.contact.rigid else SOFT


def _best(scene: Scene) -> list[tuple[str, int]]:
    return [("energy", 2), ("hermite", 2)] if scene.contact.rigid else [("energy", 2)]


def _tolerances(scene: Scene) -> Iterator[tuple[str, str, Row, bool]]:
    beam = scene.beam
    if beam is not None and beam.fidelity == "dynamic" and slowest_frequency(beam) * scene.duration > _MOST_RESOLVED:
        return
    for scheme, degree in _best(scene):
        for tolerance in _ADAPTIVE_TOLERANCES:
            keys = {"coupling.scheme": scheme, "coupling.degree": degree, "coupling.relative_tolerance": tolerance}
            yield f"{scheme} {degree} adaptive", f"{tolerance:.0e}", keys, False


def _models(scene: Scene) -> Iterator[tuple[str, str, Row, bool]]:
    beam, fine = scene.beam, finer(scene)
    if beam is None or fine is None or fine.beam is None:
        return
    limit = fine.beam.n_elements * fine.beam.element_degree
    for modes in _MODES:
        if modes < beam.unknowns:
            yield "modes", f"{modes}", {"beam.n_modes": modes}, True
    for degree in _DEGREES:
        for factor in _MESHES:
            n = round(factor * beam.n_elements / degree)
            if n >= 1 and 2 * n * degree <= limit:
                mesh = {"beam.n_elements": n, "beam.element_degree": degree, "beam.n_modes": 0}
                full = {"beam.reduced_integration": False} if degree > 2 else {}
                yield f"elements of degree {degree}", f"{n}", mesh | full, True


def finer(scene: Scene) -> Scene | None:
    """Return the scene with elements of higher degree, which stand for the continuum; ``None`` if that is too large."""
    beam = scene.beam
    if beam is None or beam.integrator != "modal":
        return None
    degree = min(_HIGHEST_DEGREE, ALL_MODES_UP_TO // (2 * beam.n_elements))
    if degree < 2 * beam.element_degree:
        return None
    return with_changes(scene, beam={"element_degree": degree, "n_modes": 0, "reduced_integration": False})


def _hopeless(scene: Scene, case: Row) -> bool:
    """Tell whether an explicit method would have to follow the fastest mode of the mesh for too long."""
    if case.get("method") not in _EXPLICIT or scene.beam is None:
        return False
    return mesh_frequency(scene.beam) * scene.duration > _MOST_TURNS
