"""Where a polynomial changes its sign: the zeros of its derivative say between which places each zero lies.

Coefficients ascend. Plain floats, since numpy's overhead would be most of the time.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import inf

_EPS, _MAX_ITERATIONS = 2.0**-52, 100


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
        found, slope, before = value(coefficients, x), value(slopes, x), x
        below, above = (below, x) if found > 0.0 else (x, above)
        x = x - found / slope if slope else inf
        if not min(below, above) < x < max(below, above):
            x = before if found == 0.0 else 0.5 * (below + above)
        if abs(x - before) <= _EPS * abs(x):
            break
    return x
