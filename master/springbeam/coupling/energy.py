"""Conditions under which the contact force does no net work over a step.

With g = 0 at the step's start and g(H) = 0, the work of C(τ) = Σ c_j τʲ on both bodies together is, by parts,

    ∫ C ġ dτ = [C g]₀ᴴ − Σ j c_j ∫ τ^{j−1} g dτ = 0    if    ∫ τ^{j−1} g dτ = 0,  j = 1 … d,

whatever the coefficients, the step and the bodies: the coupling creates no energy.
The moments are taken against Legendre polynomials of s = 2τ/H − 1, which spans the same space and keeps the system
well conditioned:  ∫ g dτ = I₁  and  ∫ s g dτ = I₁ − 2 I₂/H,  with I₁ = ∫ g dτ and I₂ = ∫∫ g dτ dτ = ∫ (H − τ) g dτ.
"""

from __future__ import annotations

from ..bodies.protocol import Motion
from .protocol import Conditions


def _degree_0(m: Motion, size: float) -> tuple[float, ...]:
    return (m.displacement,)


def _degree_1(m: Motion, size: float) -> tuple[float, ...]:
    return (m.displacement, m.integral / size)


def _degree_2(m: Motion, size: float) -> tuple[float, ...]:
    return (m.displacement, m.integral / size, (m.integral - 2.0 * m.integral_2 / size) / size)


CONDITIONS: dict[int, Conditions] = {0: _degree_0, 1: _degree_1, 2: _degree_2}

#: Order in the step's size of the velocity mismatch that one step creates.
ORDER_CREATED = {0: 2, 1: 3, 2: 4}


def created_mismatch(start: Motion, end: Motion, degree: int) -> float:
    """The velocity mismatch that a step creates [m/s], of the gap at its ends.

    Where the ends answer a force as free masses do, the one it starts with turns into w⁺ = −(−1)^d w.
    """
    return abs(end.velocity - start.velocity if degree == 1 else end.velocity + start.velocity)
