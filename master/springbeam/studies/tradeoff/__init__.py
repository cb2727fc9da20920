"""Speed against accuracy: a scene run in many configurations, with the errors and the cost of each.

The reference is the event-driven monolithic solution of the same semi-discrete model, so that what is measured is
the coupling and the time integration. Where the model itself varies (modes, elements) it is the reference on a finer
mesh. scipy's solvers and the paper's Algorithm 1 run in the same process on the same model.
"""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any, ClassVar

import numpy as np
from rich.text import Text

from ...monolithic import algorithm1, event_driven
from ...results.trajectory import Trajectory
from ...run.outcome import RunStopped
from ...run.runner import simulate
from ...scene import Scene, SceneError, with_changes
from ...scene.resolution import mesh_frequency
from ..reference import comparable_until, refuse_without_reference
from ..study import Findings, Record, Study
from ..tables import write_csv
from .configurations import ALGORITHM_1, SCIPY_TOLERANCES, Configuration, configurations, finer
from .points import Errors, Point, Points, errors

__all__ = ["Point", "Points", "Tradeoff"]

#: A run that takes longer than this is given up, and finer ones of its family are not begun [s]; quick: ten times less.
_LIMIT = 10.0
#: So long the reference on a finer mesh may take [s].
_LIMIT_FINER = 60.0
#: Runs longer than this are timed once [s].
_TIMED_ONCE = 3.0
#: Methods whose steps are stable up to a few radians of the fastest mode, and how many radians they are let go [rad].
_EXPLICIT, _MOST_TURNS = ("DOP853", "LSODA"), 1e5
#: Rows of a run of adaptive steps that are compared, about.
_ADAPTIVE_ROWS = 60
#: The case that holds all configurations whose model varies: they share one costly reference.
_MODELS = "modes and elements"


@dataclass
class _Timed:
    """A configuration that has been run."""

    configuration: Configuration
    run: Trajectory | str  #: the result, or why it stopped
    times: list[list[float]]  #: solve and setup [s] of each repetition


class Tradeoff(Study):
    """All configurations of a scene; a case is a family of them, coarse to fine."""

    kind: ClassVar[str] = "tradeoff"
    files: ClassVar[tuple[str, ...]] = ("tradeoff.csv", "tradeoff.png")

    scene: Scene  #: ends with the compared window
    repeats: int = 3  #: timings of each configuration, taken in turn; their median counts. 1 if quick
    reach: float = 1.0  #: largest displacement [m]; scipy's absolute tolerances are relative to it

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
        return cls(scene=scene, reach=_largest_displacement(scene), remarks=tuple(remarks), **settings)

    def cases(self) -> dict[str, list[Configuration]]:
        """Return the configurations by family, without those that would take too long; every third if quick."""
        found: dict[str, list[Configuration]] = {}
        families: dict[str, int] = {}
        for configuration in configurations(self.scene):
            place = families[configuration.family] = families.get(configuration.family, -1) + 1
            if not _hopeless(configuration) and not (self.quick and place % 3):
                found.setdefault(_MODELS if configuration.refined else configuration.family, []).append(configuration)
        return found

    def cost(self) -> str:
        """Say how many configurations there are."""
        cases, repeats = self.cases(), 1 if self.quick else self.repeats
        return (
            f"{sum(map(len, cases.values()))} configurations of {len(cases)} kinds, timed {repeats}×; finer ones of a "
            "kind are left out after one that takes too long"
        )

    def record(self, case: Sequence[Configuration]) -> Record:
        """Run, time and judge the configurations of a case."""
        limit, repeats = (0.1 * _LIMIT, 1) if self.quick else (_LIMIT, self.repeats)
        timed: list[_Timed] = []
        given_up: dict[str, Configuration] = {}
        for configuration in case:
            if configuration.family not in given_up:
                run, *times = _run(configuration, self.reach)
                timed.append(_Timed(configuration, run, [times]))
                if times[0] > limit:
                    given_up[configuration.family] = configuration
        for _ in range(1, repeats):
            for one in timed:
                if isinstance(one.run, Trajectory) and one.times[0][0] <= _TIMED_ONCE:
                    _, *times = _run(one.configuration, self.reach)
                    one.times.append(times)
        notes = []
        if given_up:
            names = "; ".join(c.name for c in given_up.values())
            notes.append(f"given up after {limit:g} s, finer ones of their kind not run: {names}")
        points: list[Point] = []
        try:
            points = self._judged(timed)
        except event_driven.ReferenceFailure as failed:
            if not case[0].refined:
                raise
            notes.append(f"modes and elements not judged: on a finer mesh the reference {failed}")
        return {"points": points, "notes": notes}

    def _judged(self, timed: Sequence[_Timed]) -> list[Point]:
        grid = np.linspace(self.scene.contact_time or 0.0, self.scene.time.t_end, 401)
        for one in timed:  # scipy is timed without rows; its errors are those of the same steps, sampled
            if isinstance(one.run, Trajectory) and one.configuration.method in SCIPY_TOLERANCES:
                one.run = _scipy(one.configuration, self.reach, grid)
        times = [_judged_times(one.configuration, one.run) for one in timed if isinstance(one.run, Trajectory)]
        reference: Trajectory | None = None
        if times:
            refined = timed[0].configuration.refined
            model = finer(self.scene) if refined else self.scene
            assert model is not None
            reference = event_driven.simulate(
                model,
                sample_times=np.unique(np.concatenate([grid, *times])),
                time_limit=_LIMIT_FINER if refined else None,
            )
        return [_point(one, reference) for one in timed]

    def judged(self, records: Mapping[str, Record]) -> Points:
        """Return all points."""
        return Points.of(records.values())

    def notes(self, records: Mapping[str, Record]) -> list[str]:
        """Return what was left out, and why."""
        notes = [note for record in records.values() for note in record["notes"]]
        if hopeless := dict.fromkeys(c.method for c in configurations(self.scene) if _hopeless(c)):
            turns = f"explicit steps would follow the mesh's fastest mode over {_MOST_TURNS:g} rad"
            notes.append(f"not run, {turns}: {', '.join(hopeless)}")
        return notes

    def findings(self, records: Mapping[str, Record]) -> Findings:
        """Name the cheapest configurations, and those that nothing beats."""
        found, notes, until = self.judged(records), self.notes(records), self.scene.time.t_end
        title = f"{self.scene.title}: up to t = {until:.6g} s, {len(found.points)} configurations"
        shown = [Text(title), *found.tables(), *(Text(f"note      {note}") for note in notes)]
        return Findings({"until": until, **found.document(), "notes": [*self.remarks, *notes]}, shown)

    def write(self, records: Mapping[str, Record], directory: Path, *, pictures: bool) -> list[Path]:
        """Write a row per point, and draw the work–precision diagrams."""
        from .picture import draw

        found = self.judged(records)
        front = found.front()
        rows = [{**point.row(), "on_front": point in front, "cause": point.cause} for point in found.points]
        files = [write_csv(directory / "tradeoff.csv", rows)]
        if pictures:
            notes = [*self.remarks, *self.notes(records)]
            files.append(draw(self.scene, found, notes, directory / "tradeoff.png"))
        return files


