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
            self.system.place(self.phase, self.X, event.level)
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
        m = s.motion(self.phase, X)
        noise = s.noise("m", X)
        if s.law.start != "free":
            if self.phase.contact == "free":
                self._meet()
        elif s.scene.coupled and float(m.u - m.y) <= noise:
            if m.v <= m.z:
                self._meet()
        elif (
            s.alone
            and s.scene.stop is not None
            and m.u - s.stop.position <= noise
            and (float(m.v), float(m.z_dot)) < (0.0, 0.0)  # onto it
        ):
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
        m, before = s.motion(self.phase, X), self._mechanical_energy()
        impulse = 0.0
        if s.scene.contact.impact == "tip":
            X[s.n + s.r] = s.root_mass * m.v
        else:
            impulse = float(m.z - m.v) / s.mobility
            X[s.V] += s.between * impulse
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
        free_phase, seated_phase = Phase(self.phase.contact), Phase(self.phase.contact, seated=True)
        s.place(self.phase, self.X, s.stop.position)
        before, arriving = self._mechanical_energy(), s.motion(self.phase, self.X)
        velocity = self.X[s.V].copy()
        self._bounce(e)
        m = s.motion(free_phase, self.X)
        seats = e == 0.0 or 0.5 * float(m.z) ** 2 <= -float(m.z_dot) * self.seat_height()
        if seats:
            self.X[s.V], e = velocity, 0.0
            self._bounce(e)
        on_tip = -(1.0 + e) * float(arriving.v) / s.tip_mobility if s.joined(self.phase) else 0.0
        self.phase = seated_phase if seats else free_phase
        if seats:
            s.synchronise(self.phase, self.X)
        self._emit(
            "seated" if seats else "stop_impact",
            impulse_contact=on_tip,
            impulse_foundation=on_tip - (1.0 + e) * s.mass * float(arriving.z),
            energy_loss=before - self._mechanical_energy(),
        )
        if seats and s.motion(self.phase, self.X).N < 0.0:
            self._unseat()

    def _bounce(self, e: float) -> None:
        """Turn the velocity of the top, and of the tip that is joined to it, into −e times what it is."""
        s, x_dot = self.system, self.X[self.system.V]
        x_dot[s.r :] *= -e
        if s.joined(self.phase):
            x_dot -= s.tip * ((1.0 + e) * float(x_dot @ s.tip) / float(s.tip @ s.tip))
        s.settle(self.phase, self.X)

    def _unseat(self) -> None:
        self.phase = Phase(self.phase.contact)
        self._emit("unseated" if self.system.has_spring else "separation")

    def seat_height(self) -> float:
        """Return the height [m] below which a flight after an impact on the foundation does not take place.

        It is 1e-12 of the distance |Ψ − φ|, or of the tip's deflection if larger. What is cut off changes no impulse,
        and the displacement by less than (velocity × remaining time) of the bounces left out.
        """
        s, phi = self.system, self.system.stop.position
        deflection = float(np.abs(self.X[s.A]) @ np.abs(s.tip))
        return 1e-12 * max(abs(s.spring.equilibrium - phi), deflection, abs(phi), 1e-9)

    # All events -----------------------------------------------------------------------------------------------------

    def _mechanical_energy(self) -> float:
        e = self.system.energies(self.X[None], self.phase)
        return float(e["e_beam"][0] + e["e_spring"][0])

    def _emit(self, kind: str, **values: float) -> None:
        s = self.system
        m = s.motion(self.phase, self.X)
        self.loss += values.get("energy_loss", 0.0)
        if s.has_spring:
            values |= {"y": float(m.y), "z": float(m.z)}
        if s.beam is not None:
            values |= {"u_tip": float(m.u), "v_tip": float(m.v)}
        self.events.append(Event(self.time, EventKind(kind), **values))
