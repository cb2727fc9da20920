"""Events told by forces: a force that can only push is about to pull, so that ends part or a seat is left.

The step is cut to where the force vanishes. A force of degree 1 or 2 tells by its own polynomial; the constant of
degree 0 belongs to the middle of its step, so that the line through the last two middles tells. What the scheme adds
to turn a mismatch of the ends' velocities round is left out in both.
"""

from __future__ import annotations

from math import inf

from ..bodies import force
from ..bodies.protocol import Force
from ..contact.events import EventFunction, Height, gap, locate
from ..contact.phases import Joint, Phase
from ..coupling.protocol import Step
from ..results.paths import Sample, sign_changes
from ..results.trajectory import EventKind
from ..scene import SAME
from .stepping import Pair, State

#: Of the macro step: the shortest trial step to find where the contact force vanishes, and how well it is found.
_SHORTEST_LOOK, _SHARP = 0.25, 1e-9
#: Share of a step after which ends that are let go, and meet again before its end, are looked at.
_EARLY = 0.1


def first_by_force(pair: Pair, state: State, step: Step, macro_step: float) -> tuple[Step, EventKind] | None:
    """Return ``step`` cut to the event that a force tells of, and its kind; ``None`` if none is due.

    It is of size 0 if the event is at its start; the bodies are left at its end.
    """
    event = _ending(pair, state.phase)
    if event is None:
        return None
    coupling, f = pair.coupling(state.phase), _push(pair, state.phase, step)
    by_line = coupling.degree == 0 and (state.phase.joint is not Joint.FREE or f[1:] == (0.0, 0.0))
    if by_line:
        middle = state.time + 0.5 * step.size, force.mean(f, step.size)
        f, state.pushed = _line(state.pushed, middle, state.time), middle
    if f[0] < 0.0:
        # The sign at the start may be a false alarm: it is one if the ends, let go, close.
        if not (state.reclosed and state.steps_in_phase == 0) and _opens(pair, state, step, event):
            return no_step(pair, step), event
        step = pair.repeated(state, step)
    falling = [tau for tau in sign_changes((f[0], f[1], 0.5 * f[2]), 0.0, step.size) if f[1] + tau * f[2] < 0.0]
    if not falling:
        return None
    zero = falling[0]
    if not by_line:
        zero = _sharpened(pair, zero, abs(f[1] + zero * f[2]), state, step, macro_step)
    return pair.attempt(state, zero, step.start), event


def no_step(pair: Pair, step: Step) -> Step:
    """Return no step at all, the bodies back at the mark."""
    pair.rewind()
    return step._replace(size=0.0, end=step.start)


def _ending(pair: Pair, phase: Phase) -> EventKind | None:
    """Return the event that ends ``phase`` where a force that can only push would pull; ``None`` if all may."""
    if phase.seated and not pair.alone:
        return EventKind.UNSEATED
    touches = phase.joint is Joint.TOUCH and pair.law is None and not pair.upper.massless
    return EventKind.SEPARATION if phase.seated or touches else None


def _push(pair: Pair, phase: Phase, step: Step) -> Force:
    """Return the force that can only push, without what the scheme adds to the contact's."""
    contact = pair.force_without_mismatch(phase, step)
    if not phase.seated:
        return contact
    return force.combined((1.0, 1.0, -1.0), (step.foundation, contact, step.contact))


def _sharpened(pair: Pair, zero: float, slope: float, state: State, step: Step, macro_step: float) -> float:
    """Return where the force of a step vanishes, near ``zero`` [s], where it falls by ``slope`` [N/s].

    Trial steps bring the zero to where in a step the force is the most accurate.
    """
    best = pair.coupling(state.phase).sharpest
    room = pair.loads.next_kink(state.time + SAME * macro_step, macro_step) - state.time

    tolerance, left = _SHARP * macro_step * slope, inf

    def evaluate(zero: float) -> Sample:
        nonlocal left
        size = min(max(zero / best, _SHORTEST_LOOK * macro_step), room)
        f = _push(pair, state.phase, pair.attempt(state, size, step.start))
        left = force.value(f, zero)
        return left, f[1] + zero * f[2]

    found = locate(evaluate, zero, step.size, tolerance, state.time)
    # The force of a longer trial step may vanish nowhere in this one, which then tells best.
    return found if abs(left) <= tolerance else zero


def _opens(pair: Pair, state: State, step: Step, event: EventKind) -> bool:
    """Do the ends part if they are let go for the step, or early in it, to meet again before its end?

    (`EventKind.UNSEATED`: does the lower end leave the foundation?)
    """
    phase = state.phase
    if event is EventKind.UNSEATED:
        assert pair.stop is not None
        height: EventFunction = Height(1, pair.stop, share=0.0)
        let_go = Phase(phase.joint)
    else:
        height, let_go = gap, Phase(Joint.FREE, phase.seated and not pair.alone)
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
