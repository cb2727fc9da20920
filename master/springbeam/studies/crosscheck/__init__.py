"""Is the co-simulation right? It is run beside the monolithic reference of its law and judged by bounds of its own.

The bound of a quantity at time t is

    4 · max over [t₀, t] of |q_H − q_{H/2}|   +   (ε_IDA · steps + rounding) · growth · scale of q:

what halving the macro step changes is an upper estimate of the discretisation error for any order ≥ 1 (twice the
difference at order 1), doubled again because events mix orders; the second term is the tolerance of the spring's
integrator in every step and the rounding of the beam's modes, grown as fast as the reference grows a perturbation; so
is what a one-way coupling neglects, since the reference is two-way.
Nothing in it knows the reference, so a wrong sign, mass or law, which converges to something else, fails.

Nonsmooth trajectories separate: comparable is what comes before the first change of contact that the macro step, or a
tiny perturbation of the reference, moves to another place in the order of events.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np

from ...monolithic import algorithm1, event_driven
from ...results.trajectory import Event, Trajectory
from ...run.outcome import RunStopped
from ...run.runner import simulate
from ...scene import Scene, SceneError, with_changes
from ...scene.automatic import decided
from ...scene.resolution import mesh_frequency
from ...scene.statics import tip_compliance

_SAFETY = 4.0
#: Relative tolerance of IDA, the spring FMU's default.
_IDA_TOLERANCE = 1e-12
#: Relative change of the initial velocity that measures how fast the reference separates from itself.
_PERTURBATION = 1e-7
#: A scene whose comparable window is shorter than this many macro steps is resolved further, 4 times at a go.
_ENOUGH_STEPS, _REFINEMENT, _MAX_REFINEMENTS = 40, 4.0, 16
#: Macro steps of a window that had to be resolved further.
_WINDOW_STEPS = 400
#: Largest change by halving the macro step, relative to the largest displacement (velocity), of a resolved motion.
_RESOLVED, _RESOLVED_VELOCITY = 0.05, 0.25
#: Intervals of contact shorter than this many macro steps are no evidence either way.
_SHORT = 2.0

_DISPLACEMENTS, _VELOCITIES = ("u_tip", "y"), ("v_tip", "z")
_ENERGIES = ("e_beam", "e_spring")


@dataclass(frozen=True)
class Row:
    """One compared quantity."""

    quantity: str
    error: float  #: max norm, in the quantity's unit
    at: float  #: where it occurred [s]
    l2: float  #: root mean square over the window
    bound: float  #: at that time
    passed: bool
    times: np.ndarray  #: of the compared rows [s]
    errors: np.ndarray
    bounds: np.ndarray


@dataclass(frozen=True)
class EventRow:
    """One change of contact or stop impact."""

    kind: str
    time: float
    reference: float
    bound: float
    passed: bool


@dataclass
class Report:
    """What `crosscheck` found."""

    scene: Scene  #: as compared: the macro step and t_end may be finer and shorter than asked
    reference: Trajectory
    trajectory: Trajectory
    horizon: float  #: comparable up to here [s]
    growth: float  #: of a perturbation of the reference up to the horizon
    rows: list[Row] = field(default_factory=list)
    events: list[EventRow] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def passed(self) -> bool:
        return all(row.passed for row in self.rows) and all(row.passed for row in self.events)


def crosscheck(scene: Scene) -> Report:
    """Run ``scene`` and the reference of its law and compare them.

    Raises
    ------
    SceneError
        If the reference is not defined for the scene (law `transmission` with ``contact.impact = "rest"``).
    RunStopped, ReferenceFailure
        If either stops early.
    """
    if scene.contact.law == "paper":
        return _crosscheck_paper(scene)
    if scene.contact.impact == "rest" and scene.contact.law == "transmission" and scene.beam and scene.spring:
        raise SceneError("contact.impact = 'rest': a rigid tie has no reference there; take 'inelastic' or 'tip'")
    if scene.contact.law == "compliance" and scene.beam and scene.beam.fidelity == "quasi_static":
        raise SceneError("beam.fidelity = 'quasi_static': has no reference with law 'compliance'; take 'dynamic'")
    asked, note, failure = scene, "", None
    for _ in range(_MAX_REFINEMENTS):
        start, size = scene.contact_time or 0.0, scene.coupling.H
        try:
            coarse, fine, own_horizon = _pair(scene)
            if own_horizon - start >= min(_ENOUGH_STEPS * size, 0.5 * (scene.time.t_end - start)):
                break
        except RunStopped as stopped:  # a finer step may get through
            failure = stopped
        size /= _REFINEMENT
        t_end = min(asked.time.t_end, start + _WINDOW_STEPS * size)
        scene = with_changes(scene, time={"t_end": t_end}, coupling={"macro_step": size})
        note = (
            f"At the scene's own macro step, {asked.coupling.H:g} s, the motion is not resolved: halving it "
            f"changes the motion from the first contact on. Compared instead: {size:.3g} s, up to {t_end:.9g} s."
        )
    else:
        raise failure or SceneError(f"{note} Nothing could be compared at any macro step")
    report = _compare(scene, coarse, fine, own_horizon)
    if note:
        report.notes.insert(0, note)
    return report


def _pair(scene: Scene) -> tuple[Trajectory, Trajectory, float]:
    """The run, the run at half the macro step, and the time up to which both tell the same story.

    That is the same events, a run that does not call itself unresolved, and displacements and velocities, away from
    events, that halving hardly changes.
    """
    size = scene.coupling.H
    coarse, fine = simulate(scene), simulate(with_changes(scene, coupling={"macro_step": 0.5 * size}))
    changes = [contact_changes(run.events, _SHORT * size) for run in (coarse, fine)]
    horizon = _agree_until(changes[0], changes[1], float(coarse.time[0]), float(coarse.time[-1]))
    if not coarse.summary["resolved"]:
        return coarse, fine, float(coarse.time[0])
    times = _grid(coarse, scene)
    for name in (*_DISPLACEMENTS, *_VELOCITIES):
        if name in coarse.columns:
            values = _at(coarse, times, name)
            allowed = _RESOLVED if name in _DISPLACEMENTS else _RESOLVED_VELOCITY
            apart = np.abs(values - _at(fine, times, name)) > allowed * np.abs(values - values[0]).max()
            for at in [event.time for run in (coarse, fine) for event in run.events]:
                apart &= np.abs(times - at) > (_SHORT + 0.5) * size
            if apart[1:].any():
                horizon = min(horizon, float(times[1:][apart[1:]][0]) - size)
    return coarse, fine, horizon


def _compare(scene: Scene, coarse: Trajectory, fine: Trajectory, own_horizon: float) -> Report:
    size = scene.coupling.H
    times = _grid(coarse, scene)
    reference = event_driven.simulate(scene, sample_times=times)
    velocity = _PERTURBATION * _initial_speed(scene)
    perturbed = event_driven.simulate(scene, sample_times=times, velocity_perturbation=velocity)
    runs = (coarse, fine, reference, perturbed)
    changes = [contact_changes(run.events, _SHORT * size) for run in runs]
    stable = _agree_until(changes[2], changes[3], float(coarse.time[0]), float(coarse.time[-1]))
    report = Report(scene, reference, coarse, min(own_horizon, stable), 1.0)
    breaks = [event.time for run in (coarse, reference) for event in run.events]
    for name, sample in _quantities(scene):
        _compare_quantity(report, name, sample, runs, breaks)
    _compare_events(report, changes[0], changes[1], changes[2])
    return report


def _rounding(scene: Scene) -> float:
    """Relative rounding of the beam's slow motion beside its fastest modes, ε √(λ_max/λ₁) (estimates of both)."""
    beam = scene.beam
    if beam is None:
        return 0.0
    slowest = 2.0 / np.sqrt(beam.density * beam.area * beam.length * tip_compliance(beam))
    return float(np.finfo(float).eps * max(1.0, mesh_frequency(beam) / slowest))


