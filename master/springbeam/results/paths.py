"""The path of a position inside a step: a quintic through both ends' values and rates, with the step's two moments.

The cubic through values and rates alone hides what is shallower than its own error, of order 4 in the step. The bodies
report ∫ w and ∫∫ w as well: with these the polynomial is of order 6, and its distance from the cubic tells how well
the step is resolved.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

#: f and ḟ at one time.
Sample = tuple[float, float]
#: ∫ f dτ / H and ∫∫ f dτ dτ / H² over a step.
Means = tuple[float, float]

#: Largest values in (0, 1) of s²(1 − s)² and of s²(1 − s)²(2s − 1).
_EVEN, _ODD = 1.0 / 16.0, 0.0178885438
#: Points at which a minimum is looked for, and bisections to a place.
_POINTS, _BISECTIONS = 16, 40


def last(holds: Callable[[float], bool], low: float, high: float) -> tuple[float, float]:
    """Return by bisection between which two numbers ``holds``, true at ``low`` and false at ``high``, ends to be so.

    They are apart by 2^−40 of the bracket.
    """
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low, high


class Path(NamedTuple):
    """f(s) on [0, 1], s = τ/H: a cubic plus s²(1 − s)² [even + odd (2s − 1)]."""

    powers: tuple[float, float, float, float, float, float]  #: coefficients of 1, s … s⁵
    even: float
    odd: float
    size: float  #: H [s]

    @classmethod
    def through(cls, start: Sample, end: Sample, size: float, means: Means | None = None) -> Path:
        """Return the path from ``start`` to ``end`` in a step of ``size`` [s]; a cubic where its means are unknown."""
        (f0, d0), (f1, d1), even, odd = start, end, 0.0, 0.0
        d0, d1, rise = d0 * size, d1 * size, f1 - f0
        if means is not None:
            beside = means[0] - 0.5 * (f0 + f1) - (d0 - d1) / 12.0
            twice = means[1] - (7.0 * f0 + 3.0 * f1) / 20.0 - (d0 / 20.0 - d1 / 30.0)
            even, odd = 30.0 * beside, 210.0 * (beside - 2.0 * twice)
        tilt, twist = even - odd, 2.0 * odd
        a2, a3 = 3.0 * rise - 2.0 * d0 - d1 + tilt, d0 + d1 - 2.0 * rise - 2.0 * tilt + twist
        return cls((f0, d0, a2, a3, tilt - 2.0 * twist, twist), even, odd, size)

    @property
    def beside_cubic(self) -> float:
        """Largest distance between path and cubic, at most."""
        return _EVEN * abs(self.even) + _ODD * abs(self.odd)

    @property
    def moments_beside_cubic(self) -> float:
        """By how much path and cubic differ in ∫ f ds or in 2 ∫∫ f ds ds, whichever is more."""
        mean = self.even / 30.0
        return max(abs(mean), abs(mean - self.odd / 210.0))

    def at(self, s: float) -> float:
        a0, a1, a2, a3, a4, a5 = self.powers
        return a0 + s * (a1 + s * (a2 + s * (a3 + s * (a4 + s * a5))))

    def slope(self, s: float) -> float:
        """df/ds."""
        _, a1, a2, a3, a4, a5 = self.powers
        return a1 + s * (2.0 * a2 + s * (3.0 * a3 + s * (4.0 * a4 + s * (5.0 * a5))))

    def falls_through_zero(self, until: float = 1.0) -> float:
        """Return s in [0, until] where f, not below zero at the start but at ``until``, falls through it, by bisection.

        A path that starts on zero and rises falls later; one that only falls, at once.
        """
        low, high = last(lambda s: self.at(s) >= 0.0, 0.0, until)
        return high if low > 0.0 else 0.0

    def rises_through_zero(self, since: float) -> float:
        """Return s in [since, 1] where f, below zero at ``since``, not at the end, rises through it, by bisection."""
        return last(lambda s: self.at(s) < 0.0, since, 1.0)[1]

    def lowest_inside(self) -> float | None:
        """Return s in (0, 1) of the lowest minimum, ``None`` if there is none inside."""
        best: float | None = None
        slopes = [self.slope(i / _POINTS) for i in range(_POINTS + 1)]
        for i, (before, after) in enumerate(pairwise(slopes)):
            if not before < 0.0 <= after:
                continue
            high = last(lambda s: self.slope(s) < 0.0, i / _POINTS, (i + 1) / _POINTS)[1]
            if best is None or self.at(high) < self.at(best):
                best = high
        return best if best is None or 0.0 < best < 1.0 else None
