"""Speed against accuracy: a scene run in many configurations, with the errors and the cost of each.

The reference is the event-driven monolithic solution of the same semi-discrete model, so that what is measured is
the coupling and the time integration. Where the model itself varies (modes, elements) it is the reference on a finer
mesh. scipy's solvers and the paper's Algorithm 1 run in the same process on the same model.
"""

from __future__ import annotations

import csv
import statistics
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from ...monolithic import algorithm1, event_driven
from ...results.trajectory import Trajectory
from ...run.outcome import RunStopped
from ...run.runner import simulate
from ...scene import Scene, SceneError, with_changes
from ...scene.resolution import mesh_frequency
from ..reference import comparable_until, refuse_without_reference
from .configurations import ALGORITHM_1, Configuration, configurations, finer
from .errors import Errors, errors

__all__ = ["TARGETS", "Cheapest", "Point", "Study", "study", "write_csv"]

#: Relative errors for which the table names the cheapest configuration.
TARGETS = (1e-2, 1e-4, 1e-6, 1e-8)
#: A run that takes longer than this is given up, and finer ones of its family are not begun [s].
_LIMIT = 10.0
#: So long the reference on a finer mesh may take [s].
_LIMIT_FINER = 60.0
#: Runs longer than this are timed once [s].
_TIMED_ONCE = 3.0
#: Methods whose steps are stable up to a few radians of the fastest mode, and how many radians they are let go [rad].
_EXPLICIT, _MOST_TURNS = ("DOP853", "LSODA"), 1e5
#: Rows of a run of adaptive steps that are compared, about.
_ADAPTIVE_ROWS = 60


@dataclass(frozen=True)
class Point:
    """A configuration, its errors and its cost."""

    configuration: Configuration
    errors: Errors | None  #: ``None`` if the run stopped early
    cause: str  #: why it stopped, or empty
    solve: float  #: median wall time [s] from the start to the end of the window
    solve_spread: float  #: largest minus smallest [s]
    setup: float  #: wall time before the first step [s]: loading and initialising FMUs, or the modal decomposition
    macro_steps: int = 0
    beam_steps: int = 0  #: doStep calls, those that were rolled back included
    spring_steps: int = 0
    rollbacks: int = 0
    ida_steps: int = 0

    @property
    def do_steps(self) -> int:
        """doStep calls of both FMUs."""
        return self.beam_steps + self.spring_steps

    @property
    def displacement(self) -> float:
        return float("inf") if self.errors is None else self.errors.displacement


@dataclass(frozen=True)
class Cheapest:
    """The cheapest ways to an error, by this package and by scipy's solvers; ``None`` where none gets there."""

    target: float
    ours: Point | None
    scipy: Point | None

    @property
    def ratio(self) -> float:
        if self.ours is None or self.scipy is None:
            return float("nan")
        return self.scipy.solve / self.ours.solve


@dataclass
class Study:
    """What `study` found."""

    scene: Scene  #: ends with the compared window
    points: list[Point]
    notes: list[str] = field(default_factory=list)

    def front(self) -> list[Point]:
        """Return the Pareto front, the cheapest first: no other point is both quicker and more accurate.

        Errors of a tenth of the motion and more are no results.
        """
        best, front = 0.1, []
        for point in sorted((p for p in self.points if not p.configuration.refined), key=lambda p: p.solve):
            if point.displacement < best:
                best = point.displacement
                front.append(point)
        return front

    def cheapest(self) -> list[Cheapest]:
        """Return the cheapest configurations for each of `TARGETS`."""

        def best(points: Iterable[Point], target: float) -> Point | None:
            good = [p for p in points if p.displacement <= target]
            return min(good, key=lambda p: p.solve, default=None)

        same = [p for p in self.points if not p.configuration.refined]
        ours = [p for p in same if not p.configuration.monolithic]
        theirs = [p for p in same if p.configuration.monolithic and p.configuration.method != ALGORITHM_1]
        return [Cheapest(target, best(ours, target), best(theirs, target)) for target in TARGETS]


#: ``progress(done, total, name)``.
Progress = Callable[[int, int, str], None]


