"""The phases of a run: what ends each one, and what happens then. `TRANSITIONS` is the whole automaton.

A phase lasts as long as its guards are positive. A guard is a function of the ends (`springbeam.contact.events`) or a
force that can only push; where the first of them falls through zero its event happens. The effect of the event is the
next phase and an impact. ``docs/model.md``, "Phases", shows the table and states the laws.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import inf
from typing import Literal, NamedTuple

from ..bodies.protocol import Ends
from ..motion.events import EventKind, Joint
from .events import EventFunction, Height, gap
from .impacts import NO_IMPACT, Impact, foundation_impact, meeting, rebound
from .interface import Interface, Rigid, common_velocity

#: A rebound slower than this fraction of the fastest foundation impact so far ends seated (e < 1 only); slower than the
#: second, if it would also rise no higher than the resolution of positions.
_SEATING_SPEED = 1e-8
_SEATING_SPEED_UNSEEN = 1e-4
#: Rounding of a velocity, relative to the largest so far.
VELOCITY_ROUNDING = 16.0 * 2.0**-52
_TIP = 0
_LOW = 1

#: A force that can only push, by its name in steps and instants: C between the ends, or N of the foundation.
PushingForce = Literal["contact", "foundation"]


@dataclass(frozen=True)
class Phase:
    joint: Joint = Joint.FREE
    #: The lower end is held by the foundation: the spring at y = φ or, without a spring, the tip itself.
    seated: bool = False

    @cached_property
    def joined(self) -> bool:
        """Whether the ends are together, by a law or by the foundation that holds them."""
        return self.joint is not Joint.FREE

    @cached_property
    def name(self) -> str:
        """Name in the column ``phase``."""
        return "seated" if self.seated else self.joint.value

    @cached_property
    def number(self) -> float:
        """Number in a record (`springbeam.results.records.PHASE_NAMES`)."""
        return float(list(Joint).index(self.joint) + 3 * self.seated)


class Instant(NamedTuple):
    """What the effect of an event depends on."""

    phase: Phase  #: which the event ends
    ends: Ends  #: before the event
    start: Ends  #: where the step began that ends with it
    elapsed: float  #: size of that step [s]
    contact_force: float  #: C [N]
    tolerance: float  #: resolution of positions [m]
    together: float  #: distance within which events are simultaneous [m]
    fastest: float  #: the largest speed of an end so far [m/s]


class Outcome(NamedTuple):
    """What has happened: the event, the phase after it, and its impact."""

    kind: EventKind
    phase: Phase
    impact: Impact = NO_IMPACT


class Automaton:
    """The phases of one pair of ends.

    Joined ends have the rate of their common velocity in the guards: they differ from each other by what the energy
    schemes leave open, and one of them may even go the other way.

    Parameters
    ----------
    interface
        What may meet.
    """

    def __init__(self, interface: Interface) -> None:
        self._interface = interface
        self._tip_mass = interface.upper.mass
        self._mass = interface.lower.mass
        self._hardest = 0.0  #: speed of the fastest impact on the foundation so far [m/s]

    def guards(self, phase: Phase) -> list[tuple[EventKind, EventFunction | PushingForce]]:
        """Return what may end ``phase``."""
        return [
            (row.kind, row.guard(self._interface, phase))
            for row in TRANSITIONS
            if row.where(self._interface) and row.joint in (None, phase.joint) and phase.seated in row.seated
        ]

    def after(self, kind: EventKind, at: Instant) -> Outcome:
        """Return what happens where the guard of ``kind`` has become zero."""
        return _EFFECTS[kind](self, at)

    # -- effects ----------------------------------------------------------------------------------------------------

    def meet(self, at: Instant) -> Outcome:
        """An inelastic impact; *tied* below Ψ or going there, else *touch*."""
        tip, low = at.ends
        impact = meeting(tip.velocity, low.velocity, self._tip_mass, self._mass)
        common = low.velocity + impact.on_spring / self._mass
        if not ties(self._interface):
            tied = not lets_part(self._interface)
        elif self._is_at_equilibrium(at):
            tied = common < 0.0 or (common == 0.0 and not (at.phase.seated or self._stays_at_equilibrium()))
        else:
            tied = low.displacement < self._interface.equilibrium
        # A top that stands on the foundation is driven into it, and strikes it at once; not by a tip without mass or at
        # rest.
        seated = at.phase.seated and (self._tip_mass == 0.0 or common == 0.0)
        return Outcome(EventKind.IMPACT, Phase(Joint.TIED if tied else Joint.TOUCH, seated), impact)

    def release(self, at: Instant) -> Outcome:
        """*Touch* if C > 0; else the ends part: *free*."""
        if at.contact_force > 0.0:
            return Outcome(EventKind.RELEASE, Phase(Joint.TOUCH))
        return Outcome(EventKind.RELEASE, Phase(Joint.FREE), self._parting(at))

    def tie(self, at: Instant) -> Outcome:
        """*Tied*."""
        return Outcome(EventKind.RETIE, Phase(Joint.TIED))

    def part(self, at: Instant) -> Outcome:
        """The ends take their common velocity and part: *free*; a massless tip that falls through Ψ is *tied*."""
        _, low = at.ends
        falls = low.velocity < 0.0 and ties(self._interface) and self._is_at_equilibrium(at)
        if self._tip_mass == 0.0 and falls:
            return self.tie(at)  # C vanishes at Ψ, where they are tied again
        opened = Phase(Joint.FREE, seated=at.phase.seated and not self._interface.alone)
        return Outcome(EventKind.SEPARATION, opened, self._parting(at))

    def strike(self, at: Instant) -> Outcome:
        """What is at the foundation rebounds, the joined tip with it; *seated* where the rebound has died out."""
        interface = self._interface
        e = interface.restitution
        with_tip = interface.alone or self._ties(at.phase)
        masses = self._tip_mass if with_tip else 0.0, 0.0 if interface.alone else self._mass
        v, z = (end.velocity for end in at.ends)
        speed = max(abs(z), abs(v) if with_tip else 0.0)
        self._hardest = max(self._hardest, speed)
        after, before = (common_velocity(tip.velocity, low.velocity, *masses) for tip, low in (at.ends, at.start))
        # It strikes while rising if the rebound would be over in no time.
        dies_out = after > 0.0 or e * speed <= _SEATING_SPEED * self._hardest
        if not interface.alone and at.elapsed > 0.0 and e * speed <= _SEATING_SPEED_UNSEEN * self._hardest:
            # The flight shows what presses it down: C at its end may be wrong by what reverses a mismatch of
            # velocities, (d + 1)(d + 2) times their quotient by the step. It rises by (e z)²/2a; each impact is found
            # to no better than the tolerance, which brings it as much.
            dies_out |= 0.5 * (e * after) ** 2 * at.elapsed <= at.tolerance * (before - after)
        if (dies_out and e < 1.0) or speed == 0.0:
            # At Ψ or above, nothing is tied.
            untied = ties(interface) and at.ends[1].displacement >= interface.equilibrium
            joint = Joint.TOUCH if untied and at.phase.joint is Joint.TIED else at.phase.joint
            stays = Phase(Joint.TIED if interface.alone else joint, seated=True)
            return Outcome(EventKind.SEATED, stays, foundation_impact(v, z, *masses, restitution=0.0))
        return Outcome(EventKind.STOP_IMPACT, at.phase, foundation_impact(v, z, *masses, restitution=e))

    def leave(self, at: Instant) -> Outcome:
        """The lower end leaves the foundation; a joined tip leaves with it, at rest."""
        impact = self._parting(at) if self._ties(at.phase) else NO_IMPACT
        return Outcome(EventKind.UNSEATED, Phase(at.phase.joint), impact)

    def _ties(self, phase: Phase) -> bool:
        """Whether a rigid law, or the foundation, holds the ends together in ``phase``."""
        return phase.joined and isinstance(self._interface.law, Rigid | None)

    def _is_at_equilibrium(self, at: Instant) -> bool:
        """Whether the lower end is at Ψ, within the resolution of events."""
        _, low = at.ends
        psi = self._interface.equilibrium
        return abs(low.displacement - psi) <= 4.0 * at.together + 1e-12 * abs(psi)

    def _stays_at_equilibrium(self) -> bool:
        """Whether ends at rest together at Ψ do not go below it: on a wall, or a massless tip is pushed up."""
        tip = self._interface.upper
        low = self._interface.lower
        psi = self._interface.equilibrium
        return low.mass == inf or (tip.massless and tip.holding_force(psi, 0.0) + low.holding_force(psi, 0.0) < 0.0)

    def _parting(self, at: Instant) -> Impact:
        """Return the impact that gives ends their common velocity, if those of steps differ by more than rounding.

        A lower end that the foundation holds is at rest.
        """
        tip, low = at.ends
        if abs(tip.velocity - low.velocity) <= VELOCITY_ROUNDING * at.fastest:
            return NO_IMPACT
        if at.phase.seated:
            on_beam, loss = rebound(tip.velocity, self._tip_mass, restitution=0.0)
            return Impact(on_beam, of_foundation=on_beam, energy_loss=loss)
        return meeting(tip.velocity, low.velocity, self._tip_mass, self._mass)


# -- where there is a transition ---------------------------------------------------------------------------------------


def joins(interface: Interface) -> bool:
    """a rigid law between two ends"""
    return isinstance(interface.law, Rigid)


def lets_part(interface: Interface) -> bool:
    """the laws `transmission` and `unilateral`"""
    return isinstance(interface.law, Rigid) and not interface.law.lasting


def ties(interface: Interface) -> bool:
    """the law `transmission`"""
    return isinstance(interface.law, Rigid) and interface.law.ties


def has_foundation(interface: Interface) -> bool:
    """a foundation"""
    return interface.floor is not None


def carries_two_ends(interface: Interface) -> bool:
    """a foundation below two ends"""
    return interface.floor is not None and not interface.alone


def carries_the_tip(interface: Interface) -> bool:
    """a foundation below the tip alone"""
    return interface.alone


# -- guards ------------------------------------------------------------------------------------------------------------


def _share(interface: Interface, phase: Phase) -> float:
    """Return the tip's part in the rate of the lower end's height."""
    return interface.tip_share if joins(interface) and phase.joined else 0.0


def gap_above_zero(interface: Interface, phase: Phase) -> EventFunction:
    """g = u_tip − y > 0"""
    return gap


def below_equilibrium(interface: Interface, phase: Phase) -> EventFunction:
    """Ψ − y > 0"""
    return Height(_LOW, interface.equilibrium, _share(interface, phase), -1.0)


def above_equilibrium(interface: Interface, phase: Phase) -> EventFunction:
    """y − Ψ > 0"""
    return Height(_LOW, interface.equilibrium, _share(interface, phase))


def above_foundation(interface: Interface, phase: Phase) -> EventFunction:
    """y − φ > 0; without a lower body u_tip − φ > 0"""
    assert interface.floor is not None
    if interface.alone:
        return Height(_TIP, interface.floor, 1.0)
    return Height(_LOW, interface.floor, _share(interface, phase))


def contact_pushes(interface: Interface, phase: Phase) -> PushingForce:
    """C > 0"""
    return "contact"


def foundation_pushes(interface: Interface, phase: Phase) -> PushingForce:
    """N > 0"""
    return "foundation"


# -- the automaton -----------------------------------------------------------------------------------------------------


class Transition(NamedTuple):
    """What ends a phase, and what happens then."""

    where: Callable[[Interface], bool]  #: whether an interface has this transition
    joint: Joint | None  #: the phases that it ends; ``None``: whether the ends are joined or not
    seated: tuple[bool, ...]  #: the phases that it ends
    guard: Callable[[Interface, Phase], EventFunction | PushingForce]  #: positive as long as the phase lasts
    kind: EventKind
    effect: Callable[[Automaton, Instant], Outcome]


_OFF = (False,)
_ON = (True,)
_EITHER = (False, True)
#: What ends each phase. Where two guards become zero at once, the first one counts.
TRANSITIONS = (
    Transition(joins, Joint.FREE, _EITHER, gap_above_zero, EventKind.IMPACT, Automaton.meet),
    Transition(ties, Joint.TIED, _OFF, below_equilibrium, EventKind.RELEASE, Automaton.release),
    Transition(ties, Joint.TOUCH, _OFF, above_equilibrium, EventKind.RETIE, Automaton.tie),
    Transition(lets_part, Joint.TOUCH, _EITHER, contact_pushes, EventKind.SEPARATION, Automaton.part),
    Transition(has_foundation, None, _OFF, above_foundation, EventKind.STOP_IMPACT, Automaton.strike),
    Transition(carries_two_ends, None, _ON, foundation_pushes, EventKind.UNSEATED, Automaton.leave),
    Transition(carries_the_tip, None, _ON, contact_pushes, EventKind.SEPARATION, Automaton.part),
)
_EFFECTS = {row.kind: row.effect for row in TRANSITIONS}
#: A soft law acts in every phase, and no step ends where its contact begins or ends: the event and the next joint.
SOFT_TRANSITIONS = {
    Joint.FREE: (EventKind.IMPACT, Joint.TOUCH),
    Joint.TOUCH: (EventKind.SEPARATION, Joint.FREE),
}
