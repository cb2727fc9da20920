"""The projected contact law: C over a step from what the penetration's ends and moments say, exact in energy.

Let p̃ be the polynomial of degree d + 1 that has the penetration's values at both ends of the step and its first d
moments, and let C be the projection of F(p̃) + D(p̃, p̃′) onto degree d in L². Then ∫ C ṗ dτ = ∫ C p̃′ dτ, by parts, and

    ∫ C ṗ dτ = ΔΦ + ∫ D p̃′ dτ ≥ ΔΦ,

whatever the bodies, the law and the size of the step (``docs/coupling.md``, "Soft laws"). With d = 0 it is the
discrete gradient C = ΔΦ/Δp (Gonzalez 1996).
"""

from __future__ import annotations

from itertools import pairwise
from math import comb, isfinite
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from ..contact.laws import SoftLaw
from .small import Matrix, Vector

_EPS = 2.0**-52
#: Gauss–Legendre points of a step whose penetration stays off zero, and of pieces between zeros.
_POINTS, _POINTS_OF_PIECES = 8, 16
#: Relative change of p over a step up to which the quotient ΔΦ/Δp would lose digits to cancellation.
_SMALL_CHANGE = 0.1
#: p̃ is near zero somewhere if one of its Bernstein coefficients is below this share of the largest.
_NEAR_ZERO = 0.3
#: Bisections to a zero of p̃: to a millionth of the step, beside which the law is a rounding of itself.
_BISECTIONS = 40


class Projected(NamedTuple):
    """The force of a step."""

    a: Vector  #: Legendre coefficients of C [N]
    slope: Matrix  #: ∂a/∂x, x the penetration's numbers [N/m]


class _Points(NamedTuple):
    """Quadrature points of a step, at s in (−1, 1)."""

    V: np.ndarray  #: P_0 … P_{d+1} there, shape (n, d + 2)
    W: np.ndarray  #: (2k + 1)/2 P_k for k ≤ d, times the weights, shape (d + 1, n)


class Projection:
    """Projects ``law`` onto polynomials of ``degree`` over a step.

    The penetration's numbers x [m] are its value at the end of the step, its mean, and the mean of s p with
    s = 2τ/H − 1, the first d + 1 of them: minus the conditions of `springbeam.coupling.energy`.
    """

    def __init__(self, law: SoftLaw, degree: int) -> None:
        self.law, self.degree = law, degree
        n = degree + 2
        self._whole = _points(*legendre.leggauss(_POINTS), degree)
        nodes, weights = legendre.leggauss(_POINTS_OF_PIECES)
        t = 0.5 * (nodes + 1.0)
        # Graded towards both ends of a piece, 3t² − 2t³ of its length: a power of p beside p = 0 becomes smooth.
        self._graded, self._graded_weights = t * t * (3.0 - 2.0 * t), 3.0 * t * (1.0 - t) * weights
        self._unit, self._unit_weights = t, 0.5 * weights
        self._from_x, self._from_start = numbers_to_legendre(degree)
        self._derivative = legendre.legder(np.eye(n))  # coefficients of dp̃/ds from those of p̃
        self._norms = [2.0 / (2.0 * k + 1.0) for k in range(degree + 1)]
        self._bernstein = np.array([_bernstein(k, n - 1) for k in range(n)]).T

    def __call__(self, start: float, x: Vector, size: float) -> Projected:
        """Return the force over a step of ``size`` [s] with the penetration ``start`` [m] at its start.

        Raises OverflowError where no double holds it.
        """
        if self.degree == 0 and not self.law.damped:
            return self._discrete_gradient(start, x[0])
        c = self._coefficients(start, x)
        points = self._where_it_acts(c)
        if points is None:
            return Projected([0.0] * (self.degree + 1), [[0.0] * (self.degree + 1)] * (self.degree + 1))
        V, W = points
        p = V @ c
        F, slope = self.law.elastic(p)
        a = self._balanced((W @ F).tolist(), c, start, x[0])
        by_x = (W * slope) @ (V @ self._from_x)
        if self.law.damped:
            rate = (2.0 / size) * (V[:, :-1] @ self._derivative)
            D, by_p, by_rate = self.law.resistance(p, rate @ c)
            a = [elastic + damped for elastic, damped in zip(a, (W @ D).tolist(), strict=True)]
            by_x += ((W * by_p) @ V + (W * by_rate) @ rate) @ self._from_x
        if not all(map(isfinite, a)):
            raise OverflowError
        return Projected(a, by_x.tolist())

    def dissipated(self, start: float, x: Vector, size: float) -> float:
        """Return ∫ D ṗ dτ ≥ 0 [J] over a step of ``size`` [s] with the penetration's numbers ``x``."""
        c = self._coefficients(start, x)
        points = self._where_it_acts(c)
        if points is None:
            return 0.0
        V, W = points
        derivative = self._derivative @ c
        D, _, _ = self.law.resistance(V @ c, (2.0 / size) * (V[:, :-1] @ derivative))
        return float(np.dot(self._norms * (W @ D), derivative))

    def left_out(self, start: float, x: Vector) -> float:
        """Return the Legendre coefficient of F(p̃) of degree d + 1 [N], the first that C leaves out."""
        c = self._coefficients(start, x)
        points = self._where_it_acts(c)
        if points is None:
            return 0.0
        V, W = points
        k = self.degree + 1
        return float((2 * k + 1) * (W[0] * V[:, k]) @ self.law.elastic(V @ c)[0])

    def _coefficients(self, start: float, x: Vector) -> np.ndarray:
        """Return the d + 2 Legendre coefficients of p̃ [m]."""
        return np.asarray(self._from_x @ x + self._from_start * start)

    def _discrete_gradient(self, start: float, end: float) -> Projected:
        law, change = self.law, end - start
        largest = max(abs(start), abs(end))
        if abs(change) > _SMALL_CHANGE * largest:
            mean = (law.potential(end) - law.potential(start)) / change
            return Projected([mean], [[(law.force(end) - mean) / change]])
        if largest == 0.0 or (law.one_sided and start <= 0.0):
            return Projected([law.force(end)], [[0.5 * law.slope(end)]])
        # One sign throughout: the quotient is the mean of F over the straight path.
        F, slope = law.elastic(start + change * self._unit)
        return Projected([float(self._unit_weights @ F)], [[float(self._unit_weights @ (self._unit * slope))]])

    def _balanced(self, a: Vector, c: np.ndarray, start: float, end: float) -> Vector:
        """Correct ``a`` along p̃′ so that ∫ C p̃′ is ΔΦ to rounding: quadrature of a power is not exact."""
        rates = (self._derivative @ c).tolist()
        parts = [norm * value * rate for norm, value, rate in zip(self._norms, a, rates, strict=True)]
        before, after = self.law.potential(start), self.law.potential(end)
        missing = after - before - sum(parts)
        square = sum(norm * rate * rate for norm, rate in zip(self._norms, rates, strict=True))
        if abs(missing) <= 8.0 * _EPS * (before + after + sum(map(abs, parts))) or square == 0.0:
            return a
        return [value + missing / square * rate for value, rate in zip(a, rates, strict=True)]

    def _where_it_acts(self, c: np.ndarray) -> _Points | None:
        """Return quadrature points of the pieces of the step where the law acts, ``None`` if there are none."""
        if not self.law.one_sided:
            return self._whole
        hull = (self._bernstein @ c).tolist()
        largest = max(hull)
        if largest <= 0.0:
            return None
        if min(hull) > _NEAR_ZERO * largest:
            return self._whole
        places, weights = [], []
        cuts = [-1.0, *_zeros_inside(c.tolist()), 1.0]
        for low, high in pairwise(cuts):
            if _series(c.tolist(), 0.5 * (low + high)) > 0.0:
                places.append(low + (high - low) * self._graded)
                weights.append((high - low) * self._graded_weights)
        if not places:
            return None
        V, W = points = _points(np.concatenate(places), np.concatenate(weights), self.degree)
        inside = V @ c > 0.0
        return points if inside.all() else _Points(V[inside], W[:, inside])  # rounding beside a zero


