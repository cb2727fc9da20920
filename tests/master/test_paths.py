"""The path of a position inside a step: quintics exactly, minima, order of the error, distance from the cubic."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from springbeam.results.paths import Path

SIZE = 0.02
#: Coefficients in s = τ/H, ascending: minima inside, at neither end, two of them, none.
QUINTICS = [
    (0.3, 1.0, -4.0, 1.5, 2.0, 1.0),
    (1.0, -1.0, 1.0),
    (0.1, -1.0, 9.0, -27.0, 31.0, -12.0),
    (1.0, 2.0, 0.5, 0.1),
]


def through(p: Polynomial, size: float = SIZE) -> Path:
    """Path through what a step would tell of p(τ/H): values, rates and means."""
    q, q0 = p.integ(), p.integ(2)
    samples = [(float(p(s)), float(p.deriv()(s)) / size) for s in (0.0, 1.0)]
    return Path.through(*samples, size, (float(q(1.0)), float(q0(1.0))))


@pytest.mark.parametrize("coefficients", QUINTICS)
def test_a_quintic_is_met_exactly(coefficients):
    p = Polynomial(coefficients)
    path = through(p)
    for s in np.linspace(0.0, 1.0, 11):
        assert path.at(s) == pytest.approx(p(s), abs=2e-13)
        assert path.slope(s) == pytest.approx(p.deriv()(s), abs=2e-12)


@pytest.mark.parametrize("coefficients", QUINTICS)
def test_the_lowest_minimum_is_found(coefficients):
    p = Polynomial(coefficients)
    inside = [
        r.real for r in p.deriv().roots() if abs(r.imag) < 1e-9 and 0.0 < r.real < 1.0 and p.deriv(2)(r.real) > 0.0
    ]
    found = through(p).lowest_inside()
    if inside:
        assert found == pytest.approx(min(inside, key=p), abs=1e-9)
    else:
        assert found is None


def test_both_answers_are_among_them():
    assert {through(Polynomial(c)).lowest_inside() is None for c in QUINTICS} == {True, False}


def test_orders_of_path_and_cubic():
    """cos(ωτ) over one step: H⁶/46080 and H⁴/384 of the derivative in the middle; the distance tells the cubic's."""
    errors = []
    for turn in (0.8, 0.4):
        w, half = turn, 0.5 * turn
        samples = [(np.cos(x), -w * np.sin(x)) for x in (-half, half)]
        mean = 2.0 * np.sin(half) / turn
        # ∫∫ cos = ∫ (1 − s) cos; symmetric about the middle, so half the mean.
        path = Path.through(*samples, 1.0, (mean, 0.5 * mean))
        cubic = Path.through(*samples, 1.0)
        s = np.linspace(0.0, 1.0, 101)
        exact = np.cos(-half + turn * s)
        errors.append([max(abs(f.at(x) - y) for x, y in zip(s, exact, strict=True)) for f in (path, cubic)])
        assert path.beside_cubic == pytest.approx(errors[-1][1], rel=0.05)
    assert np.log2(np.divide(*errors)) == pytest.approx([6.0, 4.0], abs=0.1)
