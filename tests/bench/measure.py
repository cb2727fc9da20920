"""Timings that are compared: both sides in turn, in one process or one run, so that what slows one slows the other.

All but sweeps on several processors are in processor time, of which what else runs on the machine takes none.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import process_time

from springbeam.monolithic import algorithm1, event_driven
from springbeam.run import runner
from springbeam.studies import rivals


class _Clock:
    perf_counter = staticmethod(process_time)


# What runs report as their wall time.
runner.perf_counter = rivals.perf_counter = process_time  # type: ignore[attr-defined]
algorithm1.clock = event_driven.clock = _Clock  # type: ignore[assignment,attr-defined]


@dataclass(frozen=True)
class Times:
    """Seconds of each round, ours and the rival's (or the limit's)."""

    ours: list[float]
    rival: list[float]

    @property
    def ratios(self) -> list[float]:
        """Ours over the rival's, round by round."""
        return [a / b for a, b in zip(self.ours, self.rival, strict=True)]


def timed(work: Callable[[], object], clock: Callable[[], float] = process_time) -> float:
    """Seconds that ``work`` takes."""
    began = clock()
    work()
    return clock() - began


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
