"""Event-driven reference: the pair as one system, integrated from event to event.

Each phase is one constraint-eliminated ODE (`hybrid_system`) under the scene's law (`laws`), integrated between events
that are located to rounding (`location`); impacts and phase changes are applied there (`transitions`). It shares no
code with the coupled simulation.

With ``contact.impact = "rest"`` tip and spring keep different velocities, which the rigid tie u = y cannot: the
law `transmission` then has no solution with bounded force, and the scene is refused.
"""

from __future__ import annotations

import time as clock
from collections import deque
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..results.trajectory import Trajectory
from ..scene import Scene
from .exponential import ExponentialPropagator, LinearForm
from .hybrid_system import HybridSystem, ReferenceFailure
from .laws import Phase
from .location import EventLocator
from .quasi_static import QuasiStaticForm, QuasiStaticSystem
from .rows import Rows
from .semi_discrete import modal_beam
from .transitions import HybridState

__all__ = ["ReferenceFailure", "simulate"]

#: More events than this at one time are a fault, not physics.
_AT_ONCE = 20
#: More events than this in one run are given up.
_MOST_EVENTS = 100_000
#: Rows of a scene that gives tolerances instead of a macro step.
_SAMPLES = 1000


def simulate(
    scene: Scene,
    *,
    sample_times: Sequence[float] | np.ndarray | None = None,
    velocity_perturbation: float = 0.0,
    t_end: float | None = None,
    time_limit: float | None = None,
) -> Trajectory:
    """Run a scene by events.

    Parameters
    ----------
    sample_times
        Times of the rows [s], as far as they lie in the run. Default: multiples of ``coupling.macro_step`` from the
        start (1000 of them where the scene gives tolerances instead), and a row before and after each event.
    velocity_perturbation
        Added to ``initial_velocity_slope`` [1/s], or to the spring's initial velocity [m/s] without a beam that has
        inertia: two runs that differ by it show how long a trajectory can be compared at all.
    t_end
        Ends the run earlier than the scene does [s].
    time_limit
        Wall time after which it is given up [s].

    Returns
    -------
    Trajectory
        ``energy_residual`` is e_total minus its first value [J]. Rows of an "undeformed" approach start at contact.

    Raises
    ------
    ReferenceFailure
        If an integration or the event logic cannot go on, or ``time_limit`` is over.
    ValueError
        If the scene or an argument is outside what this reference defines, or no row lies in the run.
    """
    return _Run(scene, velocity_perturbation, t_end).execute(sample_times, time_limit)


