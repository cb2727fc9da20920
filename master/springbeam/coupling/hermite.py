"""Conditions under which displacements and velocities agree at every macro point.

g(H) = 0, ġ(H) = 0 and, for degree 2, ∫ g dτ = 0. Because the velocities agree wherever a step ends, a step that ends
on an event hands the right velocities to it, and the order holds through events. The price is stability: the work
∫ C ġ dτ does not vanish, and the scheme amplifies modes beyond a bound on ωH (``docs/coupling.md`` has it measured).
"""

from __future__ import annotations

from ..subsystem import Motion


def _degree_1(m: Motion, size: float) -> tuple[float, ...]:
    return (m.displacement, size * m.velocity)


def _degree_2(m: Motion, size: float) -> tuple[float, ...]:
    return (m.displacement, size * m.velocity, m.integral / size)


CONDITIONS = {1: _degree_1, 2: _degree_2}
