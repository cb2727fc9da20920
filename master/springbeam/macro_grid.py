"""Where macro steps end: the grid t₀ + k H, which events do not shift."""

from __future__ import annotations

from .memory import Memory

#: A remainder of the macro grid shorter than this fraction of H joins the next step.
_SHORT_REMAINDER = 0.25
#: Times closer than this fraction of H are one.
_SAME = 1e-9


class MacroGrid(Memory):
    """The grid t₀ + k H up to t_end [s]."""

    REMEMBERED = ("_index",)

    def __init__(self, start: float, end: float, macro_step: float) -> None:
        self._start, self._end, self._H = start, end, macro_step
        self._index = 0

    def next(self, time: float) -> tuple[float, float]:
        """The time at which the step from ``time`` should end, and its size (exactly H where it is a whole one)."""
        H = self._H
        target = self._start + (self._index + 1) * H
        size = target - time
        on_grid = abs(size - H) <= _SAME * H
        if size < _SHORT_REMAINDER * H:
            self._index += 1
            target, size, on_grid = target + H, size + H, False
        if target >= self._end - _SAME * H:
            target, size = self._end, self._end - time
            on_grid = abs(size - H) <= _SAME * H
        return target, H if on_grid else size

    def reached(self, time: float) -> None:
        """Grid points up to ``time`` are behind."""
        while self._start + (self._index + 1) * self._H <= time + _SAME * self._H:
            self._index += 1
