"""A row of docs/performance.md, and the goals that bound it."""

from __future__ import annotations

import statistics
from dataclasses import dataclass

from measure import Times, median_and_spread


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


def ratio_row(what: str, times: Times, limit: float, against: str, *, faster: bool = False) -> Row:
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


def below(what: str, values: list[float], goal: float, unit: str, against: str = "") -> Row:
    """``goal`` bounds the median of the values from above, all in ``unit``."""
    met = statistics.median(values) <= goal
    return Row(what, f"≤ {goal:g} {unit}", f"{median_and_spread(values)} {unit}", met, against)


def shown(seconds: float) -> str:
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 1e-9:.3g} ns"
