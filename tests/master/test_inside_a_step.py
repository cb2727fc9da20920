"""Curves of a step: what they are made of gives them back; where polynomials change their sign, to rounding."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from springbeam.motion.curves import Curve, sign_changes, since

INSIDE = [(0.2,), (1e-12, 1.0 - 1e-9), (1e-9, 0.5, 1.0 - 1e-9), (0.1, 0.11, 0.5, 0.7, 0.9)]
OUTSIDE = [(), (-0.3, 1.7)]
SIZE = 0.02
QUINTIC = Polynomial([0.3, -0.7, 1.1, -0.4, 0.9, -0.6])


def sample(p, s):
    """Return what a step up to s says of p(τ/H): value, rate and two integrals."""
    return p(s), p.deriv()(s) / SIZE, SIZE * p.integ()(s), SIZE**2 * p.integ(2)(s)


@pytest.mark.parametrize(("kind", "degree"), [(Curve.parabola, 2), (Curve.cubic, 3), (Curve.quintic, 5)])
def test_a_curve_is_the_polynomial_that_a_step_tells_of(kind, degree):
    p = QUINTIC.cutdeg(degree)
    curve = kind(sample(p, 0.0), sample(p, 1.0), SIZE)
    assert curve.powers == pytest.approx(p.coef, rel=1e-12)
    assert curve.rate.at(0.3) == pytest.approx(p.deriv()(0.3) / SIZE, rel=1e-12)
    many = kind(*(np.array([sample(p, s)]).T for s in (0.0, 1.0)), np.array([SIZE]))
    assert many.one(0).powers == pytest.approx(curve.powers, rel=1e-15)


def test_the_curve_of_a_part_of_a_step_is_that_of_the_step():
    before, after = (sample(QUINTIC, s) for s in (0.25, 0.75))
    part = Curve.quintic(before, since(before, after, 0.5 * SIZE), 0.5 * SIZE)
    assert part.powers == pytest.approx(QUINTIC(Polynomial([0.25, 0.5])).coef, rel=1e-10)


@pytest.mark.parametrize("outside", OUTSIDE)
@pytest.mark.parametrize("inside", INSIDE)
@pytest.mark.parametrize("size", [1.0, 0.01])
def test_sign_changes_are_the_roots_inside(size, inside, outside):
    """A root is known to the rounding of the terms' sum over the slope there."""
    p = Polynomial([3.0])
    for x in (*inside, *outside):
        p *= Polynomial((-size * x, 1.0))
    found = sign_changes(p.coef.tolist(), 0.0, size)
    assert len(found) == len(inside)
    for x, root in zip(found, inside, strict=True):
        rounding = 1e-15 * Polynomial(np.abs(p.coef))(size * root)
        assert x == pytest.approx(size * root, abs=rounding / abs(p.deriv()(size * root)), rel=1e-15)
