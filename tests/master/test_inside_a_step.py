"""Inside a step: curves of positions, sign changes of polynomials, the contact force."""

import numpy as np
import pytest
from numpy.polynomial import Legendre, Polynomial

from springbeam.bodies import force
from springbeam.bodies.protocol import Motion
from springbeam.motion.curves import Curve, sign_changes

# -- The curve of a position inside a step: quintics exactly, minima, zeros, the order of its error and of the cubic's


SIZE = 0.02


def through(p, size=SIZE):
    """Curve through what a step would tell of p(τ/H): values, rates and integrals."""
    q = p.integ()
    q0 = p.integ(2)
    start, end = ((float(p(s)), float(p.deriv()(s)) / size) for s in (0.0, 1.0))
    return Curve.quintic(start, (*end, size * float(q(1.0)), size**2 * float(q0(1.0))), size)


# -- where polynomials change their sign: their roots, to rounding ----------------------------------------------------


INSIDE = [(0.2,), (1e-12, 1.0 - 1e-9), (1e-9, 0.5, 1.0 - 1e-9), (0.1, 0.11, 0.5, 0.7, 0.9)]
OUTSIDE = [(), (-0.3, 1.7)]


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


# -- the polynomial contact force of one step against numpy's polynomials and closed forms ----------------------------


@pytest.mark.parametrize("size", [1e-4, 0.5])
def test_the_work_on_an_end_is_of_its_motion_from_wherever_it_starts(size):
    """∫ C ẇ over w = 0.3 + 0.4 s − 0.7 s² + 0.2 s³, s = τ/H."""
    w = Polynomial([0.3, 0.4, -0.7, 0.2])
    a = (0.7, -2.3, 1.9)
    once = w.integ()
    twice = w.integ(2)
    start = Motion(w(0.0), w.deriv()(0.0) / size, 0.0, 0.0)
    end = Motion(w(1.0), w.deriv()(1.0) / size, size * once(1.0), size**2 * twice(1.0))
    exact = (Legendre(a, domain=(0.0, 1.0)).convert(kind=Polynomial) * w.deriv()).integ()(1.0)
    assert force.work_on(force.derivatives(a, size), start, end, size) == pytest.approx(exact, rel=1e-13)