def study(
    scene: Scene, until: float | None = None, repeats: int = 3, progress: Progress | None = None, *, quick: bool = False
) -> Study:
    """Run ``scene`` in all its configurations, and judge and time each.

    Parameters
    ----------
    scene
        Any but one of law `paper`.
    until
        End of the compared window [s]; default `comparable_until`.
    repeats
        Timings of each configuration, taken in turn; their median counts.
    progress
        Called before each run.
    quick
        Takes every third configuration of each family only, times each once, and gives up a family ten times sooner.

    Raises
    ------
    SceneError
        If no reference is defined for the scene.
    """
    if scene.contact.law == "paper":
        raise SceneError("[contact] law = \"paper\": Algorithm 1 has no exact solution to compare with; "
                         'law = "transmission" or "compliance" has')  # fmt: skip
    refuse_without_reference(scene)
    window = comparable_until(scene) if until is None else min(until, scene.time.t_end)
    notes = []
    if scene.accuracy is not None:
        notes.append(f"accuracy = {scene.accuracy:g} is left out: each configuration has its own scheme and steps")
    scene = with_changes(scene, accuracy=None, time={"t_end": window})
    every, limit = configurations(scene), _LIMIT
    if quick:
        families: dict[str, list[Configuration]] = {}
        for configuration in every:
            families.setdefault(configuration.family, []).append(configuration)
        every, repeats, limit = [c for family in families.values() for c in family[::3]], 1, 0.1 * _LIMIT
    hopeless = [c for c in every if _hopeless(c)]
    todo = [c for c in every if c not in hopeless]
    total, done = len(todo) * repeats, 0
    runs: dict[Configuration, Trajectory | str] = {}
    timings: dict[Configuration, list[tuple[float, float]]] = {}
    given_up: dict[str, Configuration] = {}
    reach = _largest_displacement(scene)
    for repeat in range(repeats):
        for configuration in todo:
            done += 1
            if progress is not None:
                progress(done, total, configuration.name)
            if repeat == 0 and configuration.family in given_up:
                continue
            if repeat > 0 and (
                not isinstance(runs.get(configuration), Trajectory) or timings[configuration][0][0] > _TIMED_ONCE
            ):
                continue
            run, solve, setup = _run(configuration, window, reach)
            runs.setdefault(configuration, run)
            timings.setdefault(configuration, []).append((solve, setup))
            if repeat == 0 and solve > limit:
                given_up[configuration.family] = configuration
    if given_up:
        names = "; ".join(c.name for c in given_up.values())
        notes.append(f"given up after {limit:g} s, finer ones of their kind not run: {names}")
    if hopeless:
        names = ", ".join(dict.fromkeys(c.method for c in hopeless))
        notes.append(f"not run, explicit steps would follow the mesh's fastest mode over {_MOST_TURNS:g} rad: {names}")
    return _judged(scene, todo, runs, timings, reach, notes)


def _hopeless(configuration: Configuration) -> bool:
    """Tell whether an explicit method would have to follow the fastest mode of the mesh for too long."""
    scene = configuration.scene
    if configuration.method not in _EXPLICIT or scene.beam is None:
        return False
    return mesh_frequency(scene.beam) * (scene.time.t_end - (scene.contact_time or 0.0)) > _MOST_TURNS


def _largest_displacement(scene: Scene) -> float:
    """Return the largest displacement [m]; scipy's absolute tolerances are relative to it."""
    run = event_driven.simulate(scene, sample_times=np.linspace(scene.contact_time or 0.0, scene.time.t_end, 41))
    return max((float(np.abs(run[name]).max()) for name in ("u_tip", "y") if name in run.columns), default=1.0) or 1.0


def _run(configuration: Configuration, window: float, reach: float) -> tuple[Trajectory | str, float, float]:
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
        if configuration.monolithic:
            rtol = configuration.rtol
            run = event_driven.simulate(
                scene, method=configuration.method, rtol=rtol, atol=1e-3 * rtol * reach, nodes=2, sample_times=[window],
                time_limit=_LIMIT,
            )  # fmt: skip
            return run, float(run.summary["wall_time"]), perf_counter() - began - float(run.summary["wall_time"])
        run = simulate(scene, limited)
        return run, float(run.summary["wall_time"]), float(run.summary["setup_time"])
    except (RunStopped, algorithm1.AlgorithmFailure, event_driven.ReferenceFailure) as stopped:
        return str(stopped), perf_counter() - began, 0.0


