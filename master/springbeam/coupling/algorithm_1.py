"""Ahn & Tate's Algorithm 1 as a coupling: lines (7)–(31) with the two bodies in place of (62) and (53).

The beam FMU steps by ``midpoint``, which is (62); the spring's midpoint rule (53) is replaced by
IDA over the step, restarted by its exact start values wherever the algorithm overwrites y or z. The tip is moved to y
(lines 18, 21) by the constant tip force that does so; nothing opposes that force, so its work is energy from nowhere,
and ``energy_residual`` shows it. Readings where the print leaves something open: ``docs/paper.md``.
"""

from __future__ import annotations

from math import inf
from typing import Any

from ..bodies.protocol import NO_FORCE, Body, Ends, Force, StepRefused
from ..contact.laws import Compliance
from ..contact.phases import Impact, Joint, Phase
from ..results.trajectory import EventKind
from ..scene import Scene
from .protocol import Booking, Counts, Coupling, Step

_MAX_ITERATIONS = 50
#: Newton's tolerance of the spring's and the tip's position (section 6: ε = 1e-12) [m].
_TOLERANCE = 1e-12
_FREE, _TIED, _SEATED = Phase(), Phase(Joint.TIED), Phase(Joint.TIED, seated=True)


class Progress(Counts):
    """How far the algorithm is."""

    solves: int = 0
    touched: bool = False
    acting: float = 0.0  #: λ_nc as lines 12 and 15 have left it
    #: Size of a step [s], and u_tip per unit tip force over it [m/N]; the beam is linear.
    response: tuple[float, float] = (0.0, 0.0)
    law_force: float = 0.0  #: mean of λ_nc(Ψ − u)₊^p over the last step [N]
    #: The phase of the last step, and the impulse of the foundation over it [N·s].
    made: tuple[Phase, float] | None = None
    injected_into_beam: float = 0.0  #: [J]
    injected_into_spring: float = 0.0  #: [J]