# -- times ----------------------------------------------------------------------------------------------------------


def _grid(trajectory: Trajectory, scene: Scene) -> np.ndarray:
    """Macro points of the run that lie on its grid [s]."""
    size, start = scene.coupling.H, trajectory.time[0]
    index = (trajectory.time - start) / size
    times = trajectory.time[np.abs(index - np.round(index)) < 1e-6]
    return np.unique(times)


def _initial_speed(scene: Scene) -> float:
    if scene.beam is not None:
        return abs(scene.beam.initial_velocity_slope) or abs(scene.beam.initial_deflection_slope) or 1.0
    assert scene.spring is not None
    return abs(scene.spring.initial_velocity) or abs(scene.spring.equilibrium) or 1.0


def _at(trajectory: Trajectory, times: np.ndarray, name: str, own: np.ndarray | None = None) -> np.ndarray:
    """Column values at ``times`` that are rows; NaN where there is none."""
    at = trajectory.time if own is None else own
    index = np.clip(np.searchsorted(at, times), 0, len(at) - 1)
    for shift in (-1, 0):
        near = np.clip(index + shift, 0, len(at) - 1)
        index = np.where(np.abs(at[near] - times) < np.abs(at[index] - times), near, index)
    close = np.abs(at[index] - times) <= 1e-9 * np.maximum(1e-300, np.median(np.diff(at)) + np.abs(times))
    return np.where(close, trajectory[name][index], np.nan)


