"""Compare the co-simulation with the monolithic reference of its law, and judge the differences by bounds.

The bound of a quantity at time t is

    2 · max over [t₀, t] of |q_H − q_{2.3 H}|   +   (ε_IDA · steps + rounding) · growth · scale of q:

The difference from the companion run (`springbeam.run.companion`) is an upper bound of the discretisation error for any
order ≥ 1 (1.3 times the error at order 1), doubled because events mix orders. The second term is the tolerance of the
spring's integrator in every step and the rounding of the beam's modes, amplified like a perturbation of the reference.
The bound does not depend on the reference, so a wrong sign, mass or law, which converges to something else, fails.

Where the errors do not decrease as a power of H yet, both runs may be close by chance while both err; and what is
linear between rows is compared where both runs have one, which every 23rd macro point is. A difference beyond the bound
is therefore judged again, also by 4/3 of the difference from a run at H/4, which has a row at each macro point. Runs
that converge to something else than the reference change less by that, and still differ.

Nonsmooth trajectories separate: they are comparable until the first change of contact that the macro step, or a tiny
perturbation of the reference, moves to another position in the order of events. A run that is not resolved at its macro
step cannot be compared at all.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from typing import Any, Literal

import numpy as np

from ..monolithic import event_driven
from ..results.contact_changes import ContactChange, contact_changes
from ..results.dense import rows_at
from ..results.distance import apart
from ..results.trajectory import BODY_COLUMNS, Trajectory, columns_of
from ..run.companion import check
from ..run.runner import run_in_memory
from ..run.summary import NOT_RESOLVED
from ..scene import Scene, with_changes
from ..scene.frequencies import mesh_frequency, slowest_frequency
from .tables import Done, Row, unseen

Verdict = Literal["agrees", "differs", "not comparable"]
#: Factor on the difference from the companion; of differences from it and from a run at a quarter of the macro step,
#: whose error is a quarter at order 1, shape (2, 1).
_SAFETY = 2.0
_FACTORS = np.array([[1.0], [4.0 / 3.0]])
#: Least relative error of a step, unless IDA's tolerance is larger.
_LEAST = 1e-12
#: Relative change of the initial velocity that shows how fast two solutions separate, and how far that may grow.
PERTURBATION = 1e-7
_GROWTH = 1e4
#: Intervals of contact shorter than this many macro steps are ignored.
SHORT = 2.0
#: Where nothing has macro steps: shorter than this part of the time.
SHORT_SHARE = 2e-3
#: What a comparison computes: the run, its companion; the reference, from another velocity.
PARTS = 4
#: Quantities that are more than linear between rows.
_CURVES = ("u_tip", "v_tip", "y", "z", "contact_force")


def compare(scene: Scene, done: Done = unseen) -> Row:
    """Run ``scene`` and the reference of its law and return the comparison; ``done`` is called after each of `PARTS`.

    Returns
    -------
    Row
        ``verdict``; ``from``, ``horizon``, ``t_end``: compared from and to, and end of the run [s]; ``growth`` of a
        perturbation of the reference up to the horizon; ``quantities``: a row each, with the largest error (where a
        bound is broken the furthest out of it), when it occurred, its root mean square, the bound then, and whether it
        has passed; ``events``: a row per change of contact, whose ``time`` is ``None`` where the run lacks it;
        ``notes``; ``scene``; and ``runs``, both where they were compared.

    Raises
    ------
    SceneError
        If the reference is not defined for the scene.
    RunStopped, ReferenceFailure
        If either stops early.
    """
    record: Row = {"verdict": "differs", "from": scene.contact_time or 0.0, "t_end": scene.time.t_end, "growth": 1.0}
    record |= {"quantities": [], "events": [], "notes": [], "scene": scene.model_dump(exclude_none=True)}
    runs = _beside_event_driven(scene, record, done)
    record["runs"] = dict(zip(("co-simulation", "reference"), runs, strict=False))
    if all(row["passed"] for row in (*record["quantities"], *record["events"])):
        whole = record["horizon"] >= scene.time.t_end * (1.0 - 1e-12)
        record["verdict"] = "agrees" if record["quantities"] and whole else "not comparable"
    return record


def errors_judged(name: str, times: np.ndarray, error: np.ndarray, changed: np.ndarray, floor: np.ndarray) -> Row:
    """Judge the errors of a quantity at ``times`` [s] by what ``changed`` up to then, and a ``floor``."""
    bound = _SAFETY * np.maximum.accumulate(changed) + floor
    worst = int(np.argmax(error / bound))
    at = worst if error[worst] > bound[worst] else int(np.argmax(error))
    return {
        "quantity": name, "error": float(error[at]), "at": float(times[at]), "l2": float(np.sqrt(np.mean(error**2))),
        "bound": float(bound[at]), "passed": bool(np.all(error <= bound)),
    }  # fmt: skip


def _beside_event_driven(scene: Scene, record: Row, done: Done) -> tuple[Trajectory, ...]:
    """Compare a run with the event-driven reference, by bounds from its companion."""
    event_driven.refuse(scene)
    run = run_in_memory(scene)
    done()
    checked = check(run)
    run = checked.judged_run()
    companion = checked.companion
    done()
    record["horizon"] = record["from"]
    if companion is not None and checked.resolved:
        record["horizon"] = _same_story_until(run, companion)
    if companion is None or record["horizon"] <= record["from"]:
        unresolved = [warning for warning in run.summary["warnings"] if warning.startswith(NOT_RESOLVED)]
        record["notes"] += unresolved or [f"{NOT_RESOLVED}: longer steps change the motion from the first contact on"]
        return ()
    times = macro_points(scene)
    reference, moved = reference_and_perturbed(scene, times, done)
    _judge(record, [run, companion], reference, moved)
    if not all(row["passed"] for row in (*record["quantities"], *record["events"])):
        finer = run_in_memory(with_changes(scene, coupling={"macro_step": 0.25 * scene.coupling.H}))
        record["horizon"] = min(record["horizon"], _same_story_until(run, finer))
        _judge(record, [run, companion, finer], reference, moved)
    if not record["quantities"]:
        record["notes"].append(
            f"Nothing could be compared: another change of contact comes first, from t = {record['horizon']:.9g} s on, "
            "if the initial velocity changes a little; begin with another velocity, or at a distance"
        )
    return run, reference


def _judge(record: Row, runs: list[Trajectory], reference: Trajectory, moved: Trajectory) -> None:
    """Judge the first of ``runs`` against ``reference``, by its largest difference from the others.

    ``moved`` is the perturbed reference. The results replace those in ``found``, up to whose horizon they are.
    """
    judged_run = runs[0]
    scene = judged_run.scene
    size = scene.coupling.H
    times = macro_points(scene)
    of_reference, of_moved, *of_runs = (contact_changes(run, SHORT * size) for run in (reference, moved, *runs))
    stable = _agree_until(of_reference, of_moved, record["from"], float(judged_run.time[-1]))
    record["horizon"] = min(record["horizon"], stable)
    record |= {"growth": 1.0, "quantities": [], "events": []}
    before = times <= record["horizon"]
    # A jump at slightly different times is an event error, judged there.
    jumps = [event.time for run in (*runs, reference) for event in run.events]
    away = away_from(
        times, jumps + [kink for load in scene.loads if not load.is_finer_than(size) for kink in load.kinks], size
    )
    sampled = [sample(run, times, rows=run is not judged_run) for run in runs]
    for name in quantities(scene):
        values = np.array([columns[name] for columns in sampled])
        good = before & np.isfinite(values[0]) & (away | (name in ("u_tip", "y")))
        if good.sum() < 2:
            continue
        # Of the whole reference: what is away from events may be at rest to rounding.
        scale = float(np.nanmax(np.abs(reference[name]))) or 1.0
        values = values[:, good]
        exact = reference[name][good]
        growth = np.maximum(1.0, np.maximum.accumulate(np.abs(moved[name][good] - exact) / (PERTURBATION * scale)))
        record["growth"] = max(record["growth"], float(growth[-1]))
        floor = _step_error(scene) * (np.flatnonzero(good) + 1.0) + _SAFETY * _rounding(scene, name)
        changed = (_FACTORS[: len(runs) - 1] * _known_next(np.abs(values[1:] - values[0]))).max(axis=0)
        judged = errors_judged(name, times[good], np.abs(values[0] - exact), changed, floor * growth * scale)
        record["quantities"].append(judged)
    _compare_events(scene, record, of_runs, of_reference)


def _known_next(values: np.ndarray) -> np.ndarray:
    """Return ``values``, shape (m, n), with the next number of the row in place of each NaN, 0 without one."""
    places = np.where(np.isfinite(values), np.arange(values.shape[1]), values.shape[1])
    following = np.minimum.accumulate(places[:, ::-1], axis=1)[:, ::-1]
    return np.take_along_axis(np.column_stack([np.nan_to_num(values), np.zeros(len(values))]), following, axis=1)


def _same_story_until(run: Trajectory, other: Trajectory) -> float:
    """Return the time [s] up to which a run and one in other steps have the same changes of contact."""
    changes, others = (contact_changes(each, SHORT * run.scene.coupling.H) for each in (run, other))
    return _agree_until(changes, others, float(run.time[0]), float(run.time[-1]))


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
    scene: Scene, record: Row, of_runs: list[list[ContactChange]], reference: list[ContactChange]
) -> None:
    size = scene.coupling.H
    start = record["from"]
    found_changes = of_runs[0]
    moved = 0.0
    for i, (kind, time) in enumerate(change for change in reference if change.time <= record["horizon"]):
        row: dict[str, Any] = {"kind": kind, "time": None, "reference": time, "bound": 0.0, "passed": False}
        record["events"].append(row)
        if i >= len(found_changes) or found_changes[i].kind != kind:
            return
        ours = found_changes[i].time
        known = [changes[i].time for changes in of_runs if i < len(changes)]
        moved = max([moved, *(_FACTORS[: len(known) - 1, 0] * np.abs(np.subtract(known[1:], known[0]))).tolist()])
        steps = (time - start) / size + 1.0
        # The unit of time in which the state changes as a whole is what the events so far have taken.
        bound = _SAFETY * moved + _step_error(scene) * steps * record["growth"] * max(time - start, size)
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
    whole, _ = scene.equal_steps
    return np.minimum((scene.contact_time or 0.0) + scene.coupling.H * np.arange(whole + 1), scene.time.t_end)


def away_from(times: np.ndarray, events: Iterable[float], size: float) -> np.ndarray:
    """Return which of ``times`` are more than `SHORT` and a half macro steps of ``size`` [s] away from all events."""
    apart = np.abs(times[:, None] - np.array([*events, np.inf]))
    return np.all(apart > (SHORT + 0.5) * size, axis=1)


def quantities(scene: Scene) -> list[str]:
    """Return the columns that are compared."""
    wanted = ("u_tip", "v_tip", "e_beam", "y", "z", "e_spring", "contact_force", *BODY_COLUMNS)
    there = columns_of(scene).keys() - {"bending_stress"}  # which follows from strains: the references have none
    return [name for name in wanted if name in there]


def sample(run: Trajectory, times: np.ndarray, *, rows: bool = False) -> dict[str, np.ndarray]:
    """Return the `quantities` of a run at macro points [s], NaN after its end.

    With ``rows`` those that are linear between its rows are NaN there: a run and its companion share every 23rd point.
    """
    H = run.scene.coupling.H
    there = run.time
    nearest = there[np.searchsorted(there, times - 1e-9 * H).clip(max=len(there) - 1)]  # what is known at rows alone
    on_row = np.abs(nearest - times) <= 1e-9 * H
    wanted = np.where(on_row, nearest, times)
    columns = rows_at(run, np.minimum(wanted, there[-1]))
    known = wanted <= there[-1]
    return {
        name: np.where(known & (on_row | (not rows) | (name in _CURVES)), columns[name], np.nan)
        for name in quantities(run.scene)
    }