class _Run:
    def __init__(self, scene: Scene, velocity_perturbation: float, t_end: float | None) -> None:
        self.scene, self.system = scene, _system(scene)
        self.t_end = scene.time.t_end if t_end is None else min(t_end, scene.time.t_end)
        if scene.coupled and self.system.law.rigid and scene.contact.impact == "rest":
            raise ValueError(
                "contact.impact = 'rest' leaves tip and spring with different velocities, which the rigid tie of law "
                f"'{scene.contact.law}' excludes; allowed here: 'inelastic', 'tip'"
            )
        self._form = QuasiStaticForm if isinstance(self.system, QuasiStaticSystem) else LinearForm
        self._forms: dict[Phase, LinearForm] = {}
        self.counts = {"steps": 0, "phases": 0}
        time, X = initial(self.system, velocity_perturbation)
        self.state = HybridState(self.system, time, X)
        self.rows = Rows(self.state)
        self._happened: list[float] = []  #: times of what has ended a phase [s]

    def execute(self, sample_times: Sequence[float] | np.ndarray | None, time_limit: float | None) -> Trajectory:
        began = clock.perf_counter()
        every_event, state = sample_times is None, self.state
        self._due = self._samples(sample_times)
        if every_event:
            self._record()
        state.start()
        self._record_due()
        self._begin_phase()
        while self.t_end - state.time > 1e-14 * self.t_end:
            if time_limit is not None and clock.perf_counter() - began > time_limit:
                raise ReferenceFailure(f"takes more than {time_limit:g} s; it is at t = {state.time:.6g} s")
            target = min(self._due[0] if self._due else self.t_end, self._kink)
            segment = self._propagator.advance(max(target - state.time, 1e-16 * self.t_end), 4.0 * np.spacing(target))
            self.counts["steps"] += 1
            found = self._locator.first(segment)
            if found is None:
                reach, end = segment.size, self._phase_start + self._propagator.elapsed
                for exact in (self._kink, target):
                    if abs(end - exact) <= 1e-14 * self.t_end:
                        end = exact  # the sum is off by rounding
            else:
                reach, end = found[1], state.time + found[1]
            while self._due and self._due[0] < end:
                at = self._due.popleft()
                self.rows.record(at, segment.state(at - state.time))
            state.time, state.X = end, segment.state(reach)
            state.X[self.system.T] = end
            self._record_due()
            if found is not None:
                if every_event:
                    self._record()
                state.happen(found[0])
                self._happened.append(end)
                if every_event:
                    self._record()
                if len(state.events) > _MOST_EVENTS or self._chatters():
                    raise ReferenceFailure(f"{len(state.events)} events by t = {end:.9g} s: they do not end")
                self._begin_phase()
            elif end == self._kink:
                self._begin_piece()
        self.system.loads.whole()
        return self.rows.trajectory(self._summary(clock.perf_counter() - began))

    def _samples(self, sample_times: Sequence[float] | np.ndarray | None) -> deque[float]:
        """Return the times of the rows [s] but for those of events."""
        start = self.state.time
        if sample_times is None:
            H = self.scene.coupling.macro_step or (self.t_end - start) / _SAMPLES
            count = int(np.floor((self.t_end - start) / H * (1.0 + 1e-12)))
            grid = start + H * np.arange(max(count, 0) + 1)
            samples = np.append(grid, self.t_end) if self.t_end - grid[-1] > 1e-9 * H else grid
        else:
            samples = np.asarray(sample_times, dtype=float)
        within = np.sort(samples[(samples >= start) & (samples <= self.t_end * (1.0 + 1e-15))])
        if not len(within):
            raise ValueError(f"no row lies between the start of the run, {start:g} s, and its end, {self.t_end:g} s")
        return deque(within.tolist())

    def _record(self) -> None:
        self.rows.record(self.state.time, self.state.X)

    def _record_due(self) -> None:
        while self._due and self._due[0] <= self.state.time:
            self._due.popleft()
            self._record()

    def _chatters(self) -> bool:
        at_once = _AT_ONCE + 1
        return len(self._happened) >= at_once and self._happened[-at_once] == self.state.time

    def _begin_phase(self) -> None:
        self._locator = EventLocator(self.system, self.state.phase, self.state.watched())
        self._begin_piece()

    def _begin_piece(self) -> None:
        """Integrate from here on anew: in another phase, or after a kink of a load."""
        self.counts["phases"] += 1
        state, self._phase_start = self.state, self.state.time
        self._kink = self.system.loads.smooth_from(state.time)
        if state.phase not in self._forms:
            self._forms[state.phase] = self._form(self.system, state.phase)
        self._propagator = ExponentialPropagator(self.system, state.phase, self._forms[state.phase], state.X)

    def _summary(self, wall_time: float) -> dict[str, Any]:
        counts = {**self.counts, "events": len(self.state.events)}
        return {"reference": "event_driven", "wall_time": wall_time, "counts": counts}


def _system(scene: Scene) -> HybridSystem:
    if scene.beam is not None and scene.beam.fidelity == "quasi_static":
        return QuasiStaticSystem(scene)
    return HybridSystem(scene, None if scene.beam is None else modal_beam(scene.beam))


def initial(s: HybridSystem, perturbation: float) -> tuple[float, np.ndarray]:
    """Return time [s] and state at the start, where an undeformed tip arrives; ``perturbation``: see `simulate`."""
    scene, X, time = s.scene, np.zeros(s.size), 0.0
    inertia = s.inverse_tip_mass not in (0.0, np.inf)
    if s.has_spring:
        X[s.Y] = s.spring.equilibrium
        X[s.Z] = s.spring.initial_velocity + (0.0 if inertia else perturbation)
    if scene.elastic_stop:
        X[s.Y] = s.stop.position
    if scene.beam is not None and s.beam is not None:
        slope, rate = scene.beam.initial_deflection_slope, scene.beam.initial_velocity_slope
        if scene.tip_target is not None and scene.beam.approach == "undeformed":
            obstacle = scene.tip_target.value
            gap = slope * scene.beam.length - obstacle
            if gap > 0.0:
                time = -gap / (rate * scene.beam.length)
                slope = obstacle / scene.beam.length
        X[s.A] = slope * s.beam.slope_shape
        X[s.V] = (rate + perturbation * inertia) * s.beam.slope_shape
        if scene.beam.approach == "elastic":
            s.settle(Phase("free"), X)
        if s.alone:
            s.synchronise(Phase("free"), X)
    X[s.T] = time
    return time, X
