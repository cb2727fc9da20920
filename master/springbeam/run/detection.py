"""Which event comes first inside a step: the step is repeated until it ends on it.

A guard is positive until its event: a curve over the step, its floor and how sharply its zero is found. `Position` is
a function of where the ends are (`springbeam.contact.events`); `Push` is a force, C or N, that can only push: ends
part, and a seat is left, where it would pull.
"""

from __future__ import annotations

from math import inf, isfinite

from ..bodies.protocol import Ends, StepRefused
from ..contact.events import EventFunction, gap, locate, no_dip, position_tolerance
from ..contact.phases import SOFT_TRANSITIONS, VELOCITY_ROUNDING, Phase, PushingForce
from ..coupling.protocol import Step
from ..motion.curves import Curve, Sample, since
from ..motion.events import Event, EventKind, Joint
from .macro_steps import AdaptiveSteps, MacroGrid
from .setup import SAME
from .stepping import Pair, State

#: Position tolerances by which the motion at a located event may differ before it is none.
_JUMP = 1e5
#: How well the zero of a force is found, over the force at the ends of the step.
_SHARP = 1e-9


class Position:
    """A guard that is a function of the positions of both ends."""

    curve = Curve.quintic
    stays = staticmethod(no_dip)
    trials = 8  #: steps to the bottom of a dip, at most

    def __init__(self, kind: EventKind, function: EventFunction, detector: Detector) -> None:
        self.kind = kind
        self._function = function
        self._detector = detector

    def due(self, state: State, start: Ends) -> bool:
        """Return whether the event is due before any step: f is 0, or will be in no time, and falls."""
        value, rate, _, _ = self._function(start, 0.0)
        soon = self._detector.tolerance(start) - SAME * self._detector.H * rate
        return value <= soon and rate < -self._detector.rest(state, start)

    def start(self, state: State, step: Step) -> Sample:
        return self._function(step.start, 0.0)

    def end(self, state: State, step: Step) -> Sample:
        return self._function(step.end, step.size)

    def floor(self, state: State, ends: Ends, start: Sample) -> float:
        """Return below which value there is an event.

        A gap that a tie has left open, or a little below zero, is none: only what falls further is.
        """
        return min(start[0], 0.0) - self._detector.tolerance(ends)

    def sharpness(self, step: Step, start: Sample, end: Sample) -> float:
        """Return how well the zero is found."""
        return 0.25 * self._detector.tolerance(step.end)

    def check(self, state: State, step: Step) -> None:
        """Raise StepRefused if ``step``, which was found to end on the event, does not."""
        detector = self._detector
        missed = abs(self._function(step.end, step.size)[0])
        # A tip at rest at 0 is there to the rounding of the modes that it is the sum of.
        rounding = max(detector.tolerance(step.end), VELOCITY_ROUNDING * state.fastest * detector.H)
        if missed > _JUMP * rounding:
            raise StepRefused(f"an event is not found: the motion jumps by {missed:.3g} m with the size of the step")


class Push:
    """A guard that is a force which can only push."""

    curve = Curve.parabola
    trials = 1  #: in shorter steps the mean of the force tells little of it

    def __init__(self, kind: EventKind, force: PushingForce, detector: Detector) -> None:
        self.kind = kind
        self._force = force
        self._detector = detector
        self._pair = detector.pair
        #: Of a massless tip, whose contact force is a function of where it is [N/m].
        self._stiffness: float | None = None
        if force == "contact" and self._pair.upper.massless:
            self._stiffness = self._pair.upper.stiffness(0.0)

    def due(self, state: State, start: Ends) -> bool:
        pushes: float = getattr(state.present, self._force)
        return pushes < self.floor(state, start, self.start(state))

    def start(self, state: State, step: Step | None = None) -> Sample:
        return max(getattr(state.present, self._force), 0.0), -inf, 0.0, 0.0

    def end(self, state: State, step: Step) -> Sample:
        step = self._pair.repeated(state, step)
        value = getattr(self._pair.present(state.phase, step, self._detector.H), self._force)
        scale = max(abs(value), getattr(state.present, self._force))
        return value, -scale / step.size, self._pair.impulse_of(self._force, state.phase, step), 0.0

    def stays(self, start: Sample, end: Sample, size: float, fastest: float) -> bool:
        """Return whether the guard stays positive over a step: the Bézier points of the parabola enclose it."""
        return min(start[0], end[0], 3.0 * end[2] / size - start[0] - end[0]) >= 0.0

    def floor(self, state: State, ends: Ends, start: Sample) -> float:
        """See `Position.floor`; what rounding of velocities and positions makes of the force."""
        if state.met_again == state.time:
            return -inf
        pair = self._pair
        H = self._detector.H
        if self._stiffness is not None:
            return -self._stiffness * self._detector.tolerance(ends)
        mass = pair.lower.mass if self._force == "foundation" else pair.reduced_mass(state.phase)
        return -mass * max(VELOCITY_ROUNDING * state.fastest / H, 2.0 * self._detector.tolerance(ends) / (H * H))

    def sharpness(self, step: Step, start: Sample, end: Sample) -> float:
        if self._stiffness is not None:
            return 0.25 * self._stiffness * self._detector.tolerance(step.end)
        return _SHARP * max(start[0], -end[0])

    def check(self, state: State, step: Step) -> None:
        pass


