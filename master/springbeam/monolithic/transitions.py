"""Effects of events on the state of a `HybridSystem`: impacts, changes of phase, energy losses.

=============  ====================================================================================================
impact         tip and spring meet: perfectly inelastic, J = (z − v)/(eᵀM⁻¹e + 1/m) on the tip, −J on the spring. A law
               that is a force: no impulse
stop_impact    y = φ with z < 0: z → −e z, and the joined tip likewise, by J = −(1+e) v/(eᵀM⁻¹e); without a spring
               the tip on the stop
release        tied, y rises through Ψ; continues as `touch` if C > 0 there, else as `free`
retie          touch, y falls through Ψ
separation     touch, C becomes negative (a law that is a force: the penetration ends); at once where a meeting above
               Ψ leaves C < 0. A tip without inertia loses what it springs back with, here and at a release
seated         the impact after which bounces have died out: the flight would rise less than ``seat_height``
unseated       seated, N becomes negative; without a spring this is the tip's `separation`
=============  ====================================================================================================
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..motion.events import Event, EventKind, Joint
from .hybrid_system import HybridSystem
from .laws import ReferencePhase, Watch


class HybridState:
    """Time, state and phase of a run, what impacts have lost so far [J], and its events."""

    def __init__(self, system: HybridSystem, time: float, X: np.ndarray) -> None:
        self.system = system
        self.time = time
        self.X = X
        self.phase = ReferencePhase("free")
        self.loss = 0.0
        self.events: list[Event] = []
        m = system.motion(self.phase, X)
        if not (system.law.rigid and abs(float(m.v - m.z)) > system.noise("m/s", X)):
            self.phase = ReferencePhase(system.law.start)
            if not system.scene.static:  # then it is what the ends joined have
                system.synchronise(self.phase, X)
        if system.scene.static and not system.law.rigid and m.u < m.y and self.phase.contact == "free":
            self.phase = ReferencePhase("touch")
        on_stop = system.scene.stop is not None and system.has_spring and float(m.y) <= system.stop.position
        if system.scene.static and on_stop:
            self.phase = ReferencePhase(self.phase.contact, seated=True)

    def watched(self) -> list[Watch]:
        """Return the functions that are ≥ 0 as long as the phase lasts."""
        s = self.system
        phi = self.system.stop.position
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
        own = {"meet": self._meet, "stop": self._hit_stop, "unseat": self._unseat}
        if event.name in own:
            own[event.name]()
        else:
            self._go_on(event.name)
        self.system.synchronise(self.phase, self.X)

    def start(self) -> None:
        """Make first contact, and its impact, where tip and obstacle touch at the start or are joined from there on."""
        s = self.system
        X = self.X
        m = s.motion(self.phase, X)
        noise = s.noise("m", X)
        if s.law.start != "free":
            meets = self.phase.contact == "free"
        else:
            meets = s.scene.coupled and float(m.u - m.y) <= noise and float(m.v) <= float(m.z)
        if meets:
            self._meet()
        elif s.alone and s.scene.stop is not None:
            onto_it = (float(m.v), float(m.z_dot)) < (0.0, 0.0)
            if m.u - s.stop.position <= noise and onto_it:
                self._hit_stop()

    # Contact --------------------------------------------------------------------------------------------------------

    def _go_on(self, happened: str, before: float | None = None, impulse: float = 0.0) -> None:
        """Begin the phase that follows; ``before`` is the energy [J] before an impact."""
        s = self.system
        X = self.X
        if s.scene.massless and before is None:  # a tip that is released may jump
            before = self._mechanical_energy()
        contact, kind = s.law.after(happened, s.motion(ReferencePhase("tied"), X), s.noise("m", X))
        self.phase = ReferencePhase(contact, self.phase.seated)
        s.synchronise(self.phase, X)
        if kind is not None:
            lost = 0.0 if before is None else before - self._mechanical_energy()
            self._emit(kind, impulse_contact=impulse, energy_loss=lost)

    def _meet(self) -> None:
        s = self.system
        X = self.X
        if not s.law.rigid:
            self._go_on("meet")
            return
        m = s.motion(self.phase, X)
        before = self._mechanical_energy()
        impulse = float(m.z - m.v) / s.mobility
        at_rest = float(m.v) == float(m.z) == 0.0
        was_seated = self.phase.seated
        self.phase = ReferencePhase("tied", was_seated and at_rest)
        s.synchronise(self.phase, X)
        self._go_on("meet", before, impulse)
        if was_seated and not at_rest:  # the spring already stands on the foundation
            self._hit_stop()
        elif self.phase.contact == "touch" and float(s.motion(self.phase, X).C) < -s.noise("N", X):
            self._go_on("separate")

    # Foundation -----------------------------------------------------------------------------------------------------

    def _hit_stop(self) -> None:
        """Apply Newton's impact law on the foundation, and seat what has bounced for the last time."""
        s = self.system
        X = self.X
        e = self.system.stop.restitution
        contact = self.phase.contact
        self._place(s.stop.position)
        before = self._mechanical_energy()
        arriving = s.motion(self.phase, X)
        velocity = X[s.V].copy()
        self.phase = ReferencePhase(contact)
        held = s.held(self.phase, s.stop.position)
        held.hold(X[s.V], -e * (velocity @ held.rows.T))
        m = s.motion(self.phase, X)
        seats = e == 0.0 or 0.5 * float(m.z) ** 2 <= -float(m.z_dot) * self.seat_height()
        if seats:
            X[s.V] = velocity
            e = 0.0
            self.phase = ReferencePhase(contact, seated=True)
        s.synchronise(self.phase, X)
        on_tip = -(1.0 + e) * float(arriving.v) / s.tip_mobility if s.joined(self.phase) else 0.0
        self._emit(
            "seated" if seats else "stop_impact",
            impulse_contact=on_tip,
            impulse_foundation=on_tip - (1.0 + e) * s.mass * float(arriving.z),
            energy_loss=before - self._mechanical_energy(),
        )
        if seats and s.motion(self.phase, X).N < 0.0:
            self._unseat()

    def _place(self, level: float) -> None:
        """Put the top, and the tip that is joined to it, at a height [m]."""
        held = self.system.held(self.phase, level)
        held.hold(self.X[self.system.A], held.levels)

    def _unseat(self) -> None:
        self.phase = ReferencePhase(self.phase.contact)
        self._emit("unseated" if self.system.has_spring else "separation")

    def seat_height(self) -> float:
        """Return the height [m] below which a flight after an impact on the foundation does not take place.

        It is 1e-12 of the distance |Ψ − φ|, or of the tip's deflection if larger. This changes no impulse,
        and the displacement by less than (velocity × remaining time) of the bounces left out.
        """
        s = self.system
        phi = self.system.stop.position
        deflection = float(np.abs(self.X[s.A]) @ np.abs(s.tip))
        return 1e-12 * max(abs(s.spring.equilibrium - phi), deflection, abs(phi), 1e-9)

    # All events -----------------------------------------------------------------------------------------------------

    def _mechanical_energy(self) -> float:
        e = self.system.energies(self.X, self.phase)
        return float(e["e_beam"] + e["e_spring"] + e["e_load"])

    def _emit(self, kind: str, **values: Any) -> None:
        s = self.system
        m = s.motion(self.phase, self.X)
        self.loss += values.get("energy_loss", 0.0)
        if s.has_spring:
            values |= {"y": float(m.y), "z": float(m.z)}
        if s.beam is not None:
            values |= {"u_tip": float(m.u), "v_tip": float(m.v)}
        contact = self.phase.contact
        joint = Joint("touch" if contact == "slack" else contact)
        self.events.append(Event(self.time, EventKind(kind), **values, joint=joint, seated=self.phase.seated))
