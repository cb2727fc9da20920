"""Where macro steps end: on the grid t₀ + k H, which events do not shift."""

from __future__ import annotations

from math import inf

from ..bodies.protocol import Stateful
from ..scene.scene import SAME, SHORTEST_STEP

#: A remainder of the macro grid shorter than this fraction of H joins the next step.
SHORT_REMAINDER = 0.25
#: The first step after an impact, as a fraction of H: ends that have just met often part or meet again within H.
_AFTER_IMPACT = 0.125


class MacroGrid(Stateful):
    """The grid t₀ + k H up to t_end [s]."""

    def __init__(self, start: float, end: float, macro_step: float) -> None:
        self._start, self._end = start, end
        self.size = macro_step  #: H [s]

    def next(self, time: float, kink: float = inf, *, struck: bool = False) -> tuple[float, float]:
        """Return when the step from ``time`` should end, and its size [s] (exactly H where it is a whole one).

        It ends at ``kink`` [s], where a load jumps or bends, if that comes first or soon after. It is short if ends
        have ``struck`` each other at ``time``.
        """
        H = self.size
        if struck:
            size = _AFTER_IMPACT * H
            if time + size < self._end:
                return (time + size, size) if kink >= time + size + SHORT_REMAINDER * H else (kink, kink - time)
        k = int((time - self._start) / H + 1.0)
        while (target := self._start + k * H) - time < SHORT_REMAINDER * H:
            k += 1
        size = target - time
        if target >= self._end - SHORTEST_STEP * H:
            target, size = self._end, self._end - time
        if kink < target + SHORT_REMAINDER * H:
            target, size = kink, kink - time
        return target, H if abs(size - H) <= SAME * H else size