class Algorithm1(Coupling):
    """Coupling by lines 8–30 of Algorithm 1, which decide in each step whether the ends are joined."""

    state: Progress
    decides, energy_exact = True, False

    def __init__(self, scene: Scene) -> None:
        assert scene.spring is not None
        self._spring, self._impact = scene.spring, scene.contact.impact
        self._stiffness, self._exponent = scene.contact.stiffness, scene.contact.exponent
        self._phi = -inf if scene.stop is None else scene.stop.position
        self.state = Progress()

    def solve(self, upper: Body, lower: Body, time: float, size: float, start: Ends, guess: Force) -> Step:
        """Make lines 8–30; the forces of the step are means. Raises StepRefused where Newton's method fails."""
        psi, u, (y, z, _, _) = self._spring.equilibrium, start[0].displacement, start[1]
        if size != self.state.response[0]:
            self.state.response = (size, self._measured(upper, time, size))
        u_free = upper.advance(time, size, NO_FORCE).displacement
        phase, contact, inside, foundation = _FREE, 0.0, 0.0, 0.0
        if not self.state.touched:
            lower.advance(time, size, NO_FORCE)
        else:
            u_new = self._predicted_tip(u_free, u)  # line 9
            kinetic, potential, dissipated, _ = lower.energies()
            acting = self.state.acting
            joined = u_new <= psi  # line 14 then asks for no y_new
            if not joined:
                y_new, pressing = self._spring_end(lower, time, size, y)  # line 10
                if psi < y_new < u_new:  # lines 11–13
                    self.state.acting = 0.0
                else:
                    joined = u_new <= y_new  # line 14
            if joined:
                phase = _TIED
                self.state.acting = acting = self._stiffness  # line 15
                lower.restart(time, u_new, z, dissipated)  # line 16
                y_new, pressing = self._spring_end(lower, time, size, u_new)  # line 17
                if y_new <= self._phi:  # lines 20–24
                    phase, y_new = _SEATED, self._phi
                    lower.restart(time, y, z, dissipated)
                    pressing = 0.5 * (self._law(y_new) + self._law(y))
                    foundation = self._foundation_force(lower, time, size, pressing)
                u_new = y_new  # lines 18, 21
                z_new = 2.0 * (y_new - y) / size - z  # line 29
                if phase is _SEATED:
                    lower.restart(time + size, y_new, z_new, lower.energies().dissipated)
                else:  # the spring has come to y_new: only its velocity is another
                    lower.apply_impulse(lower.mass * (z_new - lower.motion().velocity))
            contact = (u_new - u_free) / self.state.response[1]  # lines 13, 19, 22
            if contact != 0.0:  # else the beam is there
                upper.rewind()
                upper.advance(time, size, (contact, 0.0, 0.0))
            inside = 0.5 * (self._law(u_new, acting) + self._law(u, acting))
            # What no force of the model does: the overwritten tip's work on the beam, the exchanged yˡ on the spring.
            self.state.injected_into_beam += (contact - inside) * (u_new - u)
            worked = (foundation - pressing + self._spring.external_force) * (y_new - y)
            after = lower.energies()
            gained = after.kinetic + after.potential + after.dissipated - kinetic - potential - dissipated
            self.state.injected_into_spring += gained - worked
        self.state.law_force, self.state.made = inside, (phase, size * foundation)
        ends = (upper.motion(), lower.motion())
        return Step(time, size, (contact, 0.0, 0.0), (foundation, 0.0, 0.0), start, ends)

    def settle(self, time: float, upper: Body, lower: Body) -> tuple[Phase, EventKind | None, Impact]:
        """Return the phase; the first contact is where a step ends with the tip at Ψ or below, or the run begins so."""
        (phase, impulse), tip = self.state.made or (_FREE, 0.0), upper.motion()
        if self.state.touched or tip.displacement > self._spring.equilibrium:
            event = EventKind.STOP_IMPACT if phase is _SEATED else None
            return phase, event, Impact(of_foundation=impulse)
        self.state.touched, self.state.acting = True, self._stiffness
        # Line 5, or ẏ(t_c) as the scene has it.
        z = tip.velocity if self._impact == "tip" else lower.motion().velocity
        lower.restart(time, self._spring.equilibrium, z, lower.energies().dissipated)
        return phase if self.state.made else _TIED, EventKind.IMPACT, Impact()

    def booking(self, ends: Ends) -> Booking:
        return Booking(law_force=self.state.law_force)

    def report(self) -> tuple[dict[str, Any], list[str]]:
        """Return what `Coupling.report` does, with what the algorithm has injected [J]."""
        found, _ = super().report()
        found |= {
            "spring_steps_per_solve": self.state.iterations / self.state.solves if self.state.solves else 0.0,
            "injected_into_beam": self.state.injected_into_beam,
            "injected_into_spring": self.state.injected_into_spring,
        }
        return found, [
            "contact.law = 'paper' overwrites the tip's position, which changes the energy by energy_residual"
        ]

    def _measured(self, beam: Body, time: float, size: float) -> float:
        """Return the response to a force that moves the tip as far as it moves by itself; to 1 N it may be rounding."""
        alone = beam.advance(time, size, NO_FORCE)
        length = max(abs(alone.displacement), size * abs(alone.velocity))
        force = 2.0 * beam.mass * length / size**2 or 1.0
        beam.rewind()
        pushed = beam.advance(time, size, (force, 0.0, 0.0))
        beam.rewind()
        return (pushed.displacement - alone.displacement) / force

    def _law(self, w: float, stiffness: float | None = None) -> float:
        """Return λ (Ψ − w)₊^p [N] with the λ_nc that lines 12 and 15 have left, or with ``stiffness``."""
        acting = self.state.acting if stiffness is None else stiffness
        return Compliance(acting, self._exponent).force(self._spring.equilibrium - w)

    def _slope(self, w: float, force: float) -> float:
        """Return the derivative of `_law` by w [N/m], from its ``force`` there."""
        depth = self._spring.equilibrium - w
        return -self._exponent * force / depth if depth > 0.0 else 0.0

    def _predicted_tip(self, u_free: float, u: float) -> float:
        """Return uˡ⁺¹ of (62), nonlinear only at the tip: u = u_free + b ½ (λ(Ψ−u)₊^p + λ(Ψ−uˡ)₊^p)."""
        before, w, half = self._law(u), u, 0.5 * self.state.response[1]
        for _ in range(_MAX_ITERATIONS):
            force = self._law(w)
            change = (w - u_free - half * (force + before)) / (1.0 - half * self._slope(w, force))
            w -= change
            if abs(change) <= _TOLERANCE:
                return w
        raise StepRefused("line 9 of Algorithm 1: Newton's method for the tip does not converge")

    def _spring_end(self, spring: Body, time: float, size: float, y: float) -> tuple[float, float]:
        """Return yˡ⁺¹ from ``y``, and the mean force ½ (λ(Ψ−yˡ⁺¹)₊^p + λ(Ψ−y)₊^p) that presses on the way."""
        before, end = self._law(y), y
        spring.mark()
        response = 0.5 * size**2 / spring.mass
        for k in range(1, _MAX_ITERATIONS + 1):
            force = self._law(end)
            pressing = 0.5 * (force + before)
            spring.rewind()
            reached = spring.advance(time, size, (pressing, 0.0, 0.0)).displacement
            change = (end - reached) / (1.0 + 0.5 * response * self._slope(end, force))
            if abs(change) <= _TOLERANCE:
                self.state.solves += 1
                self.state.iterations += k
                return reached, pressing
            end -= change
        raise StepRefused("lines 10 and 17 of Algorithm 1: Newton's method for the spring does not converge")

    def _foundation_force(self, spring: Body, time: float, size: float, pressing: float) -> float:
        """Return the constant N [N] with which the step from (yˡ, zˡ) ends on the foundation."""
        spring.mark()
        n, response = 0.0, 0.5 * size**2 / spring.mass
        for _ in range(_MAX_ITERATIONS):
            spring.rewind()
            reached = spring.advance(time, size, (pressing, 0.0, 0.0), (n, 0.0, 0.0)).displacement
            miss = self._phi - reached
            if abs(miss) <= _TOLERANCE:
                return n
            n += miss / response
        raise StepRefused("line 24 of Algorithm 1: no foundation force found")
