"""Compare the co-simulation with the monolithic reference of its law, and judge the differences by bounds.

The bound of a quantity at time t is

    4 · max over [t₀, t] of |q_H − q_{H/2}|   +   (ε_IDA · steps + rounding) · growth · scale of q:

The difference of halving the macro step is an upper estimate of the discretisation error for any order ≥ 1 (twice the
difference at order 1), doubled again because events mix orders. The second term is the tolerance of the spring's
integrator in every step and the rounding of the beam's modes, amplified like a perturbation of the reference. The bound
does not depend on the reference, so a wrong sign, mass or law, which converges to something else, fails.

Where the errors do not decrease as a power of H yet, the runs at H and H/2 may be close by chance while both err. A
difference beyond the bound is therefore judged again by the larger of both halvings, from H and from H/2. Runs that
converge to something else than the reference change less by the second halving, and still differ.

Nonsmooth trajectories separate: they are comparable until the first change of contact that the macro step, or a tiny
perturbation of the reference, moves to another position in the order of events. A run that is not resolved at its macro
step cannot be compared at all.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from contextlib import suppress
from typing import Any, Literal

import numpy as np

from ..monolithic import event_driven
from ..pictures.drawing import present
from ..results.contact_changes import ContactChange, contact_changes
from ..results.dense import rows_at
from ..results.distance import apart
from ..results.trajectory import BODY_COLUMNS, Trajectory, columns_of
from ..run.runner import run_in_memory
from ..scene import Scene, SceneError, with_changes
from ..scene.frequencies import mesh_frequency, slowest_frequency
from .tables import Done, Row, unseen

Verdict = Literal["agrees", "differs", "not comparable"]
#: Largest change by halving the macro step, relative to the largest displacement (velocity), of a resolved motion.
_RESOLVED = {"u_tip": 0.05, "y": 0.05, "v_tip": 0.25, "z": 0.25}
#: Factor on the difference of halving the macro step.
_SAFETY = 4.0
#: Least relative error of a step, unless IDA's tolerance is larger.
_LEAST = 1e-12
#: Relative change of the initial velocity that shows how fast two solutions separate, and how far that may grow.
PERTURBATION = 1e-7
_GROWTH = 1e4
#: Intervals of contact shorter than this many macro steps are ignored.
SHORT = 2.0
#: The same where nothing has macro steps, as a share of the time.
SHORT_SHARE = 2e-3
#: What a comparison computes: the run, at half its macro step; the reference, from another velocity.
PARTS = 4
#: Columns of both motions that are kept for a picture.
_DRAWN = ("time", "u_tip", "y", "v_tip", "z", "contact_force", "foundation_force")


def compare(scene: Scene, done: Done = unseen) -> Row:
    """Run ``scene`` and the reference of its law and return the comparison; ``done`` is called after each of `PARTS`.

    Returns
    -------
    Row
        ``verdict``; ``from``, ``horizon``, ``t_end``: compared from and to, and end of the run [s]; ``growth`` of a
        perturbation of the reference up to the horizon; ``quantities``: a row each, with the largest error (where a
        bound is broken the furthest out of it), when it occurred, its root mean square, the bound then, and whether it
        has passed; ``events``: a row per change of contact, whose ``time`` is ``None`` where the run lacks it;
        ``notes``; ``scene``; and ``runs``, what is drawn of both where they were compared.

    Raises
    ------
    SceneError
        If the reference is not defined for the scene.
    RunStopped, ReferenceFailure
        If either stops early.
    """
    found: Row = {"verdict": "differs", "from": scene.contact_time or 0.0, "t_end": scene.time.t_end, "growth": 1.0}
    found |= {"quantities": [], "events": [], "notes": [], "scene": scene.model_dump(exclude_none=True)}
    runs = _beside_event_driven(scene, found, done)
    found["runs"] = {
        name: Trajectory(scene, {column: run[column] for column in present(run, _DRAWN)}, run.events)
        for name, run in zip(("co-simulation", "reference"), runs, strict=False)
    }
    if all(row["passed"] for row in (*found["quantities"], *found["events"])):
        whole = found["horizon"] >= scene.time.t_end * (1.0 - 1e-12)
        found["verdict"] = "agrees" if found["quantities"] and whole else "not comparable"
    return found


def _judged(name: str, times: np.ndarray, error: np.ndarray, changed: np.ndarray, floor: np.ndarray) -> Row:
    """Judge the errors of a quantity at ``times`` [s] by what ``changed`` up to then, and a ``floor``."""
    bound = _SAFETY * np.maximum.accumulate(changed) + floor
    worst = int(np.argmax(error / bound))
    at = worst if error[worst] > bound[worst] else int(np.argmax(error))
    return {
        "quantity": name, "error": float(error[at]), "at": float(times[at]), "l2": float(np.sqrt(np.mean(error**2))),
        "bound": float(bound[at]), "passed": bool(np.all(error <= bound)),
    }  # fmt: skip


def _beside_event_driven(scene: Scene, found: Row, done: Done) -> tuple[Trajectory, ...]:
    """Compare a run with the event-driven reference, by bounds from a run at half its macro step."""
    event_driven.refuse(scene)
    coarse = run_in_memory(scene)
    done()
    fine = _halved(coarse)
    done()
    found["horizon"] = _same_story_until(coarse, fine) if coarse.summary["resolved"] else found["from"]
    if found["horizon"] <= found["from"]:
        said = [warning for warning in coarse.summary["warnings"] if warning.startswith("not resolved")]
        found["notes"] += said or ["not resolved: half the macro step changes the motion from the first contact on"]
        return ()
    times = macro_points(scene)
    reference, moved = reference_and_perturbed(scene, times, done)
    _judge(found, [coarse, fine], reference, moved)
    if not all(row["passed"] for row in (*found["quantities"], *found["events"])):
        finest = _halved(fine)
        found["horizon"] = min(found["horizon"], _same_story_until(fine, finest))
        _judge(found, [coarse, fine, finest], reference, moved)
    if not found["quantities"]:
        found["notes"].append(
            f"Nothing could be compared: another change of contact comes first, from t = {found['horizon']:.9g} s on, "
            "if the initial velocity changes a little; begin with another velocity, or at a distance"
        )
    return coarse, reference


def _halved(run: Trajectory) -> Trajectory:
    """Return the run of the same scene at half the macro step."""
    scene = run.scene
    return run_in_memory(with_changes(scene, coupling={"macro_step": 0.5 * scene.coupling.H}))


def _judge(found: Row, runs: list[Trajectory], reference: Trajectory, moved: Trajectory) -> None:
    """Judge the first of ``runs`` against ``reference``, by what each halving of its macro step to the next changes.

    ``moved`` is the perturbed reference. The results replace those in ``found``, up to whose horizon they are.
    """
    coarse = runs[0]
    scene = coarse.scene
    size = scene.coupling.H
    times = macro_points(scene)
    of_reference, of_moved, *of_runs = (contact_changes(run, SHORT * size) for run in (reference, moved, *runs))
    stable = _agree_until(of_reference, of_moved, found["from"], float(coarse.time[-1]))
    found["horizon"] = min(found["horizon"], stable)
    found |= {"growth": 1.0, "quantities": [], "events": []}
    before = times <= found["horizon"]
    # A jump at slightly different times is an event error, judged there.
    jumps = [event.time for run in (coarse, reference) for event in run.events]
    away = away_from(
        times, jumps + [kink for load in scene.loads if not load.is_finer_than(size) for kink in load.kinks], size
    )
    sampled = [sample(run, times) for run in runs]
    for name in quantities(scene):
        values = np.array([columns[name] for columns in sampled])
        good = before & np.isfinite(values).all(axis=0) & (away | (name in ("u_tip", "y")))
        if good.sum() < 2:
            continue
        # Of the whole reference: what is away from events may be at rest to rounding.
        scale = float(np.nanmax(np.abs(reference[name]))) or 1.0
        values = values[:, good]
        exact = reference[name][good]
        growth = np.maximum(1.0, np.maximum.accumulate(np.abs(moved[name][good] - exact) / (PERTURBATION * scale)))
        found["growth"] = max(found["growth"], float(growth[-1]))
        floor = _step_error(scene) * (np.flatnonzero(good) + 1.0) + _SAFETY * _rounding(scene, name)
        changed = np.abs(np.diff(values, axis=0)).max(axis=0)
        judged = _judged(name, times[good], np.abs(values[0] - exact), changed, floor * growth * scale)
        found["quantities"].append(judged)
    _compare_events(scene, found, of_runs, of_reference)


def _same_story_until(coarse: Trajectory, fine: Trajectory) -> float:
    """Return the time [s] up to which a run and that at half its macro step agree.

    They agree if they have the same events, and halving hardly changes displacements and velocities away from events.
    """
    times = macro_points(coarse.scene)
    size = coarse.scene.coupling.H
    changes, others = (contact_changes(run, SHORT * size) for run in (coarse, fine))
    horizon = _agree_until(changes, others, float(times[0]), float(coarse.time[-1]))
    away = away_from(times, (event.time for run in (coarse, fine) for event in run.events), size)
    values, finer = (rows_at(run, times) for run in (coarse, fine))
    for name in present(coarse, _RESOLVED):
        differ = away & (apart(finer[name], values[name]) > _RESOLVED[name])
        if differ[1:].any():
            horizon = min(horizon, float(times[1:][differ[1:]][0]) - size)
    return horizon


def _step_error(scene: Scene) -> float:
    """Return the relative tolerance of the spring's integrator in a step."""
    return _LEAST if scene.spring is None else max(_LEAST, scene.spring.relative_tolerance)