def _judged(
    scene: Scene,
    todo: list[Configuration],
    runs: dict[Configuration, Trajectory | str],
    timings: dict[Configuration, list[tuple[float, float]]],
    reach: float,
    notes: list[str],
) -> Study:
    grid = np.linspace(scene.contact_time or 0.0, scene.time.t_end, 401)
    results = {c: r for c, r in runs.items() if isinstance(r, Trajectory)}
    references: dict[bool, Trajectory] = {}
    for refined in (False, True):
        model = finer(scene) if refined else scene
        times = [_judged_times(c, r) for c, r in results.items() if c.refined == refined and not _scipy(c)]
        if model is None or not (times or not refined):
            continue
        samples = np.unique(np.concatenate([grid, *times]))
        try:
            references[refined] = event_driven.simulate(
                model, sample_times=samples, time_limit=_LIMIT_FINER if refined else None
            )
        except event_driven.ReferenceFailure as failed:
            if not refined:
                raise
            notes.append(f"modes and elements not judged: on a finer mesh the reference {failed}")
    points = []
    for configuration in todo:
        run = runs.get(configuration)
        if run is None or configuration.refined not in references:
            continue
        if isinstance(run, Trajectory) and _scipy(configuration):
            # Timed without rows; its errors are those of the same steps, sampled.
            run = _sampled(configuration, grid, reach)
        points.append(_point(configuration, run, references, timings[configuration]))
    return Study(scene, points, notes)


def _judged_times(configuration: Configuration, run: Trajectory) -> np.ndarray:
    """Return the times of the rows that are judged: of adaptive steps some, as each costs the reference a size."""
    every = len(run) // _ADAPTIVE_ROWS + 1 if configuration.scene.coupling.adaptive else 1
    return np.asarray(run.time[::every])


def _scipy(configuration: Configuration) -> bool:
    return configuration.monolithic and configuration.method != ALGORITHM_1


def _sampled(configuration: Configuration, grid: np.ndarray, reach: float) -> Trajectory | str:
    rtol = configuration.rtol
    try:
        return event_driven.simulate(
            configuration.scene, method=configuration.method, rtol=rtol, atol=1e-3 * rtol * reach, nodes=2,
            sample_times=grid,
        )  # fmt: skip
    except event_driven.ReferenceFailure as failed:
        return str(failed)


def _point(
    configuration: Configuration,
    run: Trajectory | str,
    references: dict[bool, Trajectory],
    timing: list[tuple[float, float]],
) -> Point:
    solves = [solve for solve, _ in timing]
    solve, spread = statistics.median(solves), max(solves) - min(solves)
    setup = statistics.median(setup for _, setup in timing)
    if isinstance(run, str):
        return Point(configuration, None, run, solve, spread, setup)
    summary = run.summary
    size = configuration.scene.coupling.macro_step
    if size is None:
        size = float(run.time[-1] - run.time[0]) / max(1, int(summary["macro_steps"]))
    found = errors(run, references[configuration.refined], size)
    return Point(
        configuration, found, "", solve, spread, setup,
        macro_steps=int(summary.get("macro_steps", 0)),
        beam_steps=int(summary.get("beam_steps", 0)),
        spring_steps=int(summary.get("spring_steps", 0)),
        rollbacks=int(summary.get("beam_rollbacks", 0)) + int(summary.get("spring_rollbacks", 0)),
        ida_steps=int(summary.get("spring_internal_steps", 0)),
    )  # fmt: skip


def write_csv(found: Study, path: Path) -> None:
    """Write one row per point; empty where a quantity does not apply."""
    names = [*Errors.__dataclass_fields__]
    costs = ["solve", "solve_spread", "setup", "macro_steps", "beam_steps", "spring_steps", "rollbacks", "ida_steps"]
    front = found.front()
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["family", "setting", "against", *names, *costs, "on_front", "cause"])
        for point in found.points:
            values: dict[str, Any] = {} if point.errors is None else asdict(point.errors)
            against = "finer mesh" if point.configuration.refined else "same model"
            writer.writerow([
                point.configuration.family, point.configuration.setting, against,
                *(_cell(values.get(name)) for name in names),
                *(_cell(getattr(point, name)) for name in costs), point in front, point.cause,
            ])  # fmt: skip


def _cell(value: float | None) -> str:
    if value is None or (isinstance(value, float) and not np.isfinite(value)):
        return ""
    return str(value) if isinstance(value, int) else f"{value:.6g}"
