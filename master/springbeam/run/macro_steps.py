"""Where macro steps end: on the grid t₀ + k H, which events do not shift, or where their error asks for it.

Adaptive steps estimate their own error. Nothing is computed twice for it: the force of a step
is looked at beside that of both its ends, and the path of an end beside the cubic (``docs/coupling.md``, "Adaptive
macro steps").
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, inf, log2, sqrt

from ..bodies import force
from ..coupling.protocol import Step
from ..motion.curves import Curve
from .outcome import RunStopped
from .setup import SAME, SHORTEST_STEP, Setup
from .stepping import Pair, State

#: A remainder of the macro grid shorter than this fraction of H joins the next step.
_SHORT_REMAINDER = 0.25
#: The first step after an impact, as a fraction of H: ends that have just met often part or meet again within H.
_AFTER_IMPACT = 0.125
#: Sizes are the run's length times 2^(−k/4): few enough for the coupling to remember its response to each.
_PER_OCTAVE = 4
#: k/4 of the first step; below, of the longest and of the shortest.
_FIRST = 14
_LONGEST = 2
_SHORTEST = 40
#: Smallest and largest factor by which a step is changed at once.
_SHRINK = 0.125
_GROW = 2.0
#: A step aims below the tolerance by this factor.
_SAFETY = 0.9
#: Displacements are rounded to so many ulp.
_ROUNDING = 64.0 * 2.0**-52
#: Order of the cubic.
_CUBIC = 4
#: Largest values in (−1, 1) of ∬ P_(d+1) ds ds that vanishes at both ends.
_MOVED = (0.0642, 0.125, 0.0358)


class MacroGrid:
    """The grid t₀ + k H up to t_end [s]."""

    def __init__(self, start: float, end: float, macro_step: float) -> None:
        self._start = start
        self._end = end
        self.size = macro_step  #: H [s]

    def next(self, time: float, kink: float = inf, *, after_impact: bool = False) -> tuple[float, float]:
        """Return when the step from ``time`` should end, and its size [s] (exactly H where it is a whole one).

        It ends at ``kink`` [s], where a load jumps or bends, if that comes first or soon after. It is short
        ``after_impact``, if bodies have collided at ``time``.
        """
        H = self.size
        if after_impact:
            size = _AFTER_IMPACT * H
            if time + size < self._end:
                return (time + size, size) if kink >= time + size + _SHORT_REMAINDER * H else (kink, kink - time)
        k = int((time - self._start) / H + 1.0)
        while (target := self._start + k * H) - time < _SHORT_REMAINDER * H:
            k += 1
        size = target - time
        if target >= self._end - SHORTEST_STEP * H:
            target = self._end
            size = self._end - time
        if kink < target + _SHORT_REMAINDER * H:
            target = kink
            size = kink - time
        return target, H if abs(size - H) <= SAME * H else size


@dataclass
class Adapted:
    """The size of the next step, and how far the motion has come."""

    ranges: list[tuple[float, float]]  #: lowest and highest position of each end [m]
    energy: float = 0.0  #: the largest [J]
    number: int = _FIRST * _PER_OCTAVE  #: k of the size
    just_rejected: bool = False


class AdaptiveSteps:
    """Sizes that keep the error of each step at the tolerances of the run.

    The error of a step of size H goes as H^order, so the next one is 0.9 (tolerance/error)^(1/order) times as long,
    rounded down to the sizes there are. A step above the tolerance is rejected and repeated; the one after it does not
    grow. A step that an event has cut says nothing about the next.

    Parameters
    ----------
    setup, pair
        What is run.
    """

    state: Adapted

    def __init__(self, setup: Setup, pair: Pair) -> None:
        self._pair = pair
        self._end = setup.end
        self._length = setup.end - setup.start
        self._relative = setup.relative_tolerance
        self._absolute = setup.absolute_tolerance
        stiffness = pair.upper.stiffness(0.0)
        #: By how much 1 N at the tip bends the upper body [m/N]; 0 where that is not known.
        self._compliance = 1.0 / stiffness if stiffness is not None and stiffness > 0.0 else 0.0
        self.state = Adapted([(at.displacement, at.displacement) for at in pair.ends()])

    @property
    def size(self) -> float:
        """H [s] of a whole step from here."""
        return self._length * float(2.0 ** (-self.state.number / _PER_OCTAVE))

    def next(self, time: float, kink: float = inf, *, after_impact: bool = False) -> tuple[float, float]:
        """The time at which the step from ``time`` should end, and its size; ``kink`` as of `MacroGrid`.

        Error estimates limit the steps, also ``after_impact``.
        """
        size = self.size
        left = self._end - time
        if kink < time + (1.0 + _SHORT_REMAINDER) * size:
            return kink, kink - time
        return (self._end, left) if left <= (1.0 + _SHORT_REMAINDER) * size else (time + size, size)

    def note(self, energy: float) -> None:
        """Note that all energies together have been as large as this [J]."""
        self.state.energy = max(energy, self.state.energy)

    def accept(self, step: Step) -> None:
        """Note how far ``step``, which is made, has moved the ends."""
        self.state.ranges = self._ranges_with(step)

    def holds(self, state: State, step: Step, refused: str, *, to_kink: bool = False) -> bool:
        """Is the step as accurate as the scene asks? If not, the next one to try has the size that is then set.

        ``refused`` says why longer ones were, or nothing; ``to_kink``, whether it was to end on a kink of a load.
        Raises RunStopped if there is no shorter one.
        """
        error, order = self._estimate(state, step)
        own = self.state
        size = step.size
        factor = _SAFETY * error ** (-1.0 / order) if error > 0.0 else _GROW
        if error <= 1.0:
            # The size of whole steps follows from one that ended on a kink, unless it was much shorter.
            wanted = min(size * factor, self.size * (1.0 if own.just_rejected else _GROW))
            if not (to_kink and (wanted < self.size or size < _SHORT_REMAINDER * self.size)):
                own.number = self._rung_below(wanted)
            own.just_rejected = False
            return True
        own.just_rejected = True
        own.number = max(own.number + 1, self._rung_below(size * max(factor, _SHRINK)))
        if own.number > _SHORTEST * _PER_OCTAVE:
            short = f"the error stays above the tolerance, down to a macro step of {size:.3g} s, where it is"
            raise RunStopped(refused or f"{short} {error:.3g} of it", step.time)
        return False

    def _rung_below(self, size: float) -> int:
        return max(_LONGEST * _PER_OCTAVE, ceil(_PER_OCTAVE * log2(self._length / size) - SAME))

    def _estimate(self, state: State, step: Step) -> tuple[float, int]:
        """The step's error, 1 is the tolerance, and the order in which it falls with the size of the step.

        No step is too long for what is rounding, though from rest the motion so far is shorter still. The tip is the
        sum of modes, which may be larger than it: of what bends the beam with the energy so far. That is also the
        length of the motion of ends that have been held so far, and of one whose tolerance is less than rounding.
        """
        curve = 0.0
        spans = []
        bent = sqrt(2.0 * self._compliance * self.state.energy)
        least = [max(abs(low), abs(high), bent) for low, high in self.state.ranges]
        ends = zip(step.start, step.end, self._ranges_with(step), least, strict=True)
        for start, end, (low, high), size in ends:
            beside = Curve.quintic(start, end, step.size).moments_beside_cubic
            moved = high - low
            rounding = _ROUNDING * size
            if bent > moved and self._relative * moved <= rounding:
                moved = bent
            elif moved > rounding:
                spans.append(moved)
            if moved > 0.0:
                curve = max(curve, beside / (self._absolute + self._relative * moved + rounding))
        span = min(spans, default=bent)
        if span == 0.0:
            return 0.0, _CUBIC
        left_out, order = self._left_out(state, step)
        return max((curve, _CUBIC), (left_out / (self._relative * span + self._absolute), order))

    def _left_out(self, state: State, step: Step) -> tuple[float, int]:
        """Return how far the force that a step leaves out moves its ends against each other inside [m], and its order.

        C misses the force at both ends of the step by D. What turns a mismatch of velocities round is there alike, or
        opposite; the rest of D is a P_(d+1), d the degree of C, which moves free masses by a H²/4μ ∬ P_(d+1) ds ds, but
        a beam by no more than what bends it.
        """
        pair = self._pair
        degree = pair.joined.degree
        size = step.size
        if not state.phase.joined and not any(step.contact):
            return 0.0, degree + 3
        at_end = force.value(step.contact, size) - pair.present(state.phase, step, size).contact
        at_start = step.contact[0] - state.present.contact
        missed = 0.5 * abs(at_end - (-1.0) ** degree * at_start)
        mass = pair.reduced_mass(state.phase)
        gives = inf if mass == 0.0 else _MOVED[degree] * size * size / (4.0 * mass)
        bends = self._compliance if self._compliance > 0.0 else inf
        return missed * min(gives, bends), degree + 3

    def _ranges_with(self, step: Step) -> list[tuple[float, float]]:
        """Return the lowest and the highest position of each end [m], with ``step``."""
        ends = zip(self.state.ranges, step.start, step.end, strict=True)
        return [
            (min(low, a.displacement, b.displacement), max(high, a.displacement, b.displacement))
            for (low, high), a, b in ends
        ]