def _rounding(scene: Scene, name: str) -> float:
    """Return an estimate of the relative rounding of the beam's slow motion by its fastest modes.

    It is ε √(λ_max/λ₁); for accelerations and inner forces ε λ_max/λ₁.
    """
    beam = scene.beam
    if beam is None:
        return 0.0
    ratio = max(1.0, mesh_frequency(beam) / slowest_frequency(beam))
    return float(np.finfo(float).eps * ratio ** (2 if name in BODY_COLUMNS else 1))


def _agree_until(first: list[ContactChange], second: list[ContactChange], start: float, t_end: float) -> float:
    """Return the time [s] before the first change that the other run does not have at the same position."""
    before = start
    for a, b in itertools.zip_longest(first, second):
        soonest = min(change.time for change in (a, b) if change is not None)
        if a is None or b is None or a.kind != b.kind or abs(a.time - b.time) > 0.1 * (soonest - before) > 0.0:
            return before + 0.9 * (soonest - before)
        before = a.time
    return t_end


def _compare_events(
    scene: Scene, found: Row, of_runs: list[list[ContactChange]], reference: list[ContactChange]
) -> None:
    size = scene.coupling.H
    start = found["from"]
    coarse = of_runs[0]
    moved = 0.0
    for i, (kind, time) in enumerate(change for change in reference if change.time <= found["horizon"]):
        row: dict[str, Any] = {"kind": kind, "time": None, "reference": time, "bound": 0.0, "passed": False}
        found["events"].append(row)
        if i >= len(coarse) or coarse[i].kind != kind:
            return
        ours = coarse[i].time
        known = [changes[i].time for changes in of_runs if i < len(changes)]
        moved = max([moved, *np.abs(np.diff(known)).tolist()])
        steps = (time - start) / size + 1.0
        # The unit of time in which the state changes as a whole is what the events so far have taken.
        bound = _SAFETY * moved + _step_error(scene) * steps * found["growth"] * max(time - start, size)
        row |= {"time": ours, "bound": bound, "passed": abs(ours - time) <= bound}