def _hopeless(configuration: Configuration) -> bool:
    """Tell whether an explicit method would have to follow the fastest mode of the mesh for too long."""
    scene = configuration.scene
    if configuration.method not in _EXPLICIT or scene.beam is None:
        return False
    return mesh_frequency(scene.beam) * scene.duration > _MOST_TURNS


def _largest_displacement(scene: Scene) -> float:
    """Return the largest displacement [m]; scipy's absolute tolerances are relative to it."""
    run = event_driven.simulate(scene, sample_times=np.linspace(scene.contact_time or 0.0, scene.time.t_end, 41))
    return max((float(np.abs(run[name]).max()) for name in ("u_tip", "y") if name in run.columns), default=1.0) or 1.0


def _run(configuration: Configuration, reach: float) -> tuple[Trajectory | str, float, float]:
    """Return the result or why it stopped, the solve time [s] and the setup time [s]."""
    scene = configuration.scene
    began = perf_counter()

    def limited(time: float, phase: str, macro_steps: int) -> None:
        if perf_counter() - began > _LIMIT:
            raise RunStopped(f"takes more than {_LIMIT:g} s", time)

    try:
        if configuration.method == ALGORITHM_1:
            run = algorithm1.simulate(scene)
            solve = float(run.summary["newton"]["time_per_step"]) * (len(run) - 1)
            return run, solve, perf_counter() - began - solve
        if configuration.method in SCIPY_TOLERANCES:
            run = _scipy(configuration, reach, [scene.time.t_end], _LIMIT)
            return run, float(run.summary["wall_time"]), perf_counter() - began - float(run.summary["wall_time"])
        run = simulate(scene, limited)
        return run, float(run.summary["wall_time"]), float(run.summary["setup_time"])
    except (RunStopped, event_driven.ReferenceFailure) as stopped:
        return str(stopped), perf_counter() - began, 0.0


def _scipy(
    configuration: Configuration, reach: float, times: Sequence[float] | np.ndarray, limit: float | None = None
) -> Trajectory:
    rtol = configuration.rtol
    return event_driven.simulate(
        configuration.scene, method=configuration.method, rtol=rtol, atol=1e-3 * rtol * reach, nodes=2,
        sample_times=times, time_limit=limit,
    )  # fmt: skip


def _judged_times(configuration: Configuration, run: Trajectory) -> np.ndarray:
    """Return the times of the rows that are judged: of adaptive steps some, as each costs the reference a size."""
    every = len(run) // _ADAPTIVE_ROWS + 1 if configuration.scene.coupling.adaptive else 1
    return np.asarray(run.time[::every])


def _point(timed: _Timed, reference: Trajectory | None) -> Point:
    configuration, run = timed.configuration, timed.run
    solves, setups = zip(*timed.times, strict=True)
    beam, size = configuration.scene.beam, configuration.scene.coupling.macro_step
    counts, cause = {}, ""
    found: Errors | None = None
    if isinstance(run, str):
        cause = run
    elif reference is not None:
        summary = run.summary
        counts = {
            "macro_steps": int(summary.get("macro_steps", 0)),
            "beam_steps": int(summary.get("beam_steps", 0)),
            "spring_steps": int(summary.get("spring_steps", 0)),
            "rollbacks": int(summary.get("beam_rollbacks", 0)) + int(summary.get("spring_rollbacks", 0)),
            "ida_steps": int(summary.get("spring_internal_steps", 0)),
        }
        mean = float(run.time[-1] - run.time[0]) / max(1, counts["macro_steps"])
        found = errors(run, reference, mean if size is None else size)
    return Point(
        family=configuration.family,
        setting=configuration.setting,
        method=configuration.method,
        refined=configuration.refined,
        unknowns=0 if beam is None else beam.modes_kept,
        macro_step=size,
        errors=found,
        cause=cause,
        solve=statistics.median(solves),
        solve_spread=max(solves) - min(solves),
        setup=statistics.median(setups),
        **counts,
    )
