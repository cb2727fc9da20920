"""A quantity over one step as a polynomial: the position of an end, the gap, a force.

A position is a quintic. The cubic through the values and rates at both ends of a step alone hides what is shallower
than its own error, of order 4 in the step. The bodies report ∫ w and ∫∫ w as well: with these the polynomial is of
order 6, and its distance from the cubic shows how well the step is resolved. A force that can only push is a parabola
through both ends with the mean of the step.

Zeros are those of a polynomial, isolated by the zeros of its derivative. Coefficients ascend. Those of one step are
plain floats, because numpy would take most of the time.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import inf
from typing import Any, NamedTuple

#: f and ḟ at a time of a step, and ∫ f dτ and ∫∫ f dτ dτ over the step up to there, as of the motion of an end.
Sample = tuple[float, float, float, float]

#: Largest values in (0, 1) of s²(1 − s)² and of s²(1 − s)²(2s − 1).
_EVEN = 1.0 / 16.0
_ODD = 0.0178885438
#: Largest displacement of a quintic by the last of the moments, over its coefficient of s⁵: about its error, unless
#: that is small.
LAST_MOMENT = 0.5 * _ODD
EPS = 2.0**-52
_MAX_ITERATIONS = 100


class Curve(NamedTuple):
    """f(s) on [0, 1], s = τ/H.

    Functions of zeros and minima are of the curve of one step; all others also of those of many, as arrays.
    """

    powers: Any  #: coefficients of 1, s, s² …
    size: Any  #: H [s]

    @classmethod
    def cubic(cls, start: Sequence[Any], end: Sequence[Any], size: Any) -> Curve:
        """Return the cubic through the values and rates of ``start`` and ``end``."""
        f0, d0 = start[:2]
        f1, d1 = end[:2]
        d0 = d0 * size
        d1 = d1 * size
        rise = f1 - f0
        return cls((f0, d0, 3.0 * rise - 2.0 * d0 - d1, d0 + d1 - 2.0 * rise), size)

    @classmethod
    def quintic(cls, start: Sequence[Any], end: Sequence[Any], size: Any) -> Curve:
        """Return the cubic plus s²(1 − s)² [even + odd (2s − 1)], which has the moments of ``end``."""
        f1, d1, once, twice = end
        (f0, d0, a2, a3), _ = cls.cubic(start, end, size)
        d1 = d1 * size
        beside = once / size - 0.5 * (f0 + f1) - (d0 - d1) / 12.0
        beside_2 = twice / (size * size) - (7.0 * f0 + 3.0 * f1) / 20.0 - (d0 / 20.0 - d1 / 30.0)
        even = 30.0 * beside
        odd = 210.0 * (beside - 2.0 * beside_2)
        tilt = even - odd
        twist = 2.0 * odd
        return cls((f0, d0, a2 + tilt, a3 - 2.0 * tilt + twist, tilt - 2.0 * twist, twist), size)

    @classmethod
    def parabola(cls, start: Sequence[Any], end: Sequence[Any], size: Any) -> Curve:
        """Return the parabola through the values of ``start`` and ``end`` that has the first moment of ``end``."""
        f0 = start[0]
        f1, _, once, _ = end
        bend = 3.0 * (f0 + f1 - 2.0 * once / size)
        return cls((f0, f1 - f0 - bend, bend), size)

    def __neg__(self) -> Curve:
        return Curve([-c for c in self.powers], self.size)

    def one(self, step: int) -> Curve:
        """Return the curve of one of many steps."""
        return Curve([float(c[step]) for c in self.powers], float(self.size[step]))

    def among(self, which: Any) -> Curve:
        """Return the curves of some of many steps."""
        return Curve([c[which] for c in self.powers], self.size[which])

    def at(self, s: Any) -> Any:
        return value(self.powers, s)

    @property
    def rate(self) -> Curve:
        """The curve of df/dτ."""
        return Curve([c / self.size for c in derivative(self.powers)], self.size)

    @property
    def beside_cubic(self) -> float:
        """Largest distance of a quintic from its cubic, at most; 0 of another curve."""
        even, odd = self._beside()
        return _EVEN * abs(even) + _ODD * abs(odd)

    @property
    def moments_beside_cubic(self) -> float:
        """Largest difference of a quintic and its cubic in ∫ f ds or in 2 ∫∫ f ds ds."""
        even, odd = self._beside()
        return max(abs(even) / 30.0, abs(even / 30.0 - odd / 210.0))

    def _beside(self) -> tuple[float, float]:
        if len(self.powers) < 6:
            return 0.0, 0.0
        *_, fourth, fifth = self.powers
        return fourth + 2.5 * fifth, 0.5 * fifth

    def falls_through_zero(self, until: float = 1.0) -> float:
        """Return s in [0, until] where f, not below zero at the start but at ``until``, last falls through it.

        A curve that starts on zero and rises falls later; one that only falls, at once.
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


def since(before: Sample, after: Sample, size: float) -> Sample:
    """Return the sample ``after`` with the integrals since another one, ``size`` [s] before, of the same step."""
    f, rate, once, twice = after
    return f, rate, once - before[2], twice - before[3] - size * before[2]


def value(coefficients: Sequence[Any], x: Any) -> Any:
    total = 0.0
    for coefficient in reversed(coefficients):
        total = total * x + coefficient
    return total


def derivative(coefficients: Sequence[Any]) -> list[Any]:
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
        there = value(coefficients, x)
        slope = value(slopes, x)
        before = x
        below, above = (below, x) if there > 0.0 else (x, above)
        x = x - there / slope if slope else inf
        if not min(below, above) < x < max(below, above):
            x = before if there == 0.0 else 0.5 * (below + above)
        if abs(x - before) <= EPS * abs(x):
            break
    return x