def reference_and_perturbed(scene: Scene, times: np.ndarray, done: Done = unseen) -> tuple[Trajectory, Trajectory]:
    """Return the reference at ``times`` [s], and once more from initial velocities changed by `PERTURBATION`."""
    equations = event_driven.Equations(scene)
    reference = event_driven.integrate(equations, sample_times=times)
    done()
    change = PERTURBATION * initial_speed(scene)
    moved = event_driven.integrate(equations, sample_times=times, velocity_perturbation=change)
    done()
    return reference, moved


def perturbed(scene: Scene, share: float, **options: Any) -> Iterator[Trajectory]:
    """Yield the reference of ``scene`` from initial velocities changed by ``share`` of them; ``options`` of its run.

    First the beam's; then that of a spring, decreased and increased, if it may have any: a spring that the tip meets a
    little above Ψ may be met a little below it, where another phase follows.
    """
    change = share * initial_speed(scene)
    yield event_driven.integrate(scene, velocity_perturbation=change, **options)
    if scene.spring is not None and scene.beam is not None:
        start = scene.spring.initial_velocity
        speed = change * scene.beam.length
        for velocity in (start - speed, start + speed):
            with suppress(SceneError):  # a spring that is held until the tip arrives
                pushed = with_changes(scene, spring={"initial_velocity": velocity})
                yield event_driven.integrate(pushed, **options)


