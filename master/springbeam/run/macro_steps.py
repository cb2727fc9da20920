"""Where macro steps end: on the grid t₀ + k H, which events do not shift, or where an error estimate allows."""

from __future__ import annotations

from math import ceil, inf, log2

from ..bodies.stateful import Memory, Stateful
from ..scene.scene import SHORTEST_STEP

#: A remainder of the macro grid shorter than this fraction of H joins the next step.
_SHORT_REMAINDER = 0.25
#: The first step after an impact, as a fraction of H: ends that have just met often part or meet again within H.
_AFTER_IMPACT = 0.125
#: Times closer than this fraction of H are one.
_SAME = 1e-9

#: Adaptive sizes are the run's length times 2^(−k/4): few enough for the coupling to remember its response to each.
_PER_OCTAVE = 4
#: k/4 of the first step, of the longest and of the shortest.
_FIRST, _LONGEST, _SHORTEST = 14, 2, 40
#: A step is changed by at most these factors at once, and aims below the tolerance by the safety factor.
_SHRINK, _GROW, _SAFETY = 0.125, 2.0, 0.9


class MacroGrid(Stateful):
    """The grid t₀ + k H up to t_end [s]."""

    state: float = -inf  #: when the last impact was [s]

    def __init__(self, start: float, end: float, macro_step: float) -> None:
        self._start, self._end = start, end
        self.size = macro_step  #: H [s]

    def next(self, time: float, kink: float = inf) -> tuple[float, float]:
        """Return when the step from ``time`` should end, and its size [s] (exactly H where it is a whole one).

        It ends at ``kink`` [s], where a load jumps or bends, if that comes first or soon after. It is short after an
        impact.
        """
        H = self.size
        if time == self.state:
            size = _AFTER_IMPACT * H
            if time + size < self._end:
                return (time + size, size) if kink >= time + size + _SHORT_REMAINDER * H else (kink, kink - time)
        k = int((time - self._start) / H + 1.0)
        while (target := self._start + k * H) - time < _SHORT_REMAINDER * H:
            k += 1
        size = target - time
        if target >= self._end - SHORTEST_STEP * H:
            target, size = self._end, self._end - time
        if kink < target + _SHORT_REMAINDER * H:
            target, size = kink, kink - time
        return target, H if abs(size - H) <= _SAME * H else size

    def struck(self, time: float) -> None:
        """Note that the last event was an impact at ``time`` [s], or none if that is −∞.

        It has changed velocities, and ends that have met may part again soon.
        """
        self.state = time


class Rung(Memory):
    """Where sizes that follow an error are."""

    number: int = _FIRST * _PER_OCTAVE  #: k of the size
    just_rejected: bool = False
    rejections: int = 0


class AdaptiveSteps(Stateful):
    """Sizes that keep the error of each step at its tolerance.

    The error of a step of size H goes as H^order, so the next one is 0.9 (tolerance/error)^(1/order) times as long,
    rounded down to the sizes there are. A step above the tolerance is rejected and repeated; the one after it does not
    grow. A step that an event has cut says nothing about the next.

    Parameters
    ----------
    start, end
        The run [s].
    """

    state: Rung

    def __init__(self, start: float, end: float) -> None:
        self._end, self._length = end, end - start
        self.state = Rung()

    @property
    def size(self) -> float:
        """H [s] of a whole step from here."""
        return self._length * float(2.0 ** (-self.state.number / _PER_OCTAVE))

    def next(self, time: float, kink: float = inf) -> tuple[float, float]:
        """The time at which the step from ``time`` should end, and its size; ``kink`` as of `MacroGrid`."""
        size, left = self.size, self._end - time
        if kink < time + (1.0 + _SHORT_REMAINDER) * size:
            return kink, kink - time
        return (self._end, left) if left <= (1.0 + _SHORT_REMAINDER) * size else (time + size, size)

    def struck(self, time: float) -> None:
        """Do nothing: error estimates tell how long steps may be."""

    def judge(self, size: float, error: float, order: int, *, to_kink: bool = False) -> bool:
        """Whether a step of ``size`` [s] with ``error`` (1 is the tolerance) holds; `size` is then that of the next.

        ``to_kink`` says whether it was to end on a kink.
        """
        state, factor = self.state, _SAFETY * error ** (-1.0 / order) if error > 0.0 else _GROW
        if error <= 1.0:
            # A step that ended on a kink tells of whole ones by the order, unless it was much shorter.
            wanted = min(size * factor, self.size * (1.0 if state.just_rejected else _GROW))
            if not (to_kink and (wanted < self.size or size < _SHORT_REMAINDER * self.size)):
                state.number = self._rung_below(wanted)
            state.just_rejected = False
            return True
        state.rejections += 1
        state.just_rejected = True
        state.number = max(state.number + 1, self._rung_below(size * max(factor, _SHRINK)))
        return False

    @property
    def too_short(self) -> bool:
        """Whether no step is short enough."""
        return self.state.number > _SHORTEST * _PER_OCTAVE

    def _rung_below(self, size: float) -> int:
        return max(_LONGEST * _PER_OCTAVE, ceil(_PER_OCTAVE * log2(self._length / size) - _SAME))
