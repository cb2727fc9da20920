"""The polynomial contact force of one step against numpy's polynomials and closed forms."""

import numpy as np
import pytest
from numpy.polynomial import Legendre

from springbeam.bodies import force
from springbeam.bodies.protocol import Motion

EPS = float(np.finfo(float).eps)
#: Degrees 0, 1 and 2, with coefficients of both signs.
COEFFICIENTS = [(0.7,), (0.7, -2.3), (0.7, -2.3, 1.9), (1e-6, 40.0, -3e3)]


@pytest.mark.parametrize("size", [1e-5, 1e-3, 2.0])
@pytest.mark.parametrize("a", COEFFICIENTS)
def test_legendre_coefficients_and_derivatives_are_one_polynomial(a, size):
    """To a few ulp of the largest coefficient: the conversions are sums of at most three terms."""
    bound = 16 * EPS * max(map(abs, a))
    f = force.derivatives(a, size)
    exact = Legendre(a, domain=(0.0, size))
    assert f[0] == pytest.approx(exact(0.0), abs=bound)
    for k in (1, 2):
        # In units of the force, like the coefficients.
        assert f[k] * size**k == pytest.approx(exact.deriv(k)(0.0) * size**k, abs=12 * bound)
    assert force.legendre(f, size, len(a) - 1) == pytest.approx(a, abs=bound)
    for tau in (0.0, 0.31 * size, size):
        assert force.value(f, tau) == pytest.approx(exact(tau), abs=2 * bound)
    assert force.value(f, size) == pytest.approx(sum(a), abs=2 * bound)  # P_k(1) = 1
    assert force.mean(f, size) == pytest.approx(a[0], abs=2 * bound)  # P_k ⊥ 1 for k > 0


@pytest.mark.parametrize("size", [1e-4, 0.5])
def test_the_work_on_an_end_is_of_its_motion_from_wherever_it_starts(size):
    """∫ C ẇ over w = 0.3 + 0.4 s − 0.7 s² + 0.2 s³, s = τ/H."""
    w, a = np.polynomial.Polynomial([0.3, 0.4, -0.7, 0.2]), COEFFICIENTS[2]
    once, twice = w.integ(), w.integ(2)
    start = Motion(w(0.0), w.deriv()(0.0) / size, 0.0, 0.0)
    end = Motion(w(1.0), w.deriv()(1.0) / size, size * once(1.0), size**2 * twice(1.0))
    exact = (Legendre(a, domain=(0.0, 1.0)).convert(kind=np.polynomial.Polynomial) * w.deriv()).integ()(1.0)
    assert force.work_on(force.derivatives(a, size), start, end, size) == pytest.approx(exact, rel=1e-13)
