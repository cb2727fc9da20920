"""What events do to the state of a `HybridSystem`: impacts, changes of phase, and what is booked with them.

=============  ====================================================================================================
impact         tip and spring meet: perfectly inelastic, J = (z − v)/(eᵀM⁻¹e + 1/m) on the tip, −J on the spring;
               ``contact.impact = "tip"`` sets z = v instead (Algorithm 1, line 5). A law that is a force: no impulse
stop_impact    y = φ with z < 0: z → −e z, and the joined tip likewise, by J = −(1+e) v/(eᵀM⁻¹e); without a spring
               the tip on the stop
release        tied, y rises through Ψ; goes on as `touch` if C > 0 there, else as `free`
retie          touch, y falls through Ψ
separation     touch, C becomes negative (a law that is a force: the penetration ends); at once where a meeting above
               Ψ leaves C < 0. A tip without inertia loses what it springs back with, here and at a release
seated         the impact after which bounces have died out: the flight would rise less than ``seat_height``
unseated       seated, N becomes negative; without a spring this is the tip's `separation`
=============  ====================================================================================================
"""

from __future__ import annotations

import numpy as np

from ..results.trajectory import Event, EventKind
from .hybrid_system import HybridSystem
from .laws import Contact, Phase, Watch


class HybridState:
    """Time, state and phase of a run, what impacts have lost so far [J], and its events."""

    def __init__(self, system: HybridSystem, time: float, X: np.ndarray) -> None:
        self.system, self.time, self.X = system, time, X
        self.phase = Phase("free")
        self.loss = 0.0
        self.events: list[Event] = []
        m = system.motion(self.phase, X)
        if not (system.law.rigid and abs(float(m.v - m.z)) > system.noise("m/s", X)):
            self.phase = Phase(system.law.start)
            system.synchronise(self.phase, X)
        if system.scene.static and not system.law.rigid and m.u < m.y and self.phase.contact == "free":
            self.phase = Phase("touch")

    # What a phase ends with -----------------------------------------------------------------------------------------

    def watched(self) -> list[Watch]:
        """Return the functions that are ≥ 0 as long as the phase lasts."""
        s, phi = self.system, self.system.stop.position
        watched = s.law.watched(self.phase) if s.scene.coupled else []
        if self.phase.seated:
            return [*watched, Watch("unseat", lambda m: m.N, "N")]
        if s.scene.stop is not None and not s.scene.elastic_stop:
            return [*watched, Watch("stop", lambda m: m.y - phi, "m")]
        return watched

    def happen(self, event: Watch) -> None:
        """Apply what happens where a watched function has become negative."""
        if event.level is not None:
            self._place(event.level)
        if event.name == "meet":
            self._meet()
        elif event.name == "stop":
            self._hit_stop()
        elif event.name == "unseat":
            self._unseat()
        else:
            self._go_on(event.name)
        self.system.synchronise(self.phase, self.X)

    def start(self) -> None:
        """Make first contact, and its impact, where tip and obstacle touch at the start or are joined from there on."""
        s, X = self.system, self.X
        if s.law.start != "free":
            if self.phase.contact == "free":
                self._meet()
            return
        m = s.motion(self.phase, X)
        noise = s.noise("m", X)
        if s.scene.coupled and float(m.u - m.y) <= noise:
            if m.v <= m.z:
                self._meet()
        elif s.alone and s.scene.stop is not None and m.u - s.stop.position <= noise:
            onto_it = m.v < 0.0 or (m.v == 0.0 and m.a @ s.b < 0.0)
            if onto_it:
                self._hit_stop()

    # Contact --------------------------------------------------------------------------------------------------------

    def _after(self, happened: str) -> tuple[Contact, str | None]:
        s, X = self.system, self.X
        return s.law.after(happened, s.motion(Phase("tied"), X), s.noise("m", X))

    def _go_on(self, happened: str) -> None:
        contact, kind = self._after(happened)
        self.phase = Phase(contact, self.phase.seated)
        lost = self.system.settle(self.phase, self.X)
        if kind is not None:
            self._emit(kind, energy_loss=lost)

    def _meet(self) -> None:
        s, X = self.system, self.X
        if not s.law.rigid:
            self._go_on("meet")
            return
        X[s.A] += s.b * ((float(X[s.Y]) - float(X[s.A] @ s.b)) / s.inverse_tip_mass)  # the gap is 0 but for rounding
        m = s.motion(self.phase, X)
        before = self._mechanical_energy()
        relative = float(m.z - m.v)
        impulse = 0.0
        if s.scene.contact.impact == "tip":
            X[s.Z] = m.v
        else:
            impulse = relative / (s.inverse_tip_mass + s.inverse_mass)
            X[s.V] += s.b * impulse
            X[s.Z] -= impulse * s.inverse_mass
        was_seated = self.phase.seated
        contact, kind = self._after("meet")
        self.phase = Phase(contact)
        s.synchronise(self.phase, X)
        assert kind is not None
        self._emit(kind, impulse_contact=impulse, energy_loss=before - self._mechanical_energy())
        if was_seated:  # the spring already stands on the foundation
            self._hit_stop()
        elif contact == "touch" and float(s.motion(self.phase, X).C) < -s.noise("N", X):
            self._go_on("separate")

    # Foundation -----------------------------------------------------------------------------------------------------

    def _hit_stop(self) -> None:
        """Apply Newton's impact law on the foundation, and seat what has bounced for the last time."""
        s, e = self.system, self.system.stop.restitution
        self._place(s.stop.position)
        arriving = self.X.copy()
        before = self._mechanical_energy()
        contact_impulse, foundation_impulse, speed = self._bounce(e)
        free_phase = Phase(self.phase.contact)
        m = s.motion(free_phase, self.X)
        acceleration = float(m.z_dot) if s.has_spring else float(m.a @ s.b)
        seats = e == 0.0 or 0.5 * speed**2 <= -acceleration * self.seat_height()
        if seats and e > 0.0:
            self.X = arriving
            contact_impulse, foundation_impulse, _ = self._bounce(0.0)
        self.phase = free_phase
        if seats:
            self.phase = Phase(self.phase.contact, seated=True)
            self.X[s.Y], self.X[s.Z] = s.stop.position, 0.0
            s.synchronise(self.phase, self.X)
        self._emit(
            "seated" if seats else "stop_impact",
            impulse_contact=contact_impulse,
            impulse_foundation=foundation_impulse,
            energy_loss=before - self._mechanical_energy(),
        )
        if seats and s.motion(self.phase, self.X).N < 0.0:
            self._unseat()

    def _bounce(self, e: float) -> tuple[float, float, float]:
        """Apply restitution e; return the impulses on the tip and of the foundation [N·s] and the speed left [m/s]."""
        s, X = self.system, self.X
        on_tip = 0.0
        if s.joined(self.phase):
            on_tip = -(1.0 + e) * float(X[s.V] @ s.b) / s.inverse_tip_mass
            X[s.V] += s.b * on_tip
        of_foundation = on_tip - (1.0 + e) * s.mass * float(X[s.Z])
        X[s.Z] = -e * X[s.Z]
        s.settle(self.phase, X)
        return on_tip, of_foundation, float(X[s.Z])

    def _unseat(self) -> None:
        self.phase = Phase(self.phase.contact)
        self._emit("unseated" if self.system.has_spring else "separation")

    def seat_height(self) -> float:
        """Return the height [m] below which a flight after an impact on the foundation does not take place.

        It is 1e-12 of the distance |Ψ − φ|, or of the tip's deflection if larger. What is cut off changes no impulse,
        and the displacement by less than (velocity × remaining time) of the bounces left out.
        """
        s, phi = self.system, self.system.stop.position
        deflection = float(np.abs(self.X[s.A]) @ np.abs(s.b))
        return 1e-12 * max(abs(s.spring.equilibrium - phi), deflection, abs(phi), 1e-9)

    # All events -----------------------------------------------------------------------------------------------------

    def _place(self, level: float) -> None:
        """Put the spring top, and the tip that is joined to it, where the event has them but for rounding."""
        s, X = self.system, self.X
        X[s.Y] = level
        if s.joined(self.phase):
            X[s.A] += s.b * ((level - float(X[s.A] @ s.b)) / s.inverse_tip_mass)

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
                kind=EventKind(kind),
                y=float(m.y) if s.has_spring else None,
                z=float(m.z) if s.has_spring else None,
                u_tip=float(m.u) if s.beam is not None else None,
                v_tip=float(m.v) if s.beam is not None else None,
                **values,
            )
        )
