"""Is the co-simulation right? It is run beside the monolithic reference of its law and judged by bounds of its own.

The bound of a quantity at time t is

    4 · max over [t₀, t] of |q_H − q_{H/2}|   +   ε_IDA · steps · growth · scale of q:

what halving the macro step changes is an upper estimate of the discretisation error for any order ≥ 1 (twice the
difference at order 1), doubled again because events mix orders; the second term is the tolerance of the spring's
integrator in every step, grown as fast as the reference grows a perturbation. Nothing in it knows the reference, so a
wrong sign, mass or law, which converges to something else, fails.

Nonsmooth trajectories separate: comparable is what comes before the first change of contact that the macro step, or a
tiny perturbation of the reference, moves to another place in the order of events.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np

from .monolithic import algorithm1, event_driven
from .runner import simulate
from .scene import Scene, SceneError, with_changes
from .trajectory import Event, Trajectory

_SAFETY = 4.0
#: Relative tolerance of IDA, the spring FMU's default.
_IDA_TOLERANCE = 1e-12
#: Relative change of the initial velocity that measures how fast the reference separates from itself.
_PERTURBATION = 1e-7
#: A scene whose comparable window is shorter than this many macro steps is resolved further, 4 times at a go.
_ENOUGH_STEPS, _REFINEMENT, _MAX_REFINEMENTS = 40, 4.0, 12
#: Macro steps of a window that had to be resolved further.
_WINDOW_STEPS = 400
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
    report = _compare(scene)
    notes = []
    for _ in range(_MAX_REFINEMENTS):
        start, size = report.trajectory.time[0], report.scene.coupling.macro_step
        if report.horizon - start >= min(_ENOUGH_STEPS * size, 0.5 * (scene.time.t_end - start)):
            break
        size /= _REFINEMENT
        t_end = min(scene.time.t_end, start + _WINDOW_STEPS * size)
        report = _compare(with_changes(scene, time={"t_end": t_end}, coupling={"macro_step": size}))
        notes = [
            f"At the scene's own macro step, {scene.coupling.macro_step:g} s, the motion is not resolved: nothing can "
            f"be compared beyond the first contact. Compared instead: {size:.3g} s, up to {t_end:.9g} s."
        ]
    report.notes = notes + report.notes
    return report


def _compare(scene: Scene) -> Report:
    size = scene.coupling.macro_step
    coarse = simulate(scene)
    fine = simulate(with_changes(scene, coupling={"macro_step": 0.5 * size}))
    times = _grid(coarse, scene)
    reference = event_driven.simulate(scene, sample_times=times)
    velocity = _PERTURBATION * _initial_speed(scene)
    perturbed = event_driven.simulate(scene, sample_times=times, velocity_perturbation=velocity)
    window = _SHORT * size
    changes = [contact_changes(t.events, window) for t in (coarse, fine, reference, perturbed)]
    t_end = float(coarse.time[-1])
    horizon = min(_agree_until(changes[0], changes[1], t_end), _agree_until(changes[2], changes[3], t_end))
    report = Report(scene, reference, coarse, horizon, 1.0)
    breaks = [time for kind, time in changes[0] + changes[2]]
    for name, sample in _quantities(scene):
        _compare_quantity(report, name, sample, (coarse, fine, reference, perturbed), breaks)
    _compare_events(report, changes[0], changes[1], changes[2])
    return report


# -- times ----------------------------------------------------------------------------------------------------------


def _grid(trajectory: Trajectory, scene: Scene) -> np.ndarray:
    """Macro points of the run that lie on its grid [s]."""
    size, start = scene.coupling.macro_step, trajectory.time[0]
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
    size = trajectory.scene.coupling.macro_step
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
    size = report.scene.coupling.macro_step
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
    bound = _SAFETY * np.maximum.accumulate(np.abs(q - q_fine)) + _IDA_TOLERANCE * steps * growth * scale
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
        if e.kind == "stop_impact":
            if e.time - last >= window:
                merged.append(("strikes", e.time))
            last = e.time
    return sorted(merged, key=lambda change: change[1])


def _agree_until(first: list[tuple[str, float]], second: list[tuple[str, float]], t_end: float) -> float:
    """Time before the first change that the other run does not have in the same place of the order."""
    for i, (a, b) in enumerate(zip([*first, None], [*second, None], strict=False)):
        if a is None and b is None:
            return t_end
        before = first[i - 1][1] if i else 0.0
        if a is None or b is None or a[0] != b[0]:
            return _ahead(before, min(c[1] for c in (a, b) if c is not None))
        if abs(a[1] - b[1]) > 0.1 * (min(a[1], b[1]) - before) > 0.0:
            return _ahead(before, min(a[1], b[1]))
    longer = first if len(first) > len(second) else second
    shorter = min(len(first), len(second))
    if len(first) == len(second):
        return t_end
    return _ahead(first[shorter - 1][1] if shorter else 0.0, longer[shorter][1])


def _ahead(before: float, change: float) -> float:
    return before + 0.9 * (change - before)


def _compare_events(
    report: Report,
    coarse: list[tuple[str, float]],
    fine: list[tuple[str, float]],
    reference: list[tuple[str, float]],
) -> None:
    size = report.scene.coupling.macro_step
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
        report.events.append(EventRow(kind, ours, time, bound, abs(ours - time) <= bound))


# -- the paper's law ------------------------------------------------------------------------------------------------


def _crosscheck_paper(scene: Scene) -> Report:
    """Law `paper` beside `algorithm1`: they differ by the spring's midpoint rule alone.

    The midpoint rule with step h lowers a stiffness k of frequency ω to k (1 − (ωh)²/6); running Algorithm 1 with
    k (1 + (ωh)²/6) therefore shows what IDA in its place may change.
    """
    assert scene.spring is not None
    h, spring = scene.coupling.macro_step, scene.spring
    reference = algorithm1.simulate(scene)
    ours = simulate(scene)
    depth = float(np.abs(reference.y - spring.equilibrium).max())
    stiffness = spring.linear_stiffness + 3.0 * spring.cubic_stiffness * depth**2
    factor = 1.0 + stiffness / spring.mass * h * h / 6.0
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
        f"bounds from Algorithm 1 with its stiffness times {factor:.9g}, what the midpoint rule at h = {h:g} s leaves"
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
    size = scene.coupling.macro_step
    if scene.contact.law == "paper":
        raise SceneError("contact.law = 'paper': Algorithm 1 has no order to observe; --orders takes the other laws")
    runs = [simulate(with_changes(scene, coupling={"macro_step": size / 2**k})) for k in range(halvings + 1)]
    times = _grid(runs[0], scene)
    reference = event_driven.simulate(scene, sample_times=times)
    changes = contact_changes(reference.events, _SHORT * size)
    edges = [scene.contact_time or 0.0, *(time for _, time in changes), float(runs[0].time[-1])]
    found: list[OrderRow] = []
    for begin, end in zip(edges, edges[1:], strict=False):
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
