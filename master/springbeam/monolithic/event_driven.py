"""Event-driven reference: the pair as one system, integrated from event to event.

Each phase is one constraint-eliminated ODE (`hybrid_system`) under the scene's law (`laws`), integrated between events
that are located to rounding; impacts and phase changes are applied there (`transitions`). It shares no
code with the coupled simulation.
"""

from __future__ import annotations

import time as clock
from collections import deque
from collections.abc import Iterable, Sequence
from operator import itemgetter

import numpy as np
from numpy.polynomial import legendre

from ..results.trajectory import Trajectory
from ..scene import Scene, SceneError
from .exponential import END_SLOPE, TO_LEGENDRE, ExponentialPropagator, LinearForm, Segment
from .hybrid_system import NOISE, HybridSystem, QuasiStaticSystem, ReferenceFailure
from .laws import ReferencePhase, Watch
from .rows import Rows
from .transitions import HybridState

__all__ = ["Equations", "ReferenceFailure", "integrate", "refuse"]

#: More events than this at one time are a fault, not physics.
_AT_ONCE = 20
#: More events than this in one run are given up.
_MOST_EVENTS = 100_000
#: Rows of a scene that gives tolerances instead of a macro step.
_SAMPLES = 1000
#: A turn whose value is a smaller share of how much the nodes vary is looked at exactly.
_CLOSE = 1e-6
#: The last step of Newton's method to an event, as a share of its time: the next would be smaller than rounding.
_LAST_STEP = 1e-9
#: The last two steps where rounding is larger.
_LAST_STEPS = 1e-6
_MOST_STEPS_TO_ZERO = 60


class Equations:
    """The equations of a scene and their modes, which several runs of it can share."""

    def __init__(self, scene: Scene) -> None:
        refuse(scene)
        self.scene = scene
        self.system = (QuasiStaticSystem if scene.massless else HybridSystem)(scene)
        self.forms: dict[ReferencePhase, LinearForm] = {}

    def form(self, phase: ReferencePhase) -> LinearForm:
        """Return a phase in its modes."""
        if phase not in self.forms:
            self.forms[phase] = LinearForm(self.system, phase)
        return self.forms[phase]


def integrate(
    scene: Scene | Equations,
    *,
    sample_times: Sequence[float] | np.ndarray | None = None,
    velocity_perturbation: float = 0.0,
    time_limit: float | None = None,
) -> Trajectory:
    """Run a scene by events.

    Parameters
    ----------
    scene
        The scene, or its equations where another run has them.
    sample_times
        Times of the rows [s], as far as they lie in the run. Default: multiples of ``coupling.macro_step`` from the
        start (1000 of them where the scene gives tolerances instead), and a row before and after each event.
    velocity_perturbation
        Added to ``initial_velocity_slope`` [1/s], with the sign changed in every second mode, or to the spring's
        initial velocity [m/s] without a beam that has inertia: two runs that differ by it show how long a trajectory
        can be compared at all. All modes in proportion would move no event of a motion without a scale, as that of a
        beam on a stop at its rest.
    time_limit
        Processor time after which it is given up [s]; what else runs on the machine does not count.

    Returns
    -------
    Trajectory
        ``energy_residual`` is e_total minus its first value [J]. Rows of an "undeformed" approach start at contact.

    Raises
    ------
    ReferenceFailure
        If an integration or the event logic fails, or ``time_limit`` is over.
    SceneError
        If the scene has no reference: `refuse`.
    ValueError
        If no row lies in the run.
    """
    equations = scene if isinstance(scene, Equations) else Equations(scene)
    return _Run(equations, velocity_perturbation, sample_times, time_limit).execute()


def refuse(scene: Scene) -> None:
    """Raise SceneError if this reference does not define the motion of ``scene``; the message names what it does."""
    for table, body in scene.partners.items():
        raise SceneError(
            f"[{table}] {'fmu' if table in scene.foreign else 'element'}: no reference knows this body, a "
            f"{type(body).__name__}; springbeam run --accuracy compares runs of smaller and smaller steps instead"
        )


