"""Project a soft law onto a step: the force that follows from the penetration's ends and moments, exact in energy.

Let p̃ be the polynomial of degree d + 1 that has the penetration's values at both ends of the step and its first d
moments, and let C be the projection of F(p̃) + D(p̃, p̃′) onto degree d in L². Then ∫ C ṗ dτ = ∫ C p̃′ dτ, by parts, and

    ∫ C ṗ dτ = ΔΦ + ∫ D p̃′ dτ ≥ ΔΦ,

whatever the bodies, the law and the size of the step (``docs/coupling.md``, "Soft laws"). With d = 0 it is the
discrete gradient C = ΔΦ/Δp (Gonzalez 1996).

Polynomials are in powers of s = 2τ/H − 1, numbers are plain floats: most steps have six points of quadrature, and
numpy's overhead would be most of their time.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import isfinite
from operator import sub

import numpy as np

from ..bodies.protocol import Ends
from ..motion.curves import EPS, sign_changes
from ..scene.laws import SoftLaw
from .protocol import Counts, Coupling, LawEnergies, Step
from .small import Matrix, Vector, transposed
from .solver import CONDITIONS

#: p̃ by its coefficients in powers of s, up to degree 3.
_Path = tuple[float, float, float, float]
#: Points s of a quadrature on [−1, 1], and their weights.
_Rule = Sequence[tuple[float, float]]

#: p̃ keeps its size if the least of its Bézier points is above this share of the largest.
_STEADY = 0.9
#: p̃ keeps away from zero if the least of its Bézier points is above this share of the largest.
_OFF_ZERO = 0.3
#: Relative change of p over a step up to which the quotient ΔΦ/Δp would lose more than two digits.
_SMALL_CHANGE = 0.01


def _gauss(points: int) -> list[tuple[float, float]]:
    nodes, weights = np.polynomial.legendre.leggauss(points)
    return list(zip(nodes.tolist(), weights.tolist(), strict=True))


#: Rule for a p̃ of degree 1 that changes so little that ΔΦ/Δp would lose digits: exact to rounding.
_OF_LITTLE = _gauss(3)
#: Rules for a p̃ of degree 1, 2, 3 that keeps its size.
_FEW = [_gauss(4), _gauss(5), _gauss(6)]
#: The rule for a p̃ that keeps away from zero.
_MANY = _gauss(8)
#: The rule for a piece between zeros, from 0 to 1. It is graded towards both ends, 3t² − 2t³ of the length: a power of
#: p beside p = 0 becomes smooth.
_GRADED = [
    (t * t * (3.0 - 2.0 * t), 3.0 * t * (1.0 - t) * weight)
    for t, weight in [(0.5 * (s + 1.0), weight) for s, weight in _gauss(16)]
]


class Projection:
    """Projects ``law`` onto polynomials of ``degree`` over a step.

    Data of a step are the penetration at its start [m] and the penetration's numbers x [m]: its value at the end of the
    step, its mean, and the mean of s p, the first d + 1 of them: minus the conditions of a tie.
    """

    def __init__(self, law: SoftLaw, degree: int) -> None:
        self.law = law
        self.degree = degree
        self._damped = law.damped
        self._few = _FEW[degree]
        self._is_quotient = degree == 0 and not law.damped
        units = np.eye(degree + 1).tolist()
        #: ∂p̃/∂x_j, and the Legendre coefficients of its projection, by rows.
        self._by_x = [_path(0.0, unit) for unit in units]
        self._by_x_projected = transposed(penetration_series(0.0, unit)[: degree + 1] for unit in units)

    def force(self, start: float, size: float, x: Vector) -> Vector:
        """Return the Legendre coefficients of C [N] over a step of ``size`` [s].

        Raises OverflowError where no double holds it.
        """
        law = self.law.force
        if self._is_quotient:
            end = x[0]
            if _changes(start, end):
                mean = (self.law.potential(end) - self.law.potential(start)) / (end - start)
            else:
                middle = 0.5 * (start + end)
                half = 0.5 * (end - start)
                mean = 0.5 * sum([weight * law(middle + s * half) for s, weight in _OF_LITTLE])
            if not isfinite(mean):
                raise OverflowError
            return [mean]
        path = b0, b1, b2, b3 = _path(start, x)
        rule = self._quadrature(path, start, x[0], size)
        m0 = m1 = m2 = 0.0
        for s, weight in rule:
            m = weight * law(b0 + s * (b1 + s * (b2 + s * b3)))
            m0 += m
            m *= s
            m1 += m
            m2 += s * m
        share = self._missing(path, (m0, m1, m2), start, x[0]) if rule else 0.0
        if self._damped:
            for s, weight in rule:
                m = weight * self.law.resistance(*_at(path, s, size))[0]
                m0 += m
                m1 += s * m
                m2 += s * s * m
        a = [0.5 * m0, 1.5 * m1, 3.75 * m2 - 1.25 * m0]
        if share != 0.0:
            a = [a[0] + share * (b1 + b3), a[1] + share * 2.0 * b2, a[2] + share * 2.0 * b3]
        if not isfinite(sum(a)):
            raise OverflowError
        return a[: self.degree + 1]

    def slope(self, start: float, size: float, x: Vector, a: Vector) -> Matrix:
        """Return ∂a/∂x [N/m] of `force`, which is ``a``; where p keeps its size, with F′ of its mean."""
        law = self.law
        if self._is_quotient and _changes(start, x[0]):
            return [[(law.force(x[0]) - a[0]) / (x[0] - start)]]
        mean = x[1] if self.degree else (start + 2.0 * x[0]) / 3.0  # at degree 0, weighted by ∂p̃/∂x
        steady = not law.one_sided or min(start, x[0], mean) > _STEADY * max(start, x[0], mean)
        if steady and not self._damped:
            of_mean = law.slope(mean)
            return [[of_mean * value for value in row] for row in self._by_x_projected]
        path = _path(start, x)
        rule = self._quadrature(path, start, x[0], size)
        rows = [[0.0] * len(x) for _ in x]
        for s, weight in rule:
            p, rate = _at(path, s, size)
            by_p = law.slope(p)
            by_rate = 0.0
            if self._damped:
                _, of_resistance, by_rate = law.resistance(p, rate)
                by_p += of_resistance
            legendre = (0.5, 1.5 * s, 3.75 * s * s - 1.25)  # (2k + 1)/2 P_k(s)
            for j, change in enumerate(self._by_x):
                of_p, of_rate = _at(change, s, size)
                moved = weight * (by_p * of_p + by_rate * of_rate)
                for row, factor in zip(rows, legendre, strict=False):
                    row[j] += factor * moved
        return rows

    def dissipated(self, start: float, size: float, x: Vector) -> float:
        """Return ∫ D ṗ dτ ≥ 0 [J] over a step of ``size`` [s]."""
        path = _path(start, x)
        total = 0.0
        for s, weight in self._quadrature(path, start, x[0], size):
            p, rate = _at(path, s, size)
            total += weight * self.law.resistance(p, rate)[0] * rate
        return 0.5 * size * total

    def _missing(self, path: _Path, moments: tuple[float, float, float], start: float, end: float) -> float:
        """Return by how much of p̃′ C is to be corrected for ∫ C p̃′ = ΔΦ: quadrature of a power is not exact."""
        _, b1, b2, b3 = path
        w0 = b1 * moments[0]
        w1 = 2.0 * b2 * moments[1]
        w2 = 3.0 * b3 * moments[2]
        before = self.law.potential(start)
        after = self.law.potential(end)
        missing = after - before - w0 - w1 - w2
        if abs(missing) <= 8.0 * EPS * (before + after + abs(w0) + abs(w1) + abs(w2)):
            return 0.0
        square = 2.0 * (b1 + b3) ** 2 + 8.0 / 3.0 * b2 * b2 + 1.6 * b3 * b3
        return missing / square if square > 0.0 else 0.0

    def _quadrature(self, path: _Path, start: float, end: float, size: float) -> _Rule:
        """Return a rule for the pieces of a step of ``size`` [s] in each of which the law is smooth."""
        if not self.law.one_sided:
            return self._few
        _, b1, b2, b3 = path
        second = start + (b1 - 2.0 * b2 + 3.0 * b3) / 1.5
        third = end - (b1 + 2.0 * b2 + 3.0 * b3) / 1.5
        low = min(start, second, third, end)
        high = max(start, second, third, end)  # of the Bézier points
        if high <= 0.0:
            return ()
        away = low > _OFF_ZERO * high
        breaks = [-1.0, *(() if away else sign_changes(path, -1.0, 1.0)), 1.0]
        opens = b1 < 2.0 * abs(b2) + 3.0 * abs(b3)  # somewhere, else the law pushes everywhere
        limits = self._limits(path, size, breaks) if self._damped and opens else []
        if away and not limits:
            return self._few if low > _STEADY * high else _MANY
        rule: list[tuple[float, float]] = []
        for left, right in pairwise(sorted(breaks + limits)):
            if _at(path, 0.5 * (left + right))[0] > 0.0:
                length = right - left
                rule += [(left + length * t, length * weight) for t, weight in _GRADED]
        return rule

    def _limits(self, path: _Path, size: float, breaks: Sequence[float]) -> list[float]:
        """Return where between ``breaks`` the resistance reaches or leaves its limit, at which the force is 0."""

        def varies(s: float) -> bool:
            return self.law.resistance(*_at(path, s, size))[2] > 0.0

        limits = []
        for left, right in pairwise(breaks):
            points = [left + 0.5 * (1.0 + s) * (right - left) for s, _ in _MANY]
            for (low, before), (high, after) in pairwise((s, varies(s)) for s in points):
                if before is not after:
                    a = low
                    b = high
                    while a < (middle := 0.5 * (a + b)) < b:
                        a, b = (middle, b) if varies(middle) is before else (a, middle)
                    limits.append(b)
        return limits


def _changes(start: float, end: float) -> bool:
    """Whether p changes by so much that ΔΦ/Δp loses few digits to cancellation."""
    return abs(end - start) > _SMALL_CHANGE * max(abs(start), abs(end))


def penetration_series(start: float, x: Vector) -> Vector:
    """Return the Legendre coefficients of p̃ [m], d + 2 of them."""
    b0, b1, b2, b3 = _path(start, x)
    return [b0 + b2 / 3.0, b1 + 0.6 * b3, b2 / 1.5, 0.4 * b3][: len(x) + 1]


def _path(start: float, x: Vector) -> _Path:
    middle = 0.5 * (start + x[0])
    half_change = 0.5 * (x[0] - start)
    if len(x) == 1:
        return (middle, half_change, 0.0, 0.0)
    bend = middle - x[1]
    if len(x) == 2:
        return (x[1] - 0.5 * bend, half_change, 1.5 * bend, 0.0)
    slant = 3.0 * x[2]
    twist = half_change - slant
    return (x[1] - 0.5 * bend, slant - 1.5 * twist, 1.5 * bend, 2.5 * twist)


def _at(path: _Path, s: float, size: float = 2.0) -> tuple[float, float]:
    """Return p̃ [m] and its rate over a step of ``size`` [m/s]."""
    b0, b1, b2, b3 = path
    return b0 + s * (b1 + s * (b2 + s * b3)), 2.0 / size * (b1 + s * (2.0 * b2 + 3.0 * b3 * s))


def penetration(step: Step, degree: int) -> tuple[float, Vector]:
    """Return the penetration at the start of ``step`` [m], and its numbers over the step as `Projection` takes them."""
    tip, low = step.start
    conditions = CONDITIONS[degree]
    x = list(map(sub, conditions(step.end[1], step.size), conditions(step.end[0], step.size)))
    return low.displacement - tip.displacement, x


class SoftCoupling(Coupling):
    """Accounts for what a soft law stores and dissipates; parameters as of `Projection`."""

    def __init__(self, law: SoftLaw, degree: int) -> None:
        self.law = law
        self.degree = degree
        self._projection = Projection(law, degree)
        self.state = Counts()

    def accept(self, step: Step) -> None:
        if self.law.damped:
            start, x = penetration(step, self.degree)
            self.state.dissipated += self._projection.dissipated(start, step.size, x)

    def energies(self, ends: Ends) -> LawEnergies:
        tip, low = ends
        return LawEnergies(self.law.potential(low.displacement - tip.displacement), self.state.dissipated)