Sample = Callable[[Trajectory, np.ndarray], np.ndarray]


def _quantities(scene: Scene) -> Iterable[tuple[str, Sample]]:
    def column(name: str) -> Sample:
        return lambda t, times: _at(t, times, name)

    names: list[str] = []
    if scene.beam is not None:
        names += ["u_tip", "v_tip", "e_beam"]
    if scene.spring is not None:
        names += ["y", "z", "e_spring"]
    for name in names:
        yield name, column(name)
    if scene.beam is not None and scene.spring is not None:
        yield "contact_force", _force


def _force(trajectory: Trajectory, times: np.ndarray) -> np.ndarray:
    """Contact force at macro points: of a tie the mean of its two limits there, which stands in the row after."""
    size = trajectory.scene.coupling.H
    if trajectory.scene.contact.law != "transmission" or "reference" in trajectory.summary:
        return _at(trajectory, times, "contact_force")
    steps = np.diff(trajectory.time, prepend=np.nan)
    regular = (np.abs(steps - size) < 1e-6 * size) & (np.abs(np.roll(steps, 1) - size) < 1e-6 * size)
    own = np.where(regular, trajectory.time - size, np.nan)
    order = np.flatnonzero(regular)
    if len(order) < 2:
        return np.full(len(times), np.nan)
    picked = Trajectory(
        trajectory.scene,
        {"time": own[order], "contact_force": trajectory["contact_force_smoothed"][order]},
    )
    return _at(picked, times, "contact_force")


def _compare_quantity(
    report: Report, name: str, sample: Sample, runs: tuple[Trajectory, ...], breaks: list[float]
) -> None:
    coarse, _, _, _ = runs
    size = report.scene.coupling.H
    times = _grid(coarse, report.scene)
    times = times[times <= report.horizon]
    if name not in _DISPLACEMENTS:
        # A jump at slightly different times is an event error, judged there.
        for at in breaks:
            times = times[np.abs(times - at) > (_SHORT + 0.5) * size]
    if len(times) < 2:
        return
    values = [sample(run, times) for run in runs]
    good = np.all(np.isfinite(values), axis=0)
    if good.sum() < 2:
        return
    times, values = times[good], [v[good] for v in values]
    q, q_fine, q_reference, q_perturbed = values
    scale = float(np.abs(q_reference).max()) or 1.0
    grown = np.abs(q_perturbed - q_reference) / (_PERTURBATION * scale)
    growth = np.maximum(1.0, np.maximum.accumulate(grown))
    report.growth = max(report.growth, float(growth[-1]))
    steps = (times - coarse.time[0]) / size + 1.0
    floor = _IDA_TOLERANCE * steps + _SAFETY * (_rounding(report.scene) + coarse.summary.get("neglected_share", 0.0))
    bound = _SAFETY * np.maximum.accumulate(np.abs(q - q_fine)) + floor * growth * scale
    report.rows.append(_row(name, times, np.abs(q - q_reference), bound))


