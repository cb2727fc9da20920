"""Phases and impacts: who is joined to whom, and what an event changes.

``docs/model.md`` states the laws; section names below are its.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

from ..bodies.protocol import Ends, Motion
from ..motion.events import EventKind, Joint
from .interface import Interface, common_velocity

#: A rebound slower than this fraction of the fastest foundation impact so far ends seated (e < 1 only); slower than the
#: second, if it would also rise no higher than positions can be told apart.
_SEATING_SPEED, _SEATING_SPEED_UNSEEN = 1e-8, 1e-4
#: Rounding of a velocity, relative to the largest so far.
VELOCITY_ROUNDING = 16.0 * 2.0**-52


@dataclass(frozen=True)
class Phase:
    joint: Joint = Joint.FREE
    #: The lower end is held by the foundation: the spring at y = φ or, without a spring, the tip itself.
    seated: bool = False

    @cached_property
    def name(self) -> str:
        """Name in the column ``phase``."""
        return "seated" if self.seated else self.joint.value

    @cached_property
    def number(self) -> float:
        """Number in a record (`springbeam.results.steps.PHASE_NAMES`)."""
        return float(list(Joint).index(self.joint) + 3 * self.seated)


@dataclass(frozen=True)
class Impact:
    """Impulses [N·s], upward on each body, and the energy they take away [J]."""

    on_beam: float = 0.0
    on_spring: float = 0.0
    of_foundation: float = 0.0
    energy_loss: float = 0.0


def meeting(v: float, z: float, tip_mass: float, mass: float) -> Impact:
    """Return the impact of tip [m/s, kg] and spring top [m/s, kg] (docs/model.md, "What happens at an event").

    J = (z − v)/(1/m_tip + 1/m), equal and opposite, and both leave with one velocity. A massless tip takes no impulse.
    """
    if tip_mass == 0.0:
        return Impact()
    reduced = 1.0 / (1.0 / tip_mass + 1.0 / mass)
    j = reduced * (z - v)
    return Impact(on_beam=j, on_spring=-j, energy_loss=0.5 * reduced * (z - v) ** 2)


def rebound(velocity: float, mass: float, restitution: float) -> tuple[float, float]:
    """Impulse −(1+e) m w [N·s] that reverses w to −e w, and its loss ½ m w² (1 − e²) [J]."""
    # Taken from 0, the impulse on nothing is 0 and not −0.
    return 0.0 - (1.0 + restitution) * mass * velocity, 0.5 * mass * velocity**2 * (1.0 - restitution**2)


def foundation_impact(v: float, z: float, tip_mass: float, mass: float, restitution: float) -> Impact:
    """Tip and spring top strike the foundation, each at its velocity [m/s]; a mass of 0 [kg] takes no part.

    Each velocity is reversed by itself, so nothing is lost at e = 1.
    """
    on_beam, loss_beam = rebound(v, tip_mass, restitution)
    on_spring, loss_spring = rebound(z, mass, restitution)
    return Impact(on_beam, on_spring, on_spring + on_beam, loss_spring + loss_beam)


class Transitions:
    """What each kind of event does to the phase and to the velocities.

    Parameters
    ----------
    interface
        What may meet.
    fastest
        Returns the largest speed of an end so far [m/s].
    """

    _hardest = 0.0  #: speed of the fastest impact on the foundation so far [m/s]

    def __init__(self, interface: Interface, fastest: Callable[[], float]) -> None:
        self._interface = interface
        self._fastest = fastest
        self._tip_mass = interface.upper.mass
        self._mass = interface.lower.mass
        self._alone = interface.alone

    def after(
        self,
        kind: EventKind,
        phase: Phase,
        start: Ends,
        elapsed: float,
        ends: Ends,
        end_force: float,
        tolerance: float,
    ) -> tuple[EventKind, Phase, Impact]:
        """The event's kind (an impact on the foundation may end seated), the phase after it, and the impact.

        ``ends`` are (tip, lower end) before it, ``start`` the same ``elapsed`` [s] ago, where the step began that ends
        with it, ``end_force`` is C [N], ``tolerance`` what positions can be told apart to [m].
        """
        tip, low = ends
        if kind is EventKind.IMPACT:
            return kind, *self._meet(phase, tip, low, tolerance)
        if kind is EventKind.STOP_IMPACT:
            return self._strike(phase, start, elapsed, ends, tolerance)
        if kind is EventKind.RELEASE:
            if end_force > 0.0:
                return kind, Phase(Joint.TOUCH), Impact()
            return kind, Phase(Joint.FREE), self._part(phase, tip, low)
        if kind is EventKind.RETIE:
            return kind, Phase(Joint.TIED), Impact()
        if kind is EventKind.UNSEATED:
            return kind, Phase(phase.joint), self._part(phase, tip, low) if self._ties(phase) else Impact()
        assert kind is EventKind.SEPARATION
        if self._tip_mass == 0.0 and low.velocity < 0.0 and self._at_equilibrium(low, tolerance):
            return EventKind.RETIE, Phase(Joint.TIED), Impact()  # C vanishes at Ψ, where they are tied again
        opened = Phase(Joint.FREE, seated=phase.seated and not self._alone)
        return kind, opened, self._part(opened, tip, low)

    def _meet(self, phase: Phase, tip: Motion, low: Motion, tolerance: float) -> tuple[Phase, Impact]:
        impact = meeting(tip.velocity, low.velocity, self._tip_mass, self._mass)
        common = low.velocity + impact.on_spring / self._mass
        if self._interface.lasting:
            tied = True
        elif self._at_equilibrium(low, tolerance):
            tied = common < 0.0 or (common == 0.0 and not self._rises_from_rest())
        else:
            tied = low.displacement < self._interface.equilibrium
        # A top that stands on the foundation is driven into it, and strikes it at once; not by a tip without mass or at
        # rest.
        seated = phase.seated and (self._tip_mass == 0.0 or common == 0.0)
        return Phase(Joint.TIED if tied else Joint.TOUCH, seated), impact

    def _ties(self, phase: Phase) -> bool:
        """Whether a rigid law holds the ends together in ``phase``."""
        return phase.joint is not Joint.FREE and self._interface.soft is None

    def _at_equilibrium(self, low: Motion, tolerance: float) -> bool:
        """Whether the lower end is at Ψ, to rounding."""
        psi = self._interface.equilibrium
        return abs(low.displacement - psi) <= 4.0 * tolerance + 1e-12 * abs(psi)

    def _rises_from_rest(self) -> bool:
        """Whether a massless tip and the lower end, at rest together at Ψ, are pushed up."""
        tip = self._interface.upper
        low = self._interface.lower
        psi = self._interface.equilibrium
        return tip.massless and tip.holding_force(psi, 0.0) + low.holding_force(psi, 0.0) < 0.0

    def _strike(
        self,
        phase: Phase,
        start: Ends,
        elapsed: float,
        ends: Ends,
        tolerance: float,
    ) -> tuple[EventKind, Phase, Impact]:
        """The lower end reaches the foundation: it rebounds, or stays when the rebound has died out."""
        e = self._interface.restitution
        with_tip = self._alone or self._ties(phase)
        masses = self._tip_mass if with_tip else 0.0, 0.0 if self._alone else self._mass
        v, z = (end.velocity for end in ends)
        speed = max(abs(z), abs(v) if with_tip else 0.0)
        self._hardest = max(self._hardest, speed)
        after, before = (common_velocity(tip.velocity, low.velocity, *masses) for tip, low in (ends, start))
        # It strikes while rising if the rebound would be over in no time.
        dies_out = after > 0.0 or e * speed <= _SEATING_SPEED * self._hardest
        if not self._alone and elapsed > 0.0 and e * speed <= _SEATING_SPEED_UNSEEN * self._hardest:
            # What presses it down is told by the flight: C at its end may be off by what reverses a mismatch of
            # velocities, (d + 1)(d + 2) times their quotient by the step. It rises by (e z)²/2a; each impact is found
            # to no better than the tolerance, which brings it as much.
            dies_out |= 0.5 * (e * after) ** 2 * elapsed <= tolerance * (before - after)
        if (dies_out and e < 1.0) or speed == 0.0:
            stays = Phase(Joint.TIED if self._alone else phase.joint, seated=True)
            return EventKind.SEATED, stays, foundation_impact(v, z, *masses, restitution=0.0)
        return EventKind.STOP_IMPACT, phase, foundation_impact(v, z, *masses, restitution=e)

    def _part(self, held: Phase, tip: Motion, low: Motion) -> Impact:
        """Ends that part take the velocity that they have in common, where those of steps differ by more than rounding.

        A lower end that the foundation holds in the phase ``held`` is at rest.
        """
        if abs(tip.velocity - low.velocity) <= VELOCITY_ROUNDING * self._fastest():
            return Impact()
        if self._alone or held.seated:
            on_beam, loss = rebound(tip.velocity, self._tip_mass, restitution=0.0)
            return Impact(on_beam, of_foundation=on_beam, energy_loss=loss)
        return meeting(tip.velocity, low.velocity, self._tip_mass, self._mass)
