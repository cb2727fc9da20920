"""The contact force of one step: C(τ) = Σ a_k P_k(2τ/H − 1), Legendre polynomials on [0, H], degree ≤ 2."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from operator import mul

import numpy as np
from numpy.polynomial import Legendre

from .protocol import Force, Motion


def derivatives(a: Sequence[float], size: float) -> Force:
    """Return (C, Ċ, C̈) at the step's start [N, N/s, N/s²] of 1 to 3 Legendre coefficients ``a`` [N]."""
    if len(a) == 1:
        return (a[0], 0.0, 0.0)
    if len(a) == 2:
        return (a[0] - a[1], 2.0 * a[1] / size, 0.0)
    return (a[0] - a[1] + a[2], (2.0 * a[1] - 6.0 * a[2]) / size, 12.0 * a[2] / (size * size))


def value(force: Force, tau: float) -> float:
    """Return C(τ) [N]."""
    return force[0] + tau * (force[1] + 0.5 * tau * force[2])


def mean(force: Force, size: float) -> float:
    """Return ∫ C dτ / H [N]."""
    return force[0] + size * (force[1] / 2.0 + size * force[2] / 6.0)


def work(force: Force, gap: Motion, size: float) -> float:
    """Return ∫ C ġ dτ [J] over a step that starts and ends with the gap closed: −∫ Ċ g dτ, ``gap`` at its end."""
    return -force[1] * gap.integral - force[2] * (size * gap.integral - gap.integral_2)


def work_on(force: Force, start: Motion, end: Motion, size: float) -> float:
    """Return ∫ C ẇ dτ [J] over a step on an end that moves from ``start`` to ``end``, by parts: C Δw − ∫ Ċ Δw."""
    w0 = start.displacement
    once = end.integral - w0 * size
    twice = end.integral_2 - 0.5 * w0 * size * size
    return value(force, size) * (end.displacement - w0) - force[1] * once - force[2] * (size * once - twice)


def shifted(force: Force, tau: float) -> Force:
    """Return the polynomial in the time from τ on."""
    if force[1] == 0.0 == force[2]:
        return force
    return (value(force, tau), force[1] + tau * force[2], force[2])


def combined(shares: Sequence[float], forces: Sequence[Force]) -> Force:
    """Return Σ share · force."""
    f, df, ddf = (sum(map(mul, shares, derivative)) for derivative in zip(*forces, strict=True))
    return (f, df, ddf)


def legendre(force: Force, size: float, degree: int) -> list[float]:
    """Return the degree + 1 Legendre coefficients of the polynomial (cut above ``degree``)."""
    value = force[0]
    slope = size * force[1]
    bend = size * size * force[2]
    mean = value + slope / 2.0 + bend / 6.0
    return [mean] if degree == 0 else [mean, slope / 2.0 + bend / 4.0, bend / 12.0][: degree + 1]


#: Integrals of P_k(2x − 1) from 0 to 1, taken 2, 1, 3 and 4 times: of each k in the order of `Motion`.
_UNIT_RESPONSES = [
    [float(Legendre.basis(k, domain=[0.0, 1.0]).integ(n, lbnd=0.0)(1.0)) for n in (2, 1, 3, 4)] for k in range(3)
]


def free_mass_response(degree: int, size: float, mass: float) -> list[Motion]:
    """Return the motion of a free mass [kg] from rest under −P_k, k = 0 … degree: any spring's if H is small."""
    scales = [-(size**n) / mass for n in (2, 1, 3, 4)]
    return [Motion(*map(mul, unit, scales)) for unit in _UNIT_RESPONSES[: degree + 1]]


_gauss = lru_cache(maxsize=64)(np.polynomial.legendre.leggauss)


def quadrature(time: float, size: float, cuts: Iterable[float], points: int) -> tuple[np.ndarray, np.ndarray]:
    """Return Gauss's nodes and weights on [−1, 1] of a step, for a signal that is smooth between ``cuts`` [s].

    Shape (pieces, ``points``) each.
    """
    nodes, weights = _gauss(points)
    edges = np.array([-1.0, *(2.0 * (cut - time) / size - 1.0 for cut in cuts), 1.0])
    half = 0.5 * np.diff(edges)[:, None]
    return edges[:-1, None] + half * (nodes + 1.0), half * weights