def _row(name: str, times: np.ndarray, error: np.ndarray, bound: np.ndarray) -> Row:
    worst = int(np.argmax(error / bound))
    top = int(np.argmax(error))
    at = worst if error[worst] > bound[worst] else top
    return Row(
        name, float(error[at]), float(times[at]), float(np.sqrt(np.mean(error**2))), float(bound[at]),
        bool(np.all(error <= bound)), times, error, bound,
    )  # fmt: skip


# -- events ---------------------------------------------------------------------------------------------------------


def contact_changes(events: Iterable[Event], window: float) -> list[tuple[str, float]]:
    """Where contact opens or closes and where the foundation is struck [s], without what lasts less than ``window``."""
    contact = [e for e in events if e.kind in ("impact", "separation", "release", "retie")]
    changes: list[tuple[str, float]] = []
    for e, following in zip(contact, [*contact[1:], None], strict=False):
        if e.kind == "impact":
            changes.append(("closes", e.time))
        elif e.kind == "separation" or (e.kind == "release" and (following is None or following.kind == "impact")):
            changes.append(("opens", e.time))
    merged: list[tuple[str, float]] = []
    for change in changes:
        if merged and change[1] - merged[-1][1] < window and change[0] != merged[-1][0]:
            merged.pop()
        else:
            merged.append(change)
    last = -np.inf
    for e in events:
        if e.kind == "stop_impact" and e.time - last >= window:
            merged.append(("strikes", e.time))
        if e.kind in ("stop_impact", "seated", "unseated", "separation"):
            last = e.time
    return sorted(merged, key=lambda change: change[1])


def _agree_until(first: list[tuple[str, float]], second: list[tuple[str, float]], start: float, t_end: float) -> float:
    """Time before the first change that the other run does not have in the same place of the order."""
    for i, (a, b) in enumerate(zip([*first, None], [*second, None], strict=False)):
        if a is None and b is None:
            return t_end
        before = first[i - 1][1] if i else start
        if a is None or b is None or a[0] != b[0]:
            return _ahead(before, min(c[1] for c in (a, b) if c is not None))
        if abs(a[1] - b[1]) > 0.1 * (min(a[1], b[1]) - before) > 0.0:
            return _ahead(before, min(a[1], b[1]))
    longer = first if len(first) > len(second) else second
    shorter = min(len(first), len(second))
    if len(first) == len(second):
        return t_end
    return _ahead(first[shorter - 1][1] if shorter else start, longer[shorter][1])


def _ahead(before: float, change: float) -> float:
    return before + 0.9 * (change - before)


def _compare_events(
    report: Report,
    coarse: list[tuple[str, float]],
    fine: list[tuple[str, float]],
    reference: list[tuple[str, float]],
) -> None:
    size = report.scene.coupling.H
    moved, start = 0.0, report.trajectory.time[0]
    expected = [change for change in reference if change[1] <= report.horizon]
    for i, (kind, time) in enumerate(expected):
        if i >= len(coarse) or coarse[i][0] != kind:
            report.events.append(EventRow(kind, float("nan"), time, 0.0, False))
            return
        ours = coarse[i][1]
        if i < len(fine):
            moved = max(moved, abs(ours - fine[i][1]))
        steps = (time - start) / size + 1.0
        # The unit of time in which the state changes as a whole is what the events so far have taken.
        bound = _SAFETY * moved + _IDA_TOLERANCE * steps * report.growth * max(time - start, size)
        if kind == "opens" and decided(report.scene)[0].coupling.degree == 0:
            bound += 0.5 * size  # a force known by its means tells no better when it vanishes
        report.events.append(EventRow(kind, ours, time, bound, abs(ours - time) <= bound))


