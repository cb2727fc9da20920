"""Conditions under which displacements and velocities agree at every macro point.

g(H) = 0, ġ(H) = 0 and, for degree 2, ∫ g dτ = 0. Because the velocities agree wherever a step ends, a step that ends
on an event hands the right velocities to it, and the order holds through events. The price is stability: the work
∫ C ġ dτ does not vanish, and the scheme amplifies modes beyond a bound on ωH (``docs/coupling.md`` has it measured).
"""

from __future__ import annotations

from math import sqrt

from ..bodies.protocol import Motion
from .protocol import Conditions


def _degree_1(m: Motion, size: float) -> tuple[float, ...]:
    return (m.displacement, size * m.velocity)


def _degree_2(m: Motion, size: float) -> tuple[float, ...]:
    return (m.displacement, size * m.velocity, m.integral / size)


CONDITIONS: dict[int, Conditions] = {1: _degree_1, 2: _degree_2}

#: Where C is most accurate, as a share of the step: the last Gauss point.
SHARPEST = {1: 0.5 + 0.5 / sqrt(3.0), 2: 0.5 + 0.5 * sqrt(0.6)}

#: Order in the step's size of `gap_inside`.
ORDER_INSIDE = {1: 4, 2: 5}


def gap_inside(end: Motion, size: float, degree: int) -> float:
    """The first moment of the gap that is not among the conditions [m]: ∫ g dτ/H, or ∫ s g dτ/H with s = 2τ/H − 1."""
    moment = end.integral if degree == 1 else end.integral - 2.0 * end.integral_2 / size
    return abs(moment) / size
