"""Events told by forces: a force that can only push is about to pull, so that ends part or a seat is left.

The step is cut to where the force vanishes. A force of degree 1 or 2 tells by its own polynomial; the constant of
degree 0 belongs to the middle of its step, so that the line through the last two middles tells. What the scheme adds
to turn a mismatch of the ends' velocities round is left out in both.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from ..bodies import force
from ..bodies.protocol import Force
from ..contact.events import EventFunction, Height, gap, locate
from ..contact.phases import Joint, Phase
from ..coupling.protocol import Step
from ..results.paths import Sample, sign_changes
from ..results.trajectory import EventKind
from .stepping import Pair, State

#: Of the macro step: the shortest trial step to find where the contact force vanishes, and how well it is found.
_SHORTEST_LOOK, _SHARP = 0.25, 1e-9
#: Share of a step after which ends that are let go, and meet again before its end, are looked at.
_EARLY = 0.1


class Push(NamedTuple):
    """A force that can only push, and the event that ends its phase."""

    event: EventKind
    force: Callable[[Step], Force]


class Separation:
    """Finds where the force of a unilateral phase vanishes; the bodies are left where the returned step ends.

    ``no_time`` is the fraction of H below which an event happens at the start of its step.
    """

    def __init__(self, pair: Pair, no_time: float) -> None:
        self._pair, self._no_time = pair, no_time

    def first_event(self, state: State, step: Step, macro_step: float) -> tuple[Step, EventKind] | None:
        """Return ``step`` cut to the event, of size 0 if it is at the start, and its kind; ``None`` if none is due."""
        push = self._pushing(state.phase)
        if push is None:
            return None
        coupling, f = self._pair.coupling(state.phase), self._without_mismatch(state, step, push)
        by_line = coupling.degree == 0 and (state.phase.joint is not Joint.FREE or f[1:] == (0.0, 0.0))
        if by_line:
            middle = state.time + 0.5 * step.size, force.mean(f, step.size)
            f, state.pushed = _line(state.pushed, middle, state.time), middle
        if f[0] < 0.0:
            # The sign at the start may be a false alarm: it is one if the ends, let go, close.
            if not (state.reclosed and state.steps_in_phase == 0) and self._opens(state, step, push.event):
                return self.no_step(step), push.event
            step = self._pair.repeated(state, step)
        falling = [tau for tau in sign_changes((f[0], f[1], 0.5 * f[2]), 0.0, step.size) if f[1] + tau * f[2] < 0.0]
        if not falling:
            return None
        zero = falling[0]
        if not by_line:
            zero = self._sharpened(zero, abs(f[1] + zero * f[2]), state, step, push, macro_step)
        return self._pair.attempt(state, zero, step.start), push.event

    def no_step(self, step: Step) -> Step:
        """Return no step at all, the bodies back at the mark."""
        self._pair.rewind()
        return step._replace(size=0.0, end=step.start)

    def _pushing(self, phase: Phase) -> Push | None:
        if phase.seated:
            return Push(
                EventKind.SEPARATION if self._pair.spring is None else EventKind.UNSEATED, lambda step: step.foundation
            )
        if phase.joint is Joint.TOUCH and self._pair.law is None and not self._pair.upper.massless:
            return Push(EventKind.SEPARATION, lambda step: step.contact)
        return None

    def _sharpened(self, zero: float, slope: float, state: State, step: Step, push: Push, macro_step: float) -> float:
        """Return where the force of a step vanishes, near ``zero`` [s], where it falls by ``slope`` [N/s].

        Trial steps bring the zero to where in a step the force is the most accurate.
        """
        best = self._pair.coupling(state.phase).sharpest
        room = self._pair.loads.next_kink(state.time + self._no_time * macro_step, macro_step) - state.time

        def evaluate(zero: float) -> Sample:
            size = min(max(zero / best, _SHORTEST_LOOK * macro_step), room)
            f = self._without_mismatch(state, self._pair.attempt(state, size, step.start), push)
            return force.value(f, zero), f[1] + zero * f[2]

        return locate(evaluate, zero, step.size, _SHARP * macro_step * slope, state.time)

    def _without_mismatch(self, state: State, step: Step, push: Push) -> Force:
        """The force that pushes, without what the scheme adds to the contact's."""
        contact = self._pair.force_without_mismatch(state.phase, step)
        f = push.force(step)
        return (
            f[0] + contact[0] - step.contact[0],
            f[1] + contact[1] - step.contact[1],
            f[2] + contact[2] - step.contact[2],
        )

    def _opens(self, state: State, step: Step, event: EventKind) -> bool:
        """Do the ends part if they are let go for the step, or early in it, to meet again before its end?

        (`EventKind.UNSEATED`: does the lower end leave the foundation?)
        """
        phase, pair = state.phase, self._pair
        if event is EventKind.UNSEATED:
            assert pair.stop is not None
            height: EventFunction = Height(1, pair.stop, share=0.0)
            let_go = Phase(phase.joint)
        else:
            height, let_go = gap, Phase(Joint.FREE, phase.seated and pair.spring is not None)
        if height(pair.attempt(state, step.size, step.start, let_go).end)[0] > 0.0:
            return True
        drift = abs(height(step.start)[1])  # what the scheme leaves open of the ends' velocities, no parting
        early = _EARLY * step.size
        return height(pair.attempt(state, early, step.start, let_go).end)[0] > drift * early


def _line(before: tuple[float, float] | None, middle: tuple[float, float], start: float) -> Force:
    """Return the line through two (time [s], force [N]) as a force from ``start`` on; constant unless it falls."""
    time, value = middle
    slope = 0.0 if before is None else min((value - before[1]) / (time - before[0]), 0.0)
    return (value - slope * (time - start), slope, 0.0)
