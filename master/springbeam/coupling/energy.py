"""Conditions under which the contact force does no net work over a step.

With g = 0 at the step's start and g(H) = 0, the work of C(τ) = Σ c_j τʲ on both bodies together is, by parts,

    ∫ C ġ dτ = [C g]₀ᴴ − Σ j c_j ∫ τ^{j−1} g dτ = 0    if    ∫ τ^{j−1} g dτ = 0,  j = 1 … d,

whatever the coefficients, the step and the bodies: the coupling creates no energy.
The moments are taken against Legendre polynomials of s = 2τ/H − 1, which spans the same space and keeps the system
well conditioned:  ∫ g dτ = I₁  and  ∫ s g dτ = I₁ − 2 I₂/H,  with I₁ = ∫ g dτ and I₂ = ∫∫ g dτ dτ = ∫ (H − τ) g dτ.
"""

from __future__ import annotations

from math import sqrt

from ..bodies.protocol import Force, Motion
from .protocol import Conditions


def _degree_0(m: Motion, size: float) -> tuple[float, ...]:
    return (m.displacement,)


def _degree_1(m: Motion, size: float) -> tuple[float, ...]:
    return (m.displacement, m.integral / size)


def _degree_2(m: Motion, size: float) -> tuple[float, ...]:
    return (m.displacement, m.integral / size, (m.integral - 2.0 * m.integral_2 / size) / size)


CONDITIONS: dict[int, Conditions] = {0: _degree_0, 1: _degree_1, 2: _degree_2}

#: Where C is most accurate, as a share of the step: the last zero of P′_{d+2}, what a force of the next degree leaves.
SHARPEST = {0: 0.5, 1: 0.5 + 0.5 / sqrt(5.0), 2: 0.5 + 0.5 * sqrt(3.0 / 7.0)}

#: Order in the step's size of the velocity mismatch that one step creates.
ORDER_CREATED = {0: 2, 1: 3, 2: 4}


def created_mismatch(start: Motion, end: Motion, degree: int) -> float:
    """The velocity mismatch that a step creates [m/s], of the gap at its ends.

    Where the ends answer a force as free masses do, the one it starts with turns into w⁺ = −(−1)^d w.
    """
    return abs(end.velocity - start.velocity if degree == 1 else end.velocity + start.velocity)


def image(start: Motion, end: Motion, size: float, degree: int, reduced_mass: float) -> Force:
    """Return the part of C that turns a velocity mismatch w round, −2(−1)^d μ w/H P′_{d+1}(2τ/H − 1) [N].

    ``start`` and ``end`` are those of the gap; what free masses would do is subtracted from C to see the contact's own.
    """
    if degree == 1:
        slope = 6.0 * reduced_mass * (start.velocity + end.velocity) / (size * size)
        return (-0.5 * size * slope, slope, 0.0)
    k = -reduced_mass * (start.velocity - end.velocity) / size
    return (k, 0.0, 0.0) if degree == 0 else (6.0 * k, -30.0 * k / size, 60.0 * k / (size * size))