class _Run:
    """A run; see `integrate`."""

    def __init__(
        self,
        equations: Equations,
        velocity_perturbation: float,
        sample_times: Sequence[float] | np.ndarray | None,
        time_limit: float | None,
    ) -> None:
        self._form = equations.form
        self.system = equations.system
        self.t_end = equations.scene.time.t_end
        self.state = HybridState(self.system, *initial(self.system, velocity_perturbation))
        self.rows = Rows(self.state)
        self._every_event = sample_times is None
        self._due = self._samples(sample_times)
        self._limit = time_limit
        self._began = clock.process_time()
        self._counts = {"steps": 0, "phases": 0}

    def execute(self) -> Trajectory:
        began = clock.perf_counter()
        state = self.state
        happened = [-np.inf] * _AT_ONCE
        self._record_event()
        state.start()
        self._record_due()
        while state.time < self.t_end:
            event = self._until_event()
            if event is not None:
                self._record_event()
                state.happen(event)
                self._record_event()
                happened.append(state.time)
                if len(happened) > _MOST_EVENTS or happened[-1 - _AT_ONCE] == state.time:
                    raise ReferenceFailure(f"{len(state.events)} events by t = {state.time:.9g} s: they do not end")
        self.system.loads.smooth_from(np.inf)
        counts = {**self._counts, "events": len(state.events)}
        wall_time = clock.perf_counter() - began
        return self.rows.trajectory({"reference": "event_driven", "wall_time": wall_time, "counts": counts})

    def _until_event(self) -> Watch | None:
        """Integrate until something happens, or until a load has a kink or the run ends; return what has happened."""
        s = self.system
        state = self.state
        begin = self.state.time
        watched = self.state.watched()
        self._counts["phases"] += 1
        end = min(s.loads.smooth_from(begin), self.t_end)
        propagator = ExponentialPropagator(self._form(state.phase), state.X)
        while state.time < end:
            if self._limit is not None and clock.process_time() - self._began > self._limit:
                raise ReferenceFailure(f"takes more than {self._limit:g} s; it is at t = {state.time:.6g} s")
            segment = propagator.advance(max(end - state.time, 1e-16 * self.t_end))
            self._counts["steps"] += 1
            happens = first_event(s, state.phase, watched, segment)
            if happens is None:
                to = begin + propagator.elapsed
                self._move(segment, end if abs(end - to) <= 1e-14 * self.t_end else to)  # but for rounding of the sum
                continue
            event, reach = happens
            start = state.time
            for piece in segment.pieces(reach):
                self._move(piece, state.time + piece.nodes[-1])
            state.time = start + reach
            state.X[s.T] = state.time
            return event
        return None

    def _move(self, segment: Segment, to: float) -> None:
        """Move the state to the end of a segment at time ``to`` [s]; record the rows that are due on it."""
        state = self.state
        due = []
        while self._due and self._due[0] <= to:
            due.append(self._due.popleft())
        if due:
            for time, X in zip(due, segment.at(np.array(due) - state.time), strict=True):
                X[self.system.T] = time
                self.rows.record(time, X)
        state.time = to
        state.X = segment.states[-1].copy()
        state.X[self.system.T] = to

    def _samples(self, sample_times: Sequence[float] | np.ndarray | None) -> deque[float]:
        """Return the times of the rows [s] but for those of events."""
        start = self.state.time
        samples = sample_times
        if samples is None:
            H = self.system.scene.coupling.macro_step or (self.t_end - start) / _SAMPLES
            whole = max(int((self.t_end - start) / H * (1.0 - 1e-9)), 0)  # of those before the end
            samples = np.unique([*(start + H * np.arange(whole + 1)), self.t_end])
        times = np.sort(np.asarray(samples, dtype=float))
        within = times[(times >= start) & (times <= self.t_end * (1.0 + 1e-15))]
        if not len(within):
            raise ValueError(f"no row lies between the start of the run, {start:g} s, and its end, {self.t_end:g} s")
        return deque(within.tolist())

    def _record_event(self) -> None:
        if self._every_event:
            self.rows.record(self.state.time, self.state.X)

    def _record_due(self) -> None:
        while self._due and self._due[0] <= self.state.time:
            self._due.popleft()
            self.rows.record(self.state.time, self.state.X)


def initial(s: HybridSystem, perturbation: float) -> tuple[float, np.ndarray]:
    """Return time [s] and state at the start, where an undeformed tip arrives; ``perturbation``: see `integrate`."""
    scene = s.scene
    X = np.zeros(s.size)
    time = 0.0
    if scene.static:
        return time, _at_rest(s)
    inertia = s.tip_mobility not in (0.0, np.inf)
    x = X[s.A]
    x_dot = X[s.V]
    x[s.r :] = s.root_mass * s.spring.equilibrium
    x_dot[s.r :] = s.root_mass * (s.spring.initial_velocity + (0.0 if inertia else perturbation))
    if scene.beam is not None and s.beam is not None:
        slope = scene.beam.initial_deflection_slope
        rate = scene.beam.initial_velocity_slope
        if scene.contact_time and scene.tip_target is not None:
            time = scene.contact_time
            slope = scene.tip_target.value / scene.beam.length
        x[: s.r] = slope * s.beam.slope_shape
        alternating = (-1.0) ** np.arange(s.r)
        x_dot[: s.r] = (rate + perturbation * inertia * alternating) * s.beam.slope_shape
        if scene.beam.approach == "elastic":
            s.synchronise(ReferencePhase("free"), X)
    X[s.T] = time
    return time, X