# -- the paper's law ------------------------------------------------------------------------------------------------


def _crosscheck_paper(scene: Scene) -> Report:
    """Law `paper` beside `algorithm1`: they differ by the spring's midpoint rule alone.

    With a = (ωh)² one midpoint step and the exact flow differ in the displacement by y a²/12 and h z a/12. Algorithm 1
    restarts the spring at every step, so this does not add up to a frequency shift; a stiffness 1/3 larger changes the
    step by y a/6 and h z a/12, at least as much, and running Algorithm 1 with it shows what IDA may change.
    """
    assert scene.spring is not None
    h, spring = scene.coupling.H, scene.spring
    reference = algorithm1.simulate(scene)
    ours = simulate(scene)
    factor = 4.0 / 3.0
    changed = {"linear_stiffness": factor * spring.linear_stiffness, "cubic_stiffness": factor * spring.cubic_stiffness}
    moved = algorithm1.simulate(with_changes(scene, spring=changed))
    n = min(len(reference), len(ours), len(moved))
    report = Report(scene, reference, ours, float(ours.time[n - 1]), 1.0)
    for name in ("u_tip", "y", "z", "v_tip", "contact_force", "e_beam", "e_spring"):
        q, exact = ours[name][:n], reference[name][:n]
        scale = float(np.abs(exact).max()) or 1.0
        steps = np.arange(1, n + 1)
        bound = _SAFETY * np.maximum.accumulate(np.abs(moved[name][:n] - exact)) + _IDA_TOLERANCE * steps * scale
        report.rows.append(_row(name, ours.time[:n], np.abs(q - exact), bound))
    report.notes.append(
        f"bounds from Algorithm 1 with 4/3 of its stiffness: as much as the midpoint rule changes a step of {h:g} s"
    )
    return report


# -- orders ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class OrderRow:
    """Errors of a quantity in one stretch between events, at H, H/2, …"""

    phase: str
    begin: float  #: [s]
    end: float
    quantity: str
    errors: tuple[float, ...]
    orders: tuple[float, ...]  #: between neighbours


def orders(scene: Scene, halvings: int = 3) -> list[OrderRow]:
    """Observed orders in H of displacement, velocity and contact force, stretch by stretch between events.

    Errors are in the max norm against the event-driven reference, at the macro points that all runs share and two
    macro steps away from the events.
    """
    size = scene.coupling.H
    if scene.contact.law == "paper":
        raise SceneError("contact.law = 'paper': Algorithm 1 has no order to observe; --orders takes the other laws")
    runs = [simulate(with_changes(scene, coupling={"macro_step": size / 2**k})) for k in range(halvings + 1)]
    times = _grid(runs[0], scene)
    reference = event_driven.simulate(scene, sample_times=times)
    changes = contact_changes(reference.events, _SHORT * size)
    edges = [scene.contact_time or 0.0, *(time for _, time in changes), float(runs[0].time[-1])]
    found: list[OrderRow] = []
    for begin, end in itertools.pairwise(edges):
        inside = times[(times > begin + (_SHORT + 0.5) * size) & (times < end - (_SHORT + 0.5) * size)]
        if len(inside) < 4:
            continue
        phases = reference.phase[np.searchsorted(reference.time, inside[len(inside) // 2])]
        for name, sample in _quantities(scene):
            if name in _ENERGIES or (name == "contact_force" and phases == "free"):
                continue
            exact = sample(reference, inside)
            errors = []
            for run in runs:
                difference = np.abs(sample(run, inside) - exact)
                errors.append(float(np.nanmax(difference)) if np.isfinite(difference).any() else float("nan"))
            with np.errstate(divide="ignore", invalid="ignore"):
                observed = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
            found.append(OrderRow(str(phases), begin, end, name, tuple(errors), tuple(observed.tolist())))
    return found
