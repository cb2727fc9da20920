"""Attempt one step: advance both bodies from their marks by any size, under the law of the phase."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf
from typing import NamedTuple

from ..bodies import force
from ..bodies.elements import RigidWall
from ..bodies.protocol import NO_FORCE, Body, Ends, Force
from ..contact.interface import Interface
from ..contact.phases import Automaton, Phase, PushingForce
from ..coupling import coupling_of
from ..coupling.protocol import Step, Uncoupled
from ..motion.events import Joint
from .loads import Loads
from .outcome import RunStopped
from .setup import Setup

#: Events in a row, each within H of the one before; more of them and the contact is said to chatter. Impacts that die
#: out are up to 18,000 (e = 0.999); those of a lossy body on a lossless stop are without end.
_MOST_IN_A_ROW = 20_000
#: Largest product of `Body.decay` c and a macro step H at which the damping of a mismatch of velocities counts. Of an
#: impulse J a step earlier exp(−c H) is left, and its damping is c J exp(−c H): at this product less than 5e-4 of the
#: force J/H that turned the mismatch. Beyond it c is that of modes whose velocity is gone, the mismatch that of others.
_KEPT = 10.0
#: The force of a step is continued over at most this many times its size; beyond, its end value is held.
_REACH_OF_FORCE = 4.0


class Present(NamedTuple):
    """Contact force C and foundation force N [N] at an instant, by the names in `PushingForce`."""

    contact: float = 0.0
    foundation: float = 0.0


NOTHING = Present()


@dataclass
class State:
    """Where the run is, and what of the steps so far the next one needs."""

    time: float
    ends: Ends  #: after the last event
    phase: Phase = field(default_factory=Phase)
    contact: Force = NO_FORCE  #: C of the last step, continued
    last_size: float = 0.0  #: of the last step [s]
    foundation: Force = NO_FORCE  #: N of the last step, continued
    present: Present = NOTHING  #: C and N here, after the last event
    lost: float = 0.0  #: by events so far [J]
    fastest: float = 0.0  #: the largest speed of an end at a row so far [m/s]
    begun: bool = False  #: whether the row of the start is made
    energy_at_start: float = 0.0  #: before an impact there [J]
    collided: float = -inf  #: when ends have met, if that was the last event [s]: they may part again soon
    parted: float = -inf  #: when ends have parted, or a seat was left, if that was the last event [s]
    #: When ends have met again at the time at which they had parted [s]: the accelerations there, those of waves that
    #: the steps do not follow, show nothing of where the ends go, and the contact stays closed over the next step.
    met_again: float = -inf
    #: Events in a row, each within a macro step of the one before: how many, and when the last was [s].
    in_a_row: tuple[int, float] = (0, -inf)
    macro_steps: int = 0
    events: int = 0
    halvings: int = 0  #: of steps that were refused
    shapes_left: int = 0  #: of the beam, to be kept after first contact
    next_shape: float = 0.0  #: when the next of those over the run is due [s]

    def accept(self, step: Step, time: float) -> None:
        """The step that ends at ``time`` is made."""
        _, size, contact, foundation, _, _ = step
        self.time = time
        self.last_size = size
        self.contact = force.shifted(contact, size)
        self.foundation = force.shifted(foundation, size)

    def count_event(self, time: float, macro_step: float) -> None:
        """Count an event at ``time`` [s]. Raises RunStopped if they crowd."""
        number, last = self.in_a_row
        self.in_a_row = (number + 1 if time - last <= macro_step else 1, time)
        if number >= _MOST_IN_A_ROW:
            raise RunStopped(
                f"the contact chatters: {_MOST_IN_A_ROW} events, each within a macro step of {macro_step:g} s of the "
                "one before; a restitution below 1 lets impacts die out",
                self.time,
            )

    def enter(self, phase: Phase) -> None:
        """Another phase begins: what was known of the forces holds no longer."""
        if phase == self.phase:
            return
        self.phase = phase
        if not phase.joined:
            self.contact = NO_FORCE
        if not phase.seated:
            self.foundation = NO_FORCE


class Pair:
    """Both bodies of a run, one of them possibly missing, and what couples them in each phase.

    Parameters
    ----------
    setup
        What is run.
    upper, lower
        The bodies; ``None`` where there is none: a wall stands there, the lower one where the foundation is.
    """

    def __init__(self, setup: Setup, upper: Body | None, lower: Body | None) -> None:
        self.setup = setup
        #: What holds a lower end that is seated.
        self._held = None if setup.floor is None else RigidWall(setup.floor)
        self.upper: Body = upper or RigidWall(0.0)
        self.lower: Body = lower or self._held or RigidWall(setup.level)
        self.alone = lower is None  #: whether nothing but the foundation is below the tip
        self.loads = Loads(setup.loads, setup.end, self.upper, self.lower)
        self.bodies = (self.upper, self.lower)
        for body in self.bodies:
            body.take_place(upper=body is self.upper)
        abilities = [body.can() for body in self.bodies]
        self.repeatable = all(able.state for able in abilities)
        equilibrium = setup.equilibrium
        if equilibrium is None:
            equilibrium = self.lower.motion().displacement
        self.interface = Interface(
            self.upper, self.lower, setup.law, equilibrium, setup.floor, setup.restitution, self.alone
        )
        self.automaton = Automaton(self.interface)
        self._reduced_mass = [self.interface.reduced_mass(seated=seated) for seated in (False, True)]
        #: Where the ends are; looked up once, since every step asks a few times.
        self._massless = self.upper.massless
        self._tip = self.upper.motion
        self._low = self.lower.motion
        self._last: Step | None = None  #: at whose end the bodies are
        self._holding = 0.0  #: what holds a seated lower end, without loads and contact [N]
        #: The soft law between the ends; a rigid one has no force of its own, and ties them while they are joined.
        self.law = setup.soft
        #: The bodies whose acceleration, or its change by damping, is unknown.
        self.without_acceleration: list[Body] = []
        #: `Body.decay` by `id`: a body of the caller's may be a dataclass, which has no hash.
        self._decays: dict[int, float] = {}
        #: Whether contact opens and closes inside steps, without an event that ends them.
        self.opens_softly = self.law is not None and not setup.lasting
        #: What couples the bodies where the law acts, and where the ends are apart.
        self.joined = coupling_of(setup.scheme, setup.degree, setup.tolerance, self.law, self.upper.reach)
        self._uncoupled = self.joined if self.law else Uncoupled()
        #: Whether a step can be repeated with another size.
        self.divides = self.repeatable and all(able.any_size for able in abilities)

    def initial_state(self, time: float, contact_force: float = 0.0) -> State:
        """Return the state before anything happens; ends that a soft law joins for good are joined from the start.

        A rigid law holds them by ``contact_force`` [N]. In a start at rest, a lower end at the stop rests on it.
        """
        tip, low = ends = self.ends()
        if self.law is not None:
            contact_force = self.law.force(low.displacement - tip.displacement, low.velocity - tip.velocity)
        joint = Joint.TIED if self.law is not None and self.setup.lasting else Joint.FREE
        seated = self.setup.at_rest and not self.alone and low.displacement == self.setup.floor
        constant = (contact_force, 0.0, 0.0)
        alone = self.alone and self.law is None
        return State(time, ends, Phase(joint, seated), contact=constant, foundation=constant if alone else NO_FORCE)

    def mark(self) -> None:
        """Remember the bodies' states as those that steps start from."""
        for body in self.bodies:
            body.mark()

    def rewind(self) -> None:
        self._last = None
        for body in self.bodies:
            body.rewind()

    def attempt(self, state: State, size: float, start: Ends, phase: Phase | None = None) -> Step:
        """Step from the mark by ``size`` [s] under the law of the phase (``phase`` instead of the state's own).

        Raises StepRefused.
        """
        phase = state.phase if phase is None else phase
        held = self._held if phase.seated else None
        if self.loads.any:
            self.loads.act(state.time, size)
        coupling = self.joined
        guess = state.contact  # the force of the last step, continued
        if not phase.joined:
            coupling = self._uncoupled
            guess = NO_FORCE
        elif size > _REACH_OF_FORCE * state.last_size:
            guess = (guess[0], 0.0, 0.0)
        step = coupling.solve(self.upper, held or self.lower, state.time, size, start, guess)
        self._last = step = step if held is None else self._with_foundation(step)
        return step

    def _with_foundation(self, step: Step) -> Step:
        """Return ``step`` with the force N on the lower end that the foundation holds; a spring is at rest under it."""
        time, size, contact, _, _, (tip, _) = step
        assert self.interface.floor is not None
        self._holding = self.lower.holding_force(self.interface.floor, 0.0)
        load, slope, bend = self.lower.load_on_end()
        bearing = (self._holding - load, -slope, -bend)
        self.lower.rewind()
        # C and the part of N that bears it cancel: together, rounding of a large C would move a light top.
        low = self.lower.advance(time, size, NO_FORCE, bearing)
        foundation = (contact[0] + bearing[0], contact[1] + bearing[1], contact[2] + bearing[2])
        return step._replace(foundation=foundation, end=(tip, low))

    def repeated(self, state: State, step: Step) -> Step:
        """Leave the bodies at the end of ``step``, repeating it if a look inside it has moved them."""
        return step if step is self._last else self.attempt(state, step.size, step.start)

    def apply_impulses(self, *impulses: float) -> None:
        """Upward impulses [N·s], on the upper and on the lower body."""
        for body, impulse in zip(self.bodies, impulses, strict=True):
            if impulse != 0.0:
                body.apply_impulse(impulse)

    def follow_phase(self, phase: Phase) -> float:
        """Let a massless tip take the velocity of what ``phase`` joins it to, or spring back; return its loss [J]."""
        if not phase.joined:
            return self.upper.release()
        self.upper.join(self.lower.motion().velocity)
        return 0.0

    def ends(self) -> Ends:
        """(tip, lower end)."""
        return self._tip(), self._low()

    def ends_together(self, phase: Phase) -> Ends:
        """Return (tip, lower end); where a rigid law joins them, with the velocity that they have in common."""
        tip, low = ends = self.ends()
        if not self._ties(phase):
            return ends
        common = self._common_velocity(phase, ends)
        return tip._replace(velocity=common), low._replace(velocity=common)

    def _common_velocity(self, phase: Phase, ends: Ends) -> float:
        """Return the velocity of ``ends`` that a rigid law joins [m/s]."""
        tip, low = ends
        share = 0.0 if phase.seated else self.interface.tip_share
        return low.velocity + share * (tip.velocity - low.velocity)

    def present(self, phase: Phase, step: Step, macro_step: float, *, changed: bool = False) -> Present:
        """Return C and N at the end of ``step``, where the bodies are, in ``phase``.

        C of a soft law is the law's. Of ends that a rigid law joins it is what gives them one acceleration at their
        common velocity: no mismatch of their velocities is in it, which the forces of steps turn round.

        Parameters
        ----------
        macro_step
            H, for trial steps [s].
        changed
            Whether an event or a load has changed the motion since the step was made.
        """
        time, size, contact, _, _, _ = step
        tip, low = self.ends()
        if changed and self.loads.any:
            self.loads.act(time + size, macro_step)
        load = force.value(self.lower.load_on_end(), 0.0 if changed else size) if phase.seated else 0.0
        if self.law is not None:
            C = self.law.force(low.displacement - tip.displacement, low.velocity - tip.velocity)
        elif not phase.joined:
            C = 0.0
        elif self._massless:
            C = self.upper.holding_force(low.displacement, low.velocity)
        else:
            C = self._multiplier(phase, time + size, macro_step, force.value(contact, size), changed=changed)
        if not phase.seated:
            return Present(C)
        if changed:
            assert self.interface.floor is not None
            self.mark()  # from where a body may try which force holds it
            self._holding = self.lower.holding_force(self.interface.floor, 0.0)
        return Present(C, self._holding - load + C)

    def impulse_of(self, name: PushingForce, phase: Phase, step: Step) -> float:
        """Return the impulse of C or N over ``step`` [N·s] without what reverses a mismatch of velocities."""
        (_, v, _, _), (_, z, _, _) = step.start
        (_, v_after, _, _), (_, z_after, _, _) = step.end
        applied = step.size * force.mean(getattr(step, name), step.size)
        return applied - self.tied_mass(phase) * (v_after - z_after - v + z)

    def _multiplier(self, phase: Phase, time: float, macro_step: float, acting: float, *, changed: bool) -> float:
        """Return C = −μ (ü − ÿ) of joined ends [N], ü and ÿ without it; ``acting`` [N] where a body cannot tell.

        1/μ = 1/m_tip + 1/m; an end that moves as given has an infinite mass. Both accelerations are those at the common
        velocity: damping turns the rest of a velocity into a force.
        """
        apart = 0.0
        mobility = 0.0
        common = self._common_velocity(phase, self.ends())
        for body, sign in ((self.upper, 1.0), (self.lower, -1.0)):
            if phase.seated and body is self.lower:
                continue
            acceleration = None if changed else body.acceleration()
            if acceleration is None:
                if self.loads.any:
                    self.loads.act(time, macro_step)
                free = body.trial_acceleration(time, macro_step)
            else:
                free = acceleration - sign * acting / body.mass
            if free is None:
                if body not in self.without_acceleration:
                    self.without_acceleration.append(body)
                return acting
            excess = body.motion().velocity - common
            if excess != 0.0:
                free += self._decay(body, time, macro_step) * excess
            apart += sign * free
            mobility += 1.0 / body.mass
        return -apart / mobility if mobility > 0.0 else acting

    def _decay(self, body: Body, time: float, macro_step: float) -> float:
        """Return `Body.decay` of ``body``, asked once; 0 where that is not known."""
        if id(body) not in self._decays:
            speed = max(abs(end.velocity) for end in self.ends())
            decay = body.decay(time, macro_step, speed)
            if decay is None:
                self.without_acceleration.append(body)
            # An impulse that is gone within the step leaves no velocity to be taken out.
            self._decays[id(body)] = decay if decay is not None and decay * macro_step < _KEPT else 0.0
        return self._decays[id(body)]

    def _ties(self, phase: Phase) -> bool:
        """Return whether a rigid law, or the foundation, holds the ends together."""
        return phase.joined and self.law is None

    def tied_mass(self, phase: Phase) -> float:
        """Return `reduced_mass` of ends that are held together, whose mismatch a step reverses; else 0."""
        return self.reduced_mass(phase) if self._ties(phase) else 0.0

    def reduced_mass(self, phase: Phase) -> float:
        """Reduced mass of both ends [kg]; the tip's mass while the lower end is seated."""
        return self._reduced_mass[phase.seated]
