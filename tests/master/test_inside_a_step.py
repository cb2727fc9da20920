"""Where polynomials change their sign: their roots, to rounding."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from springbeam.motion.curves import sign_changes

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