def initial_speed(scene: Scene) -> float:
    """Return the speed at the start [m/s], of a beam's slope [1/s], to which a perturbation is relative."""
    if scene.beam is not None:
        return abs(scene.beam.initial_velocity_slope) or abs(scene.beam.initial_deflection_slope) or 1.0
    assert scene.spring is not None
    return abs(scene.spring.initial_velocity) or abs(scene.spring.equilibrium) or 1.0


def comparable_until(scene: Scene) -> float:
    """Return the end of the window in which a perturbation of the reference grows less than 1e4 times and moves no
    change of contact [s]."""
    times = np.linspace(scene.contact_time or 0.0, scene.time.t_end, 401)
    exact, moved = reference_and_perturbed(scene, times)
    changes = [contact_changes(run, SHORT_SHARE * float(np.ptp(times))) for run in (exact, moved)]
    end = _agree_until(changes[0], changes[1], float(times[0]), scene.time.t_end)
    name = "u_tip" if scene.beam is not None else "y"
    off = apart(moved[name], exact[name]) > _GROWTH * PERTURBATION
    return min(end, *times[off].tolist()) if off.any() else end


def macro_points(scene: Scene) -> np.ndarray:
    """Return the times of the macro grid of ``scene`` [s]."""
    start = scene.contact_time or 0.0
    H = scene.coupling.H
    end = scene.time.t_end
    return np.minimum(start + H * np.arange(np.floor((end - start) / H * (1.0 + 1e-9)) + 1.0), end)


def away_from(times: np.ndarray, events: Iterable[float], size: float) -> np.ndarray:
    """Return which of ``times`` are more than `SHORT` and a half macro steps of ``size`` [s] away from all events."""
    apart = np.abs(times[:, None] - np.array([*events, np.inf]))
    return np.asarray(np.all(apart > (SHORT + 0.5) * size, axis=1))


def quantities(scene: Scene) -> list[str]:
    """Return the columns that are compared."""
    wanted = ("u_tip", "v_tip", "e_beam", "y", "z", "e_spring", "contact_force", *BODY_COLUMNS)
    there = columns_of(scene).keys() - {"bending_stress"}  # which follows from strains: the references have none
    return [name for name in wanted if name in there]


def sample(run: Trajectory, times: np.ndarray) -> dict[str, np.ndarray]:
    """Return the `quantities` of a run at macro points [s], NaN after its end."""
    H = run.scene.coupling.H
    rows = run.time
    nearest = rows[np.searchsorted(rows, times - 1e-9 * H).clip(max=len(rows) - 1)]  # what is known at rows alone
    wanted = np.where(np.abs(nearest - times) <= 1e-9 * H, nearest, times)
    found = rows_at(run, np.minimum(wanted, rows[-1]))
    return {name: np.where(wanted <= rows[-1], found[name], np.nan) for name in quantities(run.scene)}