def _at_rest(s: HybridSystem) -> np.ndarray:
    """Return the state in which everything is at rest under the loads of t = 0 and the force between the ends.

    A spring that has no stable equilibrium above the stop rests on it. Raises ReferenceFailure where it rests nowhere.
    """
    from scipy.optimize import brentq, newton  # only for a start at rest

    X = np.zeros(s.size)
    p = s.spring
    force = s.load + s.loads.values(np.zeros(())) @ s.patterns
    b = s.tip[: s.r]
    k = s.omega2[: s.r]
    bent = force[: s.r] / k
    on_spring = s.mass * float(force @ s.top)

    def top(C: float) -> float:
        if not s.has_spring:
            return s.stop.position
        k1 = p.linear_stiffness
        k2 = p.cubic_stiffness
        y0 = p.unloaded  # on_spring has k1 y0

        def pull(y: float) -> float:
            return k1 * y + k2 * (y - y0) ** 3 - on_spring + C

        def stiffness(y: float) -> float:
            return k1 + 3.0 * k2 * (y - y0) ** 2

        y, result = newton(pull, p.equilibrium, stiffness, full_output=True, disp=False)
        if result.converged and stiffness(y) > 0.0:
            return max(float(y), s.stop.position) if s.scene.stop is not None else float(y)
        if s.scene.stop is not None and pull(s.stop.position) > 0.0:  # the stop pushes
            return s.stop.position
        raise ReferenceFailure("the spring rests nowhere near its start")

    def mismatch(C: float) -> float:
        p = top(C) - float(b @ (bent + b * C / k))
        return p if s.law.rigid else float(s.law.force(np.array(p), np.zeros(()))) - C

    C = 0.0
    deep = top(0.0) - float(b @ bent)
    if s.r and (s.has_spring or s.scene.stop is not None) and (deep > 0.0 or s.law.start != "free") and deep != 0.0:
        far = deep / float(b @ (b / k))
        while mismatch(far) * deep > 0.0:
            far *= 2.0
        C = brentq(mismatch, 0.0, far, xtol=1e-300, rtol=1e-15)
    X[: s.r] = bent + b * C / k
    X[s.r : s.n] = s.root_mass * top(C)
    return X


def first_event(
    s: HybridSystem, phase: ReferencePhase, watched: Iterable[Watch], segment: Segment
) -> tuple[Watch, float] | None:
    """Return the event of a phase that comes first in a segment, and when, after its start [s]; ``None`` without one.

    A function that starts at zero, as after its own event, counts from where it exceeds rounding.
    """
    motion = s.motion(phase, segment.states)
    crossings = [(watch, _crossing(s, phase, watch, segment, watch.function(motion))) for watch in watched]
    return min(((watch, tau) for watch, tau in crossings if tau is not None), key=itemgetter(1), default=None)


def _crossing(
    s: HybridSystem, phase: ReferencePhase, watch: Watch, segment: Segment, values: np.ndarray
) -> float | None:
    """Return where a function, whose ``values`` at the nodes are given, first falls through zero."""

    def g(tau: float) -> tuple[float, float]:
        """Return the function at τ, stepped anew, and its slope."""
        for piece in segment.pieces(tau):
            inside = np.asarray(watch.function(s.motion(phase, piece.states)))
        return float(inside[-1]), float(END_SLOPE @ inside / piece.nodes[-1])

    lowest = np.min(values)
    if lowest > np.max(values) - lowest:  # a smooth minimum lies below the nodes by less than they vary
        return None
    size = float(segment.nodes[-1])
    series = TO_LEGENDRE @ values
    series = legendre.legtrim(series, 0.1 * NOISE * np.max(np.abs(series)))
    turns = _zeros(legendre.legder(series), size)
    there = legendre.legval(2.0 * turns / size - 1.0, series)
    close = np.abs(there) <= _CLOSE * np.ptp(values)
    there[close] = [g(tau)[0] for tau in turns[close]]
    order = np.argsort(np.r_[segment.nodes, turns])
    times = np.r_[segment.nodes, turns][order]
    values = np.r_[values, there][order]
    below = np.flatnonzero(values < -s.noise(watch.unit, np.max(np.abs(segment.states), axis=0)))
    if not len(below):
        return None
    first = max(below[0] - 1, 0)
    low = float(times[first])
    high = float(times[below[0]])
    if values[first] <= 0.0 or (low > 0.0 and g(low)[0] <= 0.0):
        return low
    zeros = _zeros(series, size)
    tau = float(next(iter(zeros[(zeros > low) & (zeros < high)]), 0.5 * (low + high)))
    last = high - low
    for _ in range(_MOST_STEPS_TO_ZERO):  # of Newton's method; by bisection where it leads out
        value, slope = g(tau)
        step = value / slope if slope < 0.0 else np.inf
        if abs(step) <= _LAST_STEP * tau or max(abs(step), last) <= _LAST_STEPS * tau:
            return tau - step
        low, high = (tau, high) if value > 0.0 else (low, tau)
        last = abs(step)
        tau = tau - step if low < tau - step < high else 0.5 * (low + high)
    return tau


def _zeros(series: np.ndarray, size: float) -> np.ndarray:
    """Return where a series of Legendre polynomials is zero inside a segment of ``size`` [s]."""
    x = legendre.legroots(series)
    return 0.5 * size * (1.0 + x.real[(x.imag == 0.0) & (np.abs(x.real) < 1.0)])
