"""Timings that are compared: both sides in turn, in one process or one run, so that what slows one slows the other."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter


@dataclass(frozen=True)
class Times:
    """Seconds of each round, ours and the rival's (or the limit's)."""

    ours: list[float]
    rival: list[float]

    @property
    def ratios(self) -> list[float]:
        """Ours over the rival's, round by round."""
        return [a / b for a, b in zip(self.ours, self.rival, strict=True)]


def timed(work: Callable[[], object]) -> float:
    """Seconds that ``work`` takes."""
    began = perf_counter()
    work()
    return perf_counter() - began


def compare(ours: Callable[[], float], rival: Callable[[], float], rounds: int) -> Times:
    """Both ``rounds`` times in turn, after one that does not count; they return the seconds they took."""
    ours()
    rival()
    pairs = [(ours(), rival()) for _ in range(rounds)]
    return Times([a for a, _ in pairs], [b for _, b in pairs])


def median_and_spread(values: Sequence[float], digits: int = 3) -> str:
    """``median (smallest – largest)``."""
    if len(values) == 1:
        return f"{values[0]:.{digits}g}"
    return f"{statistics.median(values):.{digits}g} ({min(values):.{digits}g} – {max(values):.{digits}g})"
