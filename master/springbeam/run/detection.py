"""Which event comes first inside a step: the step is repeated until it ends on it.

Positions show meeting, release and the foundation (`springbeam.contact.events`). Ends part, and a seat is left,
where a force that can only push would pull: C or N at the end of a trial step (`Pair.present`).
"""

from __future__ import annotations

from math import isfinite

from ..bodies.protocol import Ends, Motion, StepRefused
from ..contact.events import (
    EventFunction,
    gap,
    locate,
    no_dip,
    position_tolerance,
)
from ..contact.phases import SOFT_TRANSITIONS, VELOCITY_ROUNDING, PushingForce
from ..coupling.protocol import Step
from ..motion.events import Event, EventKind, Joint
from ..motion.paths import Path, Place, Sample, sign_changes
from .macro_steps import AdaptiveSteps, MacroGrid
from .setup import SAME
from .stepping import Pair, Present, State

#: Trial steps to the bottom of a dip.
_MAX_DIP_TRIALS = 8
#: Position tolerances by which the motion at a located event may differ before it is none.
_JUMP = 1e5
#: How well the zero of a force is found, over the force at the ends of the step.
_SHARP = 1e-9


class Detector:
    """Finds the event that ends a step; the bodies are left where the returned step ends."""

    def __init__(self, pair: Pair, controller: MacroGrid | AdaptiveSteps) -> None:
        self._pair = pair
        self._controller = controller
        self._automaton = pair.automaton

    def tolerance(self, ends: Ends) -> float:
        """Resolution of positions [m]."""
        return position_tolerance(ends, self._controller.size)

    def simultaneity_tolerance(self, ends: Ends) -> float:
        """Position tolerance plus the distance covered in `SAME`·H [m]; events within it are simultaneous."""
        speed = max(abs(end.velocity) for end in ends)
        return self.tolerance(ends) + SAME * self._controller.size * speed

    def _rest(self, state: State, ends: Ends) -> float:
        """Speed below which ends do not move against each other [m/s].

        Velocities are sums of modes that have been as fast as the ends: the rounding of their sum, as of a tip that is
        released, is not 0.
        """
        tip, low = ends
        return max(1e-12 * max(abs(tip.velocity), abs(low.velocity)), VELOCITY_ROUNDING * state.fastest)

    def at_start(self, state: State, start: Ends) -> EventKind | None:
        """The event that is due before any step: its function is 0 and falling, or a force that can only push pulls."""
        phase = state.phase
        for (kind, _), (value, rate) in zip(
            self._automaton.guards(phase).functions, self._automaton.samples(phase, start), strict=True
        ):
            soon = self.tolerance(start) - SAME * self._controller.size * rate  # it would fall so far in no time
            if rate < 0.0 and value <= soon and rate < -self._rest(state, start):
                return kind
            if kind is EventKind.SEPARATION and value < -self.simultaneity_tolerance(start):
                return kind
        for kind, force in self._automaton.guards(phase).forces:
            if self._pulls(force, state, state.present, start):
                return kind
        return None

    def first_event(self, state: State, step: Step) -> tuple[Step, EventKind | None]:
        """The step, cut to its first event, and the kind of that; ``None`` if nothing happens in it."""
        step, found = self._first_by_position(state, step)
        if self._pair.opens_softly and step.size > 0.0:
            touched = self._touched_inside(state, step)
            if touched is not step:
                # The contact force changes where the ends go: what was found may not happen, something else may.
                step, found = self._first_by_position(state, touched)
        if step.size == 0.0:
            return step, found
        step = self._pair.repeated(state, step)
        cut = step
        kind = None
        for of_force, force in self._automaton.guards(state.phase).forces:
            if cut.size > 0.0 and (pulled := self._first_by_force(state, cut, force)) is not None:
                cut = pulled
                kind = of_force
        if kind is None:
            return self._pair.repeated(state, step), found
        if 0.0 < cut.size < step.size:
            # Under the force of the shorter step the ends move differently: they may strike something before.
            cut, found = self._first_by_position(state, cut)
            if found is not None:
                return cut if cut.size == 0.0 else self._pair.repeated(state, cut), found
        return self._pair.repeated(state, cut) if cut.size > 0.0 else cut, kind

    def _first_by_position(self, state: State, step: Step) -> tuple[Step, EventKind | None]:
        """The step, cut to the first event that positions show, and its kind; of size 0 if it is at the start."""
        found: EventKind | None = None
        functions = self._automaton.guards(state.phase).functions
        if not functions:
            return step, None
        for _ in range(2 * len(functions) + 1):
            candidates = []
            starts = self._automaton.samples(state.phase, step.start)
            ends = self._automaton.samples(state.phase, step.end)
            for (kind, function), start, end in zip(functions, starts, ends, strict=True):
                if no_dip(start, end, step.size, state.fastest):
                    continue
                f0, _ = start
                # A gap that a tie has left open, or a little below zero, is no event: only what falls further is.
                floor = min(f0, 0.0) - self.tolerance(step.end)
                bracket = self._bracket(state, function, step, floor, start, end)
                if bracket is None or (kind == found and bracket is step):
                    continue
                means = function.means(bracket.end, bracket.size)
                path = Path.through(start, function(bracket.end), bracket.size, means)
                candidates.append((path.falls_through_zero() * bracket.size, kind, function, bracket))
            if not candidates:
                break
            guess, found, function, bracket = min(candidates, key=lambda c: c[0])
            step = self._located(state, function, bracket, guess)
            if step.size < SAME * self._controller.size:
                # Too short for a contact force: velocities that differ would be turned round by an infinite one.
                return self._no_step(step), found
        return step, found

    def _no_step(self, step: Step) -> Step:
        """Return no step at all, the bodies back at the mark."""
        self._pair.rewind()
        return step._replace(size=0.0, end=step.start)

    # -- events by forces ------------------------------------------------------------------------------------------

    def _pulls(self, force: PushingForce, state: State, present: Present, ends: Ends) -> bool:
        """Return whether a force that can only push would pull by more than rounding."""
        pair = self._pair
        H = self._controller.size
        pull: float = -getattr(present, force)
        if pull <= 0.0 or state.met_again == state.time:
            return False
        mass = pair.lower.mass if force == "foundation" else pair.reduced_mass(state.phase)
        return pull * H > mass * VELOCITY_ROUNDING * state.fastest and pull * H * H > 2.0 * mass * self.tolerance(ends)

    def _first_by_force(self, state: State, step: Step, force: PushingForce) -> Step | None:
        """Return ``step``, cut to where a ``force`` that can only push vanishes; the bodies are at its end.

        ``None`` if it pushes all the time; of size 0 if it pulls from the start.
        """
        pair = self._pair
        H = self._controller.size
        start = max(getattr(state.present, force), 0.0)
        last = step

        def pushes(size: float) -> float:
            nonlocal last
            last = pair.attempt(state, size, step.start)
            return float(getattr(pair.present(state.phase, last, H), force))

        present = pair.present(state.phase, step, H)
        size = step.size
        end = getattr(present, force)
        mean = pair.mean_of(force, state.phase, step)
        bend = 3.0 * (start + end - 2.0 * mean)
        slope = end - start - bend  # of the parabola through both ends with the mean of the step
        if not self._pulls(force, state, present, step.end):
            if not (0.0 < -slope < 2.0 * bend and start < 0.25 * slope * slope / bend):
                return None
            size *= -0.5 * slope / bend
            if (end := pushes(size)) >= 0.0:
                return None
        scale = max(start, -end)
        falling = [s for s in sign_changes((start, slope, bend), 0.0, 1.0) if slope + 2.0 * bend * s < 0.0]
        guess = min([size, *(s * step.size for s in falling)])

        def evaluate(size: float) -> Sample:
            value = pushes(size)
            return value, -scale / size

        locate(evaluate, guess, size, _SHARP * scale, state.time)
        if last.size < SAME * H and start > _SHARP * scale:
            # The sign at the start decides. Short trial steps turn the mismatch of the ends' velocities round, which
            # strong damping turns into a force: the parabola through the whole step shows better when it vanishes.
            last = pair.attempt(state, guess, step.start)
        if last.size >= SAME * H:
            return last
        return None if state.met_again == state.time else self._no_step(last)

    # -- events by positions --------------------------------------------------------------------------------------

    def _bracket(
        self, state: State, function: EventFunction, step: Step, floor: float, start: Sample, end: Sample
    ) -> Step | None:
        """Return ``step`` if ``function`` ends below ``floor``, a shorter one if it dips below it before, or None."""
        whole_step = step if end[0] < floor else None
        if abs(start[1]) <= self._rest(state, step.start):
            # Ends that have just parted may close a little first, by the error of the time at which they were released.
            return whole_step
        stretches = [(Place(0.0, start, (0.0, 0.0)), Place(step.size, end, function.means(step.end, step.size)))]
        trials = 0
        while stretches and trials < _MAX_DIP_TRIALS:
            before, after = stretches.pop()  # the earliest
            path = before.path_to(after)
            inside = path.lowest_inside()
            # A path may be as wrong as the cubic is beside it.
            if inside is None or path.at(inside) >= floor + path.beside_cubic:
                continue
            trials += 1
            dip = self._pair.attempt(state, before.time + inside * path.size, step.start)
            bottom = Place(dip.size, function(dip.end), function.means(dip.end, dip.size))
            if bottom.sample[0] < floor:
                return dip
            # A dip at an end of a stretch to rounding leaves nothing between the two.
            stretches += [(a, b) for a, b in ((bottom, after), (before, bottom)) if b.time > a.time]
        return whole_step

    def _located(self, state: State, function: EventFunction, bracket: Step, guess: float) -> Step:
        """Return the step that ends where ``function`` is 0, near ``guess`` [s]. Raises StepRefused if none does."""
        last = bracket

        def evaluate(size: float) -> Sample:
            nonlocal last
            last = self._pair.attempt(state, size, bracket.start)
            return function(last.end)

        tolerance = 0.25 * self.tolerance(bracket.end)
        locate(evaluate, guess, bracket.size, tolerance, state.time)
        missed = abs(function(last.end)[0])
        # A tip at rest at 0 is there to the rounding of the modes that it is the sum of.
        rounding = max(self.tolerance(last.end), VELOCITY_ROUNDING * state.fastest * self._controller.size)
        if missed > _JUMP * rounding:
            raise StepRefused(f"an event is not found: the motion jumps by {missed:.3g} m with the size of the step")
        return last

    def _touched_inside(self, state: State, step: Step) -> Step:
        """Compliance: a contact that closes and opens inside the step would be missed; it is cut to its middle."""
        if any(step.contact) or not self._pair.divides:
            return step
        start = gap(step.start)
        end = gap(step.end)
        if start[0] < 0.0 or end[0] < 0.0 or no_dip(start, end, step.size, state.fastest):
            return step
        path = Path.through(start, end, step.size, gap.means(step.end, step.size))
        inside = path.lowest_inside()
        if inside is None or path.at(inside) >= path.beside_cubic:
            return step
        cut = self._pair.attempt(state, inside * step.size, step.start)
        return cut if any(cut.contact) else step

    def soft_changes(self, state: State, step: Step) -> list[Event]:
        """Return where contact by a soft law opens or closes in ``step``, also for a part of it.

        Nothing special happens there: the zeros are those of the path of the gap.
        """
        touching = state.phase.joint is Joint.TOUCH
        sign = -1.0 if touching else 1.0  # penetration or gap falls through zero
        start, end = ((sign * value, sign * rate) for value, rate in (gap(step.start), gap(step.end)))
        changed = (step.end[0].displacement < step.end[1].displacement) is not touching
        if not changed and no_dip(start, end, step.size, state.fastest):
            return []
        mean, twice = gap.means(step.end, step.size)
        path = Path.through(start, end, step.size, (sign * mean, sign * twice))
        if changed:
            places = [path.falls_through_zero()]
        else:
            inside = path.lowest_inside()
            if inside is None or path.at(inside) >= -self.tolerance(step.end):
                return []
            places = [path.falls_through_zero(inside), path.rises_through_zero(inside)]
        found = []
        joint = state.phase.joint
        for at in places:
            kind, joint = SOFT_TRANSITIONS[joint]
            (u, v), (y, z) = (_inside(*motions, step.size, at) for motions in zip(step.start, step.end, strict=True))
            if all(map(isfinite, (u, v, y, z))):  # else the energies of the row are out of range too and stop the run
                time = step.time + at * step.size
                found.append(Event(time, kind, y, z, u, v, joint=joint, seated=state.phase.seated))
        return found


def _inside(start: Motion, end: Motion, size: float, s: float) -> Sample:
    """Return displacement [m] and velocity [m/s] at the share ``s`` of a step."""
    path = Path.through(start[:2], end[:2], size, (end.integral / size, end.integral_2 / (size * size)))
    return path.at(s), path.slope(s) / size
