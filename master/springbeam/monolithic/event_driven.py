"""Event-driven reference of the laws `transmission` and `compliance`.

Each phase is one constraint-eliminated ODE (`hybrid_system`), integrated between events that are located to
rounding; impacts and phase changes are applied there. It shares no code with the coupled simulation.

Events and what they do:

=============  ====================================================================================================
impact         tip and spring meet: perfectly inelastic, J = (z − v)/(eᵀM⁻¹e + 1/m) on the tip, −J on the spring;
               ``contact.impact = "tip"`` sets z = v instead (Algorithm 1, line 5)
stop_impact    y = φ with z < 0: z → −e z, and the tied tip likewise, by J = −(1+e) v/(eᵀM⁻¹e); without a spring
               the tip on the stop
release        tied, y rises through Ψ; goes on as `touch` if C > 0 there, else as `free`
retie          touch, y falls through Ψ
separation     touch, C becomes negative (`compliance`: the penetration ends); at once where a meeting above Ψ
               leaves C < 0
seated         the impact after which bounces have died out: the flight would rise less than ``seat_height``
unseated       seated, N becomes negative; without a spring this is the tip's `separation`
=============  ====================================================================================================

With ``contact.impact = "rest"`` tip and spring keep different velocities, which the rigid tie u = y cannot: the
law `transmission` then has no solution with bounded force, and the scene is refused.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import brentq

from ..results.trajectory import COLUMNS, Event, Trajectory
from ..scene import Scene
from .exponential import ExponentialPropagator, LinearForm
from .hybrid_system import HybridSystem, Motion, Phase, ReferenceFailure
from .propagators import SCIPY_METHODS, Propagator, RungeKuttaPropagator, Segment
from .quasi_static import simulate as simulate_quasi_static

__all__ = ["ReferenceFailure", "simulate"]

#: More events than this at one time are a fault, not physics.
_AT_ONCE = 20
#: Rows of a scene that gives tolerances instead of a macro step.
_SAMPLES = 1000


def simulate(
    scene: Scene,
    *,
    method: str = "exponential",
    rtol: float = 1e-12,
    atol: float = 1e-15,
    nodes: int = 10,
    sample_times: Sequence[float] | np.ndarray | None = None,
    velocity_perturbation: float = 0.0,
    seat_height: float | None = None,
    max_events: int = 100_000,
    t_end: float | None = None,
    time_limit: float | None = None,
) -> Trajectory:
    """Run a scene by events.

    Parameters
    ----------
    method
        ``"exponential"``: exact modal form of each phase, for soft and stiff beams alike. ``"DOP853"``, ``"LSODA"``,
        ``"Radau"``: scipy on the same equations, for soft beams, with ``rtol`` and ``atol``. A scene with a
        quasi-static beam is left to `quasi_static.simulate`.
    nodes
        Points of a scipy step at which events are looked for; 2, its ends, is what `scipy.integrate.solve_ivp` does.
    sample_times
        Times of the rows [s]. Default: multiples of ``coupling.macro_step`` from the start (1000 of them where
        the scene gives tolerances instead), and a row before and after each event.
    velocity_perturbation
        Added to ``initial_velocity_slope`` [1/s], or to the spring's initial velocity [m/s] without a beam: two runs
        that differ by it show how long a trajectory can be compared at all.
    seat_height
        An impact after which the flight would rise less than this [m] is taken as the last one (e = 0), and the
        spring or tip as seated. Default 1e-12 of the distance |Ψ − φ|, or of the tip's largest deflection if larger.
        What is cut off changes no impulse, and the displacement by less than (velocity × remaining time) of the
        bounces left out. At e = 1 bounces can be damped without end, ever smaller; then give a larger height.
    t_end
        Ends the run earlier than the scene does [s].
    time_limit
        Wall time after which it is given up [s]; not of a quasi-static beam.

    Returns
    -------
    Trajectory
        ``energy_residual`` is e_total minus its first value [J]. Rows of an "undeformed" approach start at contact.

    Raises
    ------
    ReferenceFailure
        If an integration or the event logic cannot go on, or ``time_limit`` is over.
    ValueError
        If the scene is outside what this reference defines.
    """
    if scene.beam is not None and scene.beam.fidelity == "quasi_static":
        if method not in ("exponential", "DOP853"):
            raise ValueError(f"method = {method!r}: a scene with a quasi-static beam is integrated by DOP853")
        return simulate_quasi_static(
            scene, sample_times=sample_times, velocity_perturbation=velocity_perturbation, t_end=t_end
        )
    if method not in ("exponential", *SCIPY_METHODS):
        raise ValueError(f"method = {method!r}: one of exponential, {', '.join(SCIPY_METHODS)}")
    run = _Run(scene, method, rtol, atol, nodes, velocity_perturbation, seat_height, max_events, t_end)
    return run.execute(sample_times, time_limit)


@dataclass
class _Rows:
    """States recorded, with the phase each belongs to."""

    times: list[float] = field(default_factory=list)
    states: list[np.ndarray] = field(default_factory=list)
    phases: list[Phase] = field(default_factory=list)
    losses: list[float] = field(default_factory=list)


class _Run:
    def __init__(
        self,
        scene: Scene,
        method: str,
        rtol: float,
        atol: float,
        nodes: int,
        velocity_perturbation: float,
        seat_height: float | None,
        max_events: int,
        t_end: float | None,
    ) -> None:
        self.scene = scene
        self.system = HybridSystem(scene)
        self.method, self.rtol, self.atol, self._nodes = method, rtol, atol, nodes
        self.max_events = max_events
        self.t_end = scene.time.t_end if t_end is None else min(t_end, scene.time.t_end)
        if self.system.two_bodies and not self.system.compliance and scene.contact.impact == "rest":
            raise ValueError(
                "contact.impact = 'rest' leaves tip and spring with different velocities, which the rigid tie of law "
                "'transmission' excludes; allowed here: 'inelastic', 'tip'"
            )
        self._seat_height = seat_height
        self.events: list[Event] = []
        self.loss = 0.0
        self.rows = _Rows()
        self._forms: dict[Phase, LinearForm] = {}
        self.counts = {"steps": 0, "phases": 0}
        self.time, self.X = self._start(velocity_perturbation)
        self.phase = Phase("free")

    # Start ----------------------------------------------------------------------------------------------------------

    def _start(self, perturbation: float) -> tuple[float, np.ndarray]:
        s, scene = self.system, self.scene
        X = np.zeros(s.size)
        time = 0.0
        if s.has_spring:
            X[s.Y] = s.spring.equilibrium
            X[s.Z] = s.spring.initial_velocity + (perturbation if s.beam is None else 0.0)
        if scene.beam is not None and s.beam is not None:
            slope, rate = scene.beam.initial_deflection_slope, scene.beam.initial_velocity_slope
            obstacle = self._obstacle()
            if obstacle is not None:
                gap = slope * scene.beam.length - obstacle
                if gap < 0.0:
                    raise ValueError(
                        f"[beam] initial_deflection_slope = {slope}: the tip starts {-gap} m below what it should hit"
                    )
                if scene.beam.approach == "undeformed" and gap > 0.0:
                    if rate >= 0.0:
                        raise ValueError(
                            f"[beam] approach = 'undeformed' with initial_velocity_slope = {rate}: the tip never "
                            "comes down; allowed: a negative slope, or approach = 'elastic'"
                        )
                    time = -gap / (rate * scene.beam.length)
                    slope = obstacle / scene.beam.length
            X[s.A] = slope * s.beam.slope_shape
            X[s.V] = (rate + perturbation) * s.beam.slope_shape
        return time, X

    def _obstacle(self) -> float | None:
        """What the tip comes down on at the start [m]."""
        if self.system.has_spring:
            return self.system.spring.equilibrium
        return None if self.scene.stop is None else self.scene.stop.position

    def _settle_start(self) -> None:
        """First contact, and its impact, where tip and obstacle touch at the start."""
        s, X = self.system, self.X
        m = s.motion(self.phase, X)
        noise = s.displacement_noise(X)
        if s.two_bodies and float(m.u - m.y) <= noise:
            if m.v <= m.z:
                self._meet()
        elif not s.has_spring and self.scene.stop is not None and m.u - self.scene.stop.position <= noise:
            if m.v < 0.0:
                self._hit_stop()
            elif m.v == 0.0 and m.a @ s.b < 0.0:
                self._seat()
                self._emit("seated")

    # Main loop ------------------------------------------------------------------------------------------------------

    def execute(self, sample_times: Sequence[float] | np.ndarray | None, time_limit: float | None) -> Trajectory:
        began = clock.perf_counter()
        every_event = sample_times is None
        if sample_times is None:
            H = self.scene.coupling.macro_step or (self.t_end - self.time) / _SAMPLES
            count = int(np.floor((self.t_end - self.time) / H * (1.0 + 1e-12)))
            grid = self.time + H * np.arange(count + 1)
            samples = np.append(grid, self.t_end) if self.t_end - grid[-1] > 1e-9 * H else grid
        else:
            samples = np.asarray(sample_times, dtype=float)
        samples = samples[(samples >= self.time) & (samples <= self.t_end * (1.0 + 1e-15))]
        if every_event:
            self._record(self.time, self.X)
        self._settle_start()
        upcoming = 0
        while upcoming < len(samples) and samples[upcoming] <= self.time:
            self._record(self.time, self.X)
            upcoming += 1
        armed: set[str] = set()
        propagator, phase_start = self._propagator(), self.time
        while self.t_end - self.time > 1e-14 * self.t_end:
            if time_limit is not None and clock.perf_counter() - began > time_limit:
                raise ReferenceFailure(f"takes more than {time_limit:g} s; it is at t = {self.time:.6g} s")
            target = samples[upcoming] if upcoming < len(samples) else self.t_end
            segment = propagator.advance(max(target - self.time, 1e-16 * self.t_end), 4.0 * np.spacing(target))
            self.counts["steps"] += 1
            found = self._first_event(segment, armed)
            begin = self.time
            if found is None:
                reach, end = segment.size, phase_start + propagator.elapsed
                if abs(end - target) <= 1e-14 * self.t_end:
                    end = target  # the sum is off by rounding
            else:
                reach, end = found[1], begin + found[1]
            while upcoming < len(samples) and samples[upcoming] <= end:
                at = samples[upcoming]
                inside = at < end
                self._record(at, segment.state(at - begin) if inside else self._at(segment, reach))
                upcoming += 1
            self.time = end
            self.X = self._at(segment, reach)
            if found is None:
                continue
            if every_event:
                self._record(self.time, self.X)
            self._handle(found[0])
            if every_event:
                self._record(self.time, self.X)
            if len(self.events) > self.max_events or self._chatters():
                raise ReferenceFailure(f"{len(self.events)} events by t = {self.time!r} s: they do not end")
            armed.clear()
            propagator, phase_start = self._propagator(), self.time
        return self._trajectory(clock.perf_counter() - began)

    def _chatters(self) -> bool:
        at_once = _AT_ONCE + 1
        return len(self.events) >= at_once and self.events[-at_once].time == self.time

    @staticmethod
    def _at(segment: Segment, tau: float) -> np.ndarray:
        return segment.states[-1].copy() if tau == segment.size else segment.state(tau)

    def _propagator(self) -> Propagator:
        self.counts["phases"] += 1
        if self.method == "exponential":
            key = self.phase
            if key not in self._forms:
                self._forms[key] = LinearForm(self.system, key)
            return ExponentialPropagator(self._forms[key], self.X)
        horizon = max(self.t_end - self.time, 1e-300)
        return RungeKuttaPropagator(
            self.system, self.phase, self.X, horizon, self.method, self.rtol, self.atol, self._nodes
        )

    def _record(self, time: float, X: np.ndarray) -> None:
        self.rows.times.append(time)
        self.rows.states.append(X.copy())
        self.rows.phases.append(self.phase)
        self.rows.losses.append(self.loss)

    # Event location -------------------------------------------------------------------------------------------------

    def _watched(self) -> dict[str, Callable[[Motion], np.ndarray]]:
        """Functions that are ≥ 0 as long as the phase lasts."""
        s, phase, stop = self.system, self.phase, self.scene.stop
        psi = s.spring.equilibrium
        watched: dict[str, Callable[[Motion], np.ndarray]] = {}
        if s.two_bodies:
            if phase.contact == "free":
                watched["meet"] = lambda m: m.u - m.y
            elif s.compliance:
                watched["separate"] = lambda m: m.y - m.u
            elif phase.contact == "tied" and not phase.seated:
                watched["release"] = lambda m: psi - m.y
            elif phase.contact == "touch":
                watched["retie"] = lambda m: m.y - psi
                watched["separate"] = lambda m: m.C
        if phase.seated:
            watched["unseat"] = lambda m: m.N
        elif stop is not None:
            phi = stop.position
            watched["stop"] = (lambda m: m.y - phi) if s.has_spring else (lambda m: m.u - phi)
        return watched

    def _first_event(self, segment: Segment, armed: set[str]) -> tuple[str, float] | None:
        """The earliest event in a segment and when, after its start [s].

        A function that starts at zero, as after its own event, is watched from where it first exceeds rounding.
        """
        motion = self.system.motion(self.phase, segment.states)
        first: tuple[str, float] | None = None
        for name, function in self._watched().items():
            tau = self._crossing(segment, name, function, function(motion), armed)
            if tau is not None and (first is None or tau < first[1]):
                first = (name, tau)
        return first

    def _crossing(
        self,
        segment: Segment,
        name: str,
        function: Callable[[Motion], np.ndarray],
        values: np.ndarray,
        armed: set[str],
    ) -> float | None:
        start = segment.states[0]
        is_force = name == "unseat" or (name == "separate" and not self.system.compliance)
        noise = self.system.force_noise(start) if is_force else self.system.displacement_noise(start)

        def g(tau: float) -> float:
            return float(function(self.system.motion(self.phase, segment.state(tau))))

        for k in range(len(values)):
            if name not in armed:
                if values[k] > noise:
                    armed.add(name)
                elif values[k] < -noise and k > 0:
                    return self._early_crossing(g, segment.nodes[k], noise)
            elif values[k] < 0.0:
                low, high = segment.nodes[k - 1], segment.nodes[k]
                if k == 0 or g(low) <= 0.0:
                    return float(low if k > 0 else 0.0)
                if k == len(values) - 1 and values[k] >= -noise:
                    return float(high)
                return self._root(g, low, high)
        return None

    @staticmethod
    def _root(g: Callable[[float], float], low: float, high: float) -> float:
        if g(high) >= 0.0:  # the dense output and the exact state differ by less than either's error
            return float(high)
        # A root at a segment's very start needs no more than the rounding of the segment.
        return float(brentq(g, low, high, xtol=1e-16 * high, rtol=8.9e-16, maxiter=200))

    def _early_crossing(self, g: Callable[[float], float], first: float, noise: float) -> float:
        """A function that starts at zero and is negative at the first node: where it was positive between them."""
        high = first
        for _ in range(60):
            low = 0.5 * high
            value = g(low)
            if value > noise:
                return self._root(g, low, high)
            if abs(value) <= noise:
                return 0.0
            high = low
        return 0.0

    # Events ---------------------------------------------------------------------------------------------------------

    def _place(self, level: float) -> None:
        """The spring top, and the tip that is joined to it, exactly where the event has them but for rounding."""
        s, X = self.system, self.X
        if s.has_spring:
            X[s.Y] = level
        if s.joined(self.phase) or not s.has_spring:
            X[s.A] += s.b * ((level - float(X[s.A] @ s.b)) / s.inverse_tip_mass)

    def _handle(self, name: str) -> None:
        s = self.system
        if name in ("release", "retie"):
            self._place(s.spring.equilibrium)
        if name == "meet":
            self._meet()
        elif name == "separate":
            self._part()
        elif name == "release":
            contact = "touch" if self._contact_force(Phase("touch")) > 0.0 else "free"
            self.phase = Phase(contact)  # type: ignore[arg-type]
            self._emit("release")
        elif name == "retie":
            self.phase = Phase("tied")
            self._emit("retie")
        elif name == "unseat":
            self._unseat()
        elif name == "stop":
            self._hit_stop()
        s.synchronise(self.phase, self.X)

    def _contact_force(self, phase: Phase) -> float:
        return float(self.system.motion(phase, self.X).C)

    def _below_equilibrium(self) -> bool:
        """Whether tip and spring, together with one velocity, are (about to be) below Ψ, where the tie is bilateral."""
        s, X = self.system, self.X
        m = s.motion(Phase("tied"), X)
        height = float(m.y) - s.spring.equilibrium
        if abs(height) <= s.displacement_noise(X):
            height = float(m.z) if m.z != 0.0 else float(m.z_dot)
        return height < 0.0

    def _part(self) -> None:
        self.phase = Phase("free", self.phase.seated)
        self._emit("separation")

    def _meet(self) -> None:
        s, X = self.system, self.X
        X[s.A] += s.b * ((float(X[s.Y]) - float(X[s.A] @ s.b)) / s.inverse_tip_mass)  # the gap is 0 but for rounding
        if s.compliance:
            self.phase = Phase("touch", self.phase.seated)
            self._emit("impact")
            return
        m = s.motion(self.phase, X)
        before = self._mechanical_energy()
        relative = float(m.z - m.v)
        impulse = 0.0
        if self.scene.contact.impact == "tip":
            X[s.Z] = m.v
        else:
            impulse = relative / (s.inverse_tip_mass + s.inverse_mass)
            X[s.V] += s.b * impulse
            X[s.Z] -= impulse * s.inverse_mass
        was_seated = self.phase.seated
        self.phase = Phase("tied" if self._below_equilibrium() else "touch")
        s.synchronise(self.phase, X)
        self._emit("impact", impulse_contact=impulse, energy_loss=before - self._mechanical_energy())
        if was_seated:  # the spring already stands on the foundation
            self._hit_stop()
        elif self.phase.contact == "touch" and self._contact_force(self.phase) < 0.0:
            self._part()

    def _hit_stop(self) -> None:
        """Newton's impact law on the foundation, and whether it was the last bounce."""
        s, stop = self.system, self.scene.stop
        assert stop is not None
        e = stop.restitution
        self._place(stop.position)
        arriving = self.X.copy()
        before = self._mechanical_energy()
        contact_impulse, foundation_impulse, speed = self._bounce(e)
        free_phase = Phase(self.phase.contact)
        m = s.motion(free_phase, self.X)
        acceleration = float(m.z_dot) if s.has_spring else float(m.a @ s.b)
        seats = e == 0.0 or 0.5 * speed**2 <= -acceleration * self._height_to_seat()
        if seats and e > 0.0:
            self.X = arriving
            contact_impulse, foundation_impulse, _ = self._bounce(0.0)
        self.phase = free_phase
        if seats:
            self._seat()
        self._emit(
            "seated" if seats else "stop_impact",
            impulse_contact=contact_impulse,
            impulse_foundation=foundation_impulse,
            energy_loss=before - self._mechanical_energy(),
        )
        if seats and s.motion(self.phase, self.X).N < 0.0:
            self._unseat()

    def _bounce(self, e: float) -> tuple[float, float, float]:
        """Apply restitution e; impulses on the tip and of the foundation [N·s], speed afterwards [m/s]."""
        s, X = self.system, self.X
        on_tip = 0.0
        if s.joined(self.phase) or not s.has_spring:
            on_tip = -(1.0 + e) * float(X[s.V] @ s.b) / s.inverse_tip_mass
            X[s.V] += s.b * on_tip
            speed = float(X[s.V] @ s.b)
        of_foundation = on_tip
        if s.has_spring:
            of_foundation += -(1.0 + e) * s.spring.mass * X[s.Z]
            X[s.Z] = -e * X[s.Z]
            speed = float(X[s.Z])
        return on_tip, of_foundation, speed

    def _seat(self) -> None:
        s, stop = self.system, self.scene.stop
        assert stop is not None
        self.phase = Phase(self.phase.contact, seated=True)
        if s.has_spring:
            self.X[s.Y], self.X[s.Z] = stop.position, 0.0
        s.synchronise(self.phase, self.X)

    def _unseat(self) -> None:
        self.phase = Phase(self.phase.contact)
        self._emit("unseated" if self.system.has_spring else "separation")

    def _height_to_seat(self) -> float:
        if self._seat_height is not None:
            return self._seat_height
        s, stop = self.system, self.scene.stop
        assert stop is not None
        reach = abs(s.spring.equilibrium - stop.position) if s.has_spring else 0.0
        deflection = float(np.abs(self.X[s.A]) @ np.abs(s.b))
        return 1e-12 * max(reach, deflection, abs(stop.position), 1e-9)

    def _mechanical_energy(self) -> float:
        e = self.system.energies(self.X[None], self.phase)
        return float(e["e_beam"][0] + e["e_spring"][0])

    def _emit(self, kind: str, **values: float) -> None:
        s = self.system
        m = s.motion(self.phase, self.X)
        self.loss += values.get("energy_loss", 0.0)
        self.events.append(
            Event(
                time=self.time,
                kind=kind,
                y=float(m.y) if s.has_spring else None,
                z=float(m.z) if s.has_spring else None,
                u_tip=float(m.u) if s.beam is not None else None,
                v_tip=float(m.v) if s.beam is not None else None,
                **values,
            )
        )

    # Result ---------------------------------------------------------------------------------------------------------

    def _trajectory(self, wall_time: float) -> Trajectory:
        s = self.system
        rows = self.rows
        states = np.array(rows.states).reshape(len(rows.times), s.size)
        n = len(rows.times)
        columns: dict[str, np.ndarray] = {
            "time": np.array(rows.times),
            "phase": np.array([phase.name for phase in rows.phases], dtype="<U8"),
            "e_impact_loss": np.array(rows.losses),
        }
        for phase in set(rows.phases):
            index = np.array([k for k, p in enumerate(rows.phases) if p == phase])
            m = s.motion(phase, states[index])
            values = {
                "u_tip": m.u,
                "v_tip": m.v,
                "y": m.y,
                "z": m.z,
                "contact_force": m.C,
                "foundation_force": m.N,
                **s.energies(states[index], phase),
            }
            for name, value in values.items():
                columns.setdefault(name, np.zeros(n))[index] = value
        self._derive_columns(columns)
        residual = columns["energy_residual"]
        scale = max(float(np.max(np.abs(columns[c]))) for c in ("e_beam", "e_spring", "e_contact", "e_load"))
        summary = {
            "reference": "event_driven",
            "method": self.method,
            "wall_time": wall_time,
            "counts": {**self.counts, "events": len(self.events)},
            "largest_energy_residual": float(np.max(np.abs(residual))),
            "largest_relative_energy_residual": float(np.max(np.abs(residual))) / scale if scale > 0.0 else 0.0,
            "seat_height": None if self.scene.stop is None else self._height_to_seat(),
        }
        if self.method != "exponential":
            summary["tolerances"] = {"rtol": self.rtol, "atol": self.atol}
        shapes = None
        if s.beam is not None:
            shapes = (columns["time"], states[:, s.A] @ s.beam.sampler.T)
        for name in self._absent_columns():
            columns.pop(name, None)
        ordered = {name: columns[name] for name in COLUMNS if name in columns}
        return Trajectory(self.scene, ordered, self.events, shapes, summary)

    def _derive_columns(self, columns: dict[str, np.ndarray]) -> None:
        s = self.system
        stop = self.scene.stop
        if s.two_bodies:
            columns["gap"] = columns["u_tip"] - columns["y"]
            together = columns["phase"] != "free"
            columns["velocity_mismatch"] = np.where(together, columns["v_tip"] - columns["z"], 0.0)
            C = columns["contact_force"]
            inside = C if s.compliance else s.compliance_force(s.spring.equilibrium - columns["u_tip"])
            columns["compliance_force"], columns["tie_reaction"] = inside, C - inside
        elif stop is not None and s.beam is not None:
            columns["gap"] = columns["u_tip"] - stop.position
            columns["foundation_force"] = columns["contact_force"]
        names = ("e_beam", "e_spring", "e_contact", "e_dissipated", "e_impact_loss", "e_load")
        columns["e_total"] = np.sum([columns[name] for name in names], axis=0)
        columns["energy_residual"] = columns["e_total"] - columns["e_total"][0]

    def _absent_columns(self) -> tuple[str, ...]:
        s = self.system
        absent: tuple[str, ...] = ()
        if s.beam is None:
            absent += ("u_tip", "v_tip", "e_beam")
        if not s.has_spring:
            absent += ("y", "z", "e_spring")
        if not s.two_bodies:
            absent += ("contact_force", "e_contact")
        if self.scene.stop is None:
            absent += ("foundation_force",)
        return absent