def _points(s: np.ndarray, weights: np.ndarray, degree: int) -> _Points:
    V = np.empty((len(s), degree + 2))
    V[:, 0], V[:, 1] = 1.0, s
    for k in range(1, degree + 1):
        V[:, k + 1] = ((2 * k + 1) * s * V[:, k] - k * V[:, k - 1]) / (k + 1)
    return _Points(V, (V[:, : degree + 1] * weights[:, None]).T * (np.arange(degree + 1) + 0.5)[:, None])


def _series(c: Vector, s: float) -> float:
    """Return Σ c_k P_k(s) of a series of degree 1 to 3."""
    total = c[0] + c[1] * s
    if len(c) > 2:
        total += c[2] * 0.5 * (3.0 * s * s - 1.0)
    if len(c) > 3:
        total += c[3] * 0.5 * (5.0 * s * s - 3.0) * s
    return total


def _zeros_inside(c: Vector) -> list[float]:
    """Return the zeros in (−1, 1) of the Legendre series ``c``, of degree 1 to 3, where its sign changes; ascending."""
    marks = [-1.0, *_turns_inside(c), 1.0]
    found = []
    for low, high in pairwise(marks):
        at_low, at_high = _series(c, low), _series(c, high)
        if at_low * at_high >= 0.0:
            continue
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            if _series(c, middle) * at_low > 0.0:
                low = middle
            else:
                high = middle
        found.append(0.5 * (low + high))
    return found


def _turns_inside(c: Vector) -> list[float]:
    """Return where in (−1, 1) the series turns: zeros of its derivative c₁ + 3 c₂ s + 3 c₃ (5 s² − 1)/2."""
    if len(c) < 3:
        return []
    third = c[3] if len(c) > 3 else 0.0
    quadratic, linear, constant = 7.5 * third, 3.0 * c[2], c[1] - 1.5 * third
    discriminant = linear * linear - 4.0 * quadratic * constant
    if discriminant < 0.0:
        return []
    q = -0.5 * (linear + (discriminant**0.5 if linear >= 0.0 else -(discriminant**0.5)))
    zeros = [
        numerator / denominator for numerator, denominator in ((q, quadratic), (constant, q)) if denominator != 0.0
    ]
    return sorted(s for s in zeros if -1.0 < s < 1.0)


def _bernstein(k: int, degree: int) -> np.ndarray:
    """Return the Bernstein coefficients on [−1, 1] of P_k, raised to ``degree``."""
    x = np.linspace(-1.0, 1.0, degree + 1)
    u = 0.5 * (x + 1.0)
    B = np.array([[comb(degree, i) * v**i * (1.0 - v) ** (degree - i) for i in range(degree + 1)] for v in u])
    return np.asarray(np.linalg.solve(B, legendre.legval(x, [0.0] * k + [1.0])))


def numbers_to_legendre(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Return what takes x, shape (d + 2, d + 1), and p at the start, (d + 2,), to the Legendre coefficients of p̃."""
    n = degree + 2
    rows = np.zeros((n, n))
    rows[0] = 1.0  # p̃(1)
    for j in range(degree):
        rows[1 + j, j] = 1.0 / (2 * j + 1)  # mean of P_j p̃
    rows[-1] = (-1.0) ** np.arange(n)  # p̃(−1)
    inverse = np.linalg.inv(rows)
    return inverse[:, :-1], inverse[:, -1]
