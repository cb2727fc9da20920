"""Timings that are compared, both sides in turn, in one process or one run, so that what slows one slows the other.

All but sweeps on several processors are in processor time, of which what else runs on the machine takes none. A `Row`
of docs/performance.md has the goal that bounds it."""

import statistics
from dataclasses import dataclass
from time import process_time

from springbeam.monolithic import event_driven
from springbeam.paper import algorithm
from springbeam.run import runner


class _Clock:
    perf_counter = process_time = staticmethod(process_time)


# What runs report as their wall time.
runner.perf_counter = algorithm.perf_counter = process_time
event_driven.clock = _Clock


@dataclass(frozen=True)
class Times:
    """Seconds of each round, ours and the rival's (or the limit's)."""

    ours: list[float]
    rival: list[float]

    @property
    def ratios(self):
        """Ours over the rival's, round by round."""
        return [a / b for a, b in zip(self.ours, self.rival, strict=True)]


def timed(work, clock=process_time):
    """Seconds that ``work`` takes."""
    began = clock()
    work()
    return clock() - began


def compare(ours, rival, rounds):
    """Both ``rounds`` times in turn, after one that does not count; they return the seconds they took."""
    ours()
    rival()
    pairs = [(ours(), rival()) for _ in range(rounds)]
    return Times([a for a, _ in pairs], [b for _, b in pairs])


def median_and_spread(values, digits=3):
    """``median (smallest – largest)``."""
    if len(values) == 1:
        return f"{values[0]:.{digits}g}"
    return f"{statistics.median(values):.{digits}g} ({min(values):.{digits}g} – {max(values):.{digits}g})"


@dataclass(frozen=True)
class Row:
    """A row of the table."""

    what: str
    goal: str
    measured: str
    met: bool | None = None  #: ``None``: measured without a goal
    against: str = ""


@dataclass(frozen=True)
class Effort:
    """How much is measured."""

    rounds: int = 11
    #: Only see that everything runs.
    quick: bool = False


def ratio_row(what, times, limit, against, *, faster=False):
    """``limit`` bounds ours/rival from above, or with ``faster`` rival/ours from below."""
    ratios = [1.0 / r for r in times.ratios] if faster else times.ratios
    median = statistics.median(ratios)
    seconds = f"{shown(statistics.median(times.ours))} against {shown(statistics.median(times.rival))}"
    return Row(
        what,
        f"≥ {limit:g} × faster" if faster else f"≤ {limit:g} ×",
        f"{median_and_spread(ratios)} × {'faster' if faster else ''}".rstrip() + f"; {seconds}",
        median >= limit if faster else median <= limit,
        against,
    )


def below(what, values, goal, unit, against=""):
    """``goal`` bounds the median of the values from above, all in ``unit``."""
    met = statistics.median(values) <= goal
    return Row(what, f"≤ {goal:g} {unit}", f"{median_and_spread(values)} {unit}", met, against)


def shown(seconds):
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 1e-9:.3g} ns"
