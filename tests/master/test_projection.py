"""The projected law by itself: its work is what the law stores and takes, to rounding."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.polynomial import legendre

from springbeam.contact.laws import Compliance
from springbeam.coupling.projection import Projection

EPS, SMALLEST = float(np.finfo(float).eps), float(np.finfo(float).smallest_subnormal)
SIZE = 0.01


def series(projection, start, x):
    """Legendre coefficients of the penetration's polynomial, from its defining conditions."""
    d = projection.degree
    rows = [[1.0] * (d + 2), [(-1.0) ** k for k in range(d + 2)]]
    rows += [[(1.0 / (2 * j + 1)) if k == j else 0.0 for k in range(d + 2)] for j in range(d)]
    return np.linalg.solve(np.array(rows), [x[0], start, *x[1:]])


def work(projection, a, start, x):
    """∫ C ṗ dτ: only the first d + 1 Legendre coefficients of ṗ meet those of C."""
    rates = legendre.legder(series(projection, start, x))
    return float(sum(2.0 / (2 * k + 1) * c * rate for k, (c, rate) in enumerate(zip(a, rates, strict=True))))


@given(
    start=st.floats(-1e-2, 1e-2), end=st.floats(-1e-2, 1e-2), mean=st.floats(-1e-2, 1e-2), skew=st.floats(-5e-3, 5e-3),
    degree=st.sampled_from([0, 1, 2]), q=st.floats(1.0, 4.0), chi=st.floats(0.0, 3.0),
)  # fmt: skip
@example(start=0.0, end=2.9e-158, mean=2.9e-158, skew=0.0, degree=2, q=1.0, chi=0.0)
def test_damping_never_gives_energy(start, end, mean, skew, degree, q, chi):
    """The energy is kept to 64 roundings; below 1e-308 J a rounding is the smallest double, whatever their size."""
    law = Compliance(1e4, q, chi)
    projection = Projection(law, degree)
    x = [end, mean, skew][: degree + 1]
    a = projection.force(start, SIZE, x)
    gained = law.potential(end) - law.potential(start)
    largest = abs(start) + sum(map(abs, x))  # whether less than a rounding of it touches is not told
    scale = abs(gained) + sum(map(abs, a)) * largest + law.potential(largest)
    roundings = 64 * (EPS * scale + SMALLEST)
    dissipated = projection.dissipated(start, SIZE, x) if law.damped else 0.0
    assert dissipated >= -roundings
    assert work(projection, a, start, x) - gained == pytest.approx(dissipated, abs=roundings)