class Detector:
    """Finds the event that ends a step; the bodies are left where the returned step ends."""

    def __init__(self, pair: Pair, controller: MacroGrid | AdaptiveSteps) -> None:
        self.pair = pair
        self._controller = controller
        self._phase: Phase | None = None
        self._guards: list[Position | Push] = []

    @property
    def H(self) -> float:
        """Size of a whole step [s]."""
        return self._controller.size

    def tolerance(self, ends: Ends) -> float:
        """Resolution of positions [m]."""
        return position_tolerance(ends, self.H)

    def simultaneity_tolerance(self, ends: Ends) -> float:
        """Position tolerance plus the distance covered in `SAME`·H [m]; events within it are simultaneous."""
        speed = max(abs(end.velocity) for end in ends)
        return self.tolerance(ends) + SAME * self.H * speed

    def rest(self, state: State, ends: Ends) -> float:
        """Speed below which ends do not move against each other [m/s].

        Velocities are sums of modes that have been as fast as the ends: the rounding of their sum, as of a tip that is
        released, is not 0.
        """
        tip, low = ends
        return max(1e-12 * max(abs(tip.velocity), abs(low.velocity)), VELOCITY_ROUNDING * state.fastest)

    def guards(self, phase: Phase) -> list[Position | Push]:
        """Return the guards of ``phase``; forces last, which a step that positions have cut may not see."""
        if phase is not self._phase:
            self._phase = phase
            given = self.pair.automaton.guards(phase)
            self._guards = [Position(kind, guard, self) for kind, guard in given if not isinstance(guard, str)]
            self._guards += [Push(kind, guard, self) for kind, guard in given if isinstance(guard, str)]
        return self._guards

    def at_start(self, state: State, start: Ends) -> EventKind | None:
        """The event that is due before any step."""
        for guard in self.guards(state.phase):
            if guard.due(state, start):
                return guard.kind
        return None

    def first_event(self, state: State, step: Step) -> tuple[Step, EventKind | None]:
        """The step, cut to its first event, and the kind of that; ``None`` if nothing happens in it.

        Under the force of a shorter step the ends move differently, so all guards are evaluated again after a cut.
        """
        kind: EventKind | None = None
        guards = self.guards(state.phase)
        for _ in range(2 * len(guards) + 1):
            for guard in guards:
                bracket = self._bracket(state, guard, step)
                if bracket is not None and not (guard.kind is kind and bracket is step):
                    break
            else:
                if not self.pair.opens_softly or (touched := self._touched_inside(state, step)) is step:
                    break
                step = touched
                kind = None
                continue
            kind = guard.kind
            step = self._located(state, guard, bracket)
            if step.size < SAME * self.H:
                # Too short for a contact force: velocities that differ would be turned round by an infinite one.
                self.pair.rewind()
                return step._replace(size=0.0, end=step.start), kind
        return self.pair.repeated(state, step), kind

    def _bracket(self, state: State, guard: Position | Push, step: Step) -> Step | None:
        """Return ``step`` if ``guard`` ends below its floor, a shorter one if it dips below it before, or None."""
        start = guard.start(state, step)
        end = guard.end(state, step)
        if guard.stays(start, end, step.size, state.fastest):
            return None
        floor = guard.floor(state, step.end, start)
        whole_step = step if end[0] < floor else None
        if abs(start[1]) <= self.rest(state, step.start):
            # Ends that have just parted may close a little first, by the error of the time at which they were released.
            return whole_step
        trials = guard.trials - (whole_step is not None)
        stretches = [((0.0, (*start[:2], 0.0, 0.0)), (step.size, end))]
        while stretches and trials:
            (begin, before), (until, after) = stretches.pop()  # the earliest
            size = until - begin
            curve = guard.curve(before, since(before, after, size), size)
            lowest = curve.lowest_inside()
            # A curve may be as wrong as the cubic is beside it.
            if lowest is None or curve.at(lowest) >= floor + curve.beside_cubic:
                continue
            trials -= 1
            dip = self.pair.attempt(state, begin + lowest * size, step.start)
            bottom = (dip.size, guard.end(state, dip))
            if bottom[1][0] < floor:
                return dip
            # A dip at an end of a stretch to rounding leaves nothing between the two.
            stretches += [(a, b) for a, b in ((bottom, (until, after)), ((begin, before), bottom)) if b[0] > a[0]]
        return whole_step

    def _located(self, state: State, guard: Position | Push, bracket: Step) -> Step:
        """Return the step that ends where ``guard`` is 0. Raises StepRefused if none does."""
        last = bracket
        start = guard.start(state, bracket)
        end = guard.end(state, bracket)
        sharpness = guard.sharpness(bracket, start, end)
        guess = guard.curve(start, end, bracket.size).falls_through_zero() * bracket.size

        def evaluate(size: float) -> Sample:
            nonlocal last
            last = self.pair.attempt(state, size, bracket.start)
            return guard.end(state, last)

        locate(evaluate, guess, bracket.size, sharpness, state.time)
        if last.size < SAME * self.H and start[0] > sharpness:
            # The sign at the start decides. Short trial steps turn the mismatch of the ends' velocities round, which
            # strong damping turns into a force: the curve over the whole step shows better when it vanishes.
            last = self.pair.attempt(state, guess, bracket.start)
        guard.check(state, last)
        return last

    # -- contact by a soft law ----------------------------------------------------------------------------------------

    def _touched_inside(self, state: State, step: Step) -> Step:
        """Compliance: a contact that closes and opens inside the step would be missed; it is cut to its middle."""
        if any(step.contact) or not self.pair.divides:
            return step
        start = gap(step.start, 0.0)
        end = gap(step.end, step.size)
        if start[0] < 0.0 or end[0] < 0.0 or no_dip(start, end, step.size, state.fastest):
            return step
        curve = Curve.quintic(start, end, step.size)
        lowest = curve.lowest_inside()
        if lowest is None or curve.at(lowest) >= curve.beside_cubic:
            return step
        cut = self.pair.attempt(state, lowest * step.size, step.start)
        return cut if any(cut.contact) else step

    def soft_changes(self, state: State, step: Step) -> list[Event]:
        """Return where contact by a soft law opens or closes in ``step``, also for a part of it.

        Nothing special happens there: the zeros are those of the curve of the gap.
        """
        joint = state.phase.joint
        touching = joint is Joint.TOUCH
        start = gap(step.start, 0.0)
        end = gap(step.end, step.size)
        changed = (end[0] < 0.0) is not touching
        if not changed and no_dip(start, end, step.size, state.fastest):
            return []
        curve = Curve.quintic(start, end, step.size)
        curve = -curve if touching else curve  # penetration or gap falls through zero
        if changed:
            places = [curve.falls_through_zero()]
        else:
            lowest = curve.lowest_inside()
            if lowest is None or curve.at(lowest) >= -self.tolerance(step.end):
                return []
            places = [curve.falls_through_zero(lowest), curve.rises_through_zero(lowest)]
        tip, low = (Curve.quintic(a, b, step.size) for a, b in zip(step.start, step.end, strict=True))
        changes = []
        for at in places:
            kind, joint = SOFT_TRANSITIONS[joint]
            ends = low.at(at), low.rate.at(at), tip.at(at), tip.rate.at(at)
            if all(map(isfinite, ends)):  # else the energies of the row are out of range too and stop the run
                time = step.time + at * step.size
                changes.append(Event(time, kind, *ends, joint=joint, seated=state.phase.seated))
        return changes
