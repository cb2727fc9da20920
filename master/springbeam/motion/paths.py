"""The path of a position inside a step: a quintic through both ends' values and rates, with the step's two moments.

The cubic through values and rates alone hides what is shallower than its own error, of order 4 in the step. The bodies
report ∫ w and ∫∫ w as well: with these the polynomial is of order 6, and its distance from the cubic shows how well
the step is resolved. Its zeros are those of a polynomial, isolated by the zeros of its derivative. Coefficients of
polynomials ascend; they are plain floats, because numpy would take most of the time.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import inf
from typing import NamedTuple

#: f and ḟ at one time.
Sample = tuple[float, float]
#: ∫ f dτ / H and ∫∫ f dτ dτ / H² over a step.
Means = tuple[float, float]

#: Largest values in (0, 1) of s²(1 − s)² and of s²(1 − s)²(2s − 1).
_EVEN = 1.0 / 16.0
_ODD = 0.0178885438
#: Largest displacement of a path by the last of the moments, over its coefficient of s⁵, 2 odd: about the error of the
#: path, unless that is small.
LAST_MOMENT = 0.5 * _ODD
EPS = 2.0**-52
_MAX_ITERATIONS = 100


class Path(NamedTuple):
    """f(s) on [0, 1], s = τ/H: a cubic plus s²(1 − s)² [even + odd (2s − 1)]."""

    powers: tuple[float, float, float, float, float, float]  #: coefficients of 1, s … s⁵
    even: float
    odd: float
    size: float  #: H [s]

    @classmethod
    def through(cls, start: Sample, end: Sample, size: float, means: Means | None = None) -> Path:
        """Return the path from ``start`` to ``end`` in a step of ``size`` [s]; a cubic where its means are unknown."""
        f0, d0 = start
        f1, d1 = end
        even = 0.0
        odd = 0.0
        d0 = d0 * size
        d1 = d1 * size
        rise = f1 - f0
        if means is not None:
            beside = means[0] - 0.5 * (f0 + f1) - (d0 - d1) / 12.0
            twice = means[1] - (7.0 * f0 + 3.0 * f1) / 20.0 - (d0 / 20.0 - d1 / 30.0)
            even = 30.0 * beside
            odd = 210.0 * (beside - 2.0 * twice)
        tilt = even - odd
        twist = 2.0 * odd
        a2 = 3.0 * rise - 2.0 * d0 - d1 + tilt
        a3 = d0 + d1 - 2.0 * rise - 2.0 * tilt + twist
        return cls((f0, d0, a2, a3, tilt - 2.0 * twist, twist), even, odd, size)

    @property
    def beside_cubic(self) -> float:
        """Largest distance between path and cubic, at most."""
        return _EVEN * abs(self.even) + _ODD * abs(self.odd)

    @property
    def moments_beside_cubic(self) -> float:
        """Largest difference of path and cubic in ∫ f ds or in 2 ∫∫ f ds ds."""
        mean = self.even / 30.0
        return max(abs(mean), abs(mean - self.odd / 210.0))

    def at(self, s: float) -> float:
        return value(self.powers, s)

    def slope(self, s: float) -> float:
        """df/ds."""
        return value(derivative(self.powers), s)

    def falls_through_zero(self, until: float = 1.0) -> float:
        """Return s in [0, until] where f, not below zero at the start but at ``until``, last falls through it.

        A path that starts on zero and rises falls later; one that only falls, at once.
        """
        return max(sign_changes(self.powers, 0.0, until), default=0.0)

    def rises_through_zero(self, since: float) -> float:
        """Return s in [since, 1] where f, below zero at ``since``, not at the end, first rises through it."""
        return min(sign_changes(self.powers, since, 1.0), default=1.0)

    def lowest_inside(self) -> float | None:
        """Return s in (0, 1) of the lowest minimum, ``None`` if there is none inside."""
        slopes = derivative(self.powers)
        bends = derivative(slopes)
        return min((s for s in sign_changes(slopes, 0.0, 1.0) if value(bends, s) > 0.0), key=self.at, default=None)


class Place(NamedTuple):
    """Values of f at a time of a step."""

    time: float  #: since the start of the step [s]
    sample: Sample
    means: Means | None  #: over the step up to there; ``None`` if nobody knows

    def path_to(self, later: Place) -> Path:
        """Return the path from here to a ``later`` place."""
        before = self.time
        after = later.time
        size = later.time - self.time
        means = None
        if self.means is not None and later.means is not None:
            mean, twice = self.means
            mean_after, twice_after = later.means
            gained = after * mean_after - before * mean
            gained_twice = after**2 * twice_after - before**2 * twice - size * before * mean
            means = gained / size, gained_twice / size**2
        return Path.through(self.sample, later.sample, size, means)


def value(coefficients: Sequence[float], x: float) -> float:
    total = 0.0
    for coefficient in reversed(coefficients):
        total = total * x + coefficient
    return total


def derivative(coefficients: Sequence[float]) -> list[float]:
    """Return the coefficients of the derivative."""
    return [k * coefficient for k, coefficient in enumerate(coefficients)][1:]


def sign_changes(coefficients: Sequence[float], low: float, high: float) -> list[float]:
    """Return the places between ``low`` and ``high``, ascending, where the sign changes, to rounding."""
    slopes = derivative(coefficients)
    if not any(slopes):
        return []
    places = [(x, value(coefficients, x)) for x in (low, *sign_changes(slopes, low, high), high)]
    return [
        _zero(coefficients, slopes, *((a, b) if at_b > 0.0 else (b, a)))
        for (a, at_a), (b, at_b) in pairwise(places)
        if min(at_a, at_b) < 0.0 < max(at_a, at_b)
    ]


def _zero(coefficients: Sequence[float], slopes: Sequence[float], below: float, above: float) -> float:
    """Return the zero between places where a polynomial is below 0 and above it, by Newton's method and bisection."""
    x = 0.5 * (below + above)
    for _ in range(_MAX_ITERATIONS):
        found = value(coefficients, x)
        slope = value(slopes, x)
        before = x
        below, above = (below, x) if found > 0.0 else (x, above)
        x = x - found / slope if slope else inf
        if not min(below, above) < x < max(below, above):
            x = before if found == 0.0 else 0.5 * (below + above)
        if abs(x - before) <= EPS * abs(x):
            break
    return x
