"""The projected law by itself: energy to rounding, the discrete gradient, slopes, quadrature, dissipation."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.polynomial import legendre
from scipy.integrate import quad

from springbeam.contact.laws import Compliance
from springbeam.coupling.projection import Projection

EPS, SMALLEST = float(np.finfo(float).eps), float(np.finfo(float).smallest_subnormal)
SIZE = 0.01
#: A penetration's end, mean and mean of s p [mm], after a start of 1 mm or −1 mm.
SHAPES = {"in": [1.5, 1.3, 0.1], "opens": [-1.0, 0.4, -0.5], "dips in": [-1.0, 0.3, -0.4], "out": [-2.0, -1.0, 0.1]}


def numbers(name, degree):
    return (-1e-3 if name in ("dips in", "out") else 1e-3), [1e-3 * value for value in SHAPES[name][: degree + 1]]


def series(projection, start, x):
    """Legendre coefficients of the penetration's polynomial, from its defining conditions."""
    d = projection.degree
    rows = [[1.0] * (d + 2), [(-1.0) ** k for k in range(d + 2)]]
    rows += [[(1.0 / (2 * j + 1)) if k == j else 0.0 for k in range(d + 2)] for j in range(d)]
    return np.linalg.solve(np.array(rows), [x[0], start, *x[1:]])


def integral(function, c):
    """∫ over s in [−1, 1], by pieces between the zeros of the series."""
    zeros = [float(r.real) for r in legendre.legroots(c) if abs(r.imag) < 1e-12 and -1.0 < r.real < 1.0]
    return quad(function, -1.0, 1.0, points=zeros or None, epsabs=0.0, epsrel=1e-10, limit=400)[0]


def work(projection, a, start, x):
    """∫ C ṗ dτ: only the first d + 1 Legendre coefficients of ṗ meet those of C."""
    rates = legendre.legder(series(projection, start, x))
    return float(sum(2.0 / (2 * k + 1) * c * rate for k, (c, rate) in enumerate(zip(a, rates, strict=True))))


@pytest.mark.parametrize("degree", [0, 1, 2])
@pytest.mark.parametrize("q", [1.0, 1.5, 2.0, 3.0, 10.0])
@pytest.mark.parametrize("shape", SHAPES)
def test_the_work_is_what_the_law_stores(degree, q, shape):
    """∫ C ṗ = ΔΦ to a few roundings of Φ, wherever the penetration changes sign."""
    law = Compliance(1e4, q)
    projection = Projection(law, degree)
    start, x = numbers(shape, degree)
    a = projection.force(start, SIZE, x)
    stored = [law.potential(p) for p in (start, x[0])]
    parts = np.abs(a).sum() * (abs(start) + np.abs(x).sum())
    assert work(projection, a, start, x) == pytest.approx(stored[1] - stored[0], abs=16 * EPS * (max(stored) + parts))


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("q", [1.0, 1.5, 3.0])
@pytest.mark.parametrize("shape", SHAPES)
def test_it_is_the_projection_of_the_force(degree, q, shape):
    """Also the coefficient that is left out, against adaptive quadrature; 16 graded points of a power beside its zero
    leave 1e-7 of the largest force."""
    law = Compliance(1e4, q)
    projection = Projection(law, degree)
    start, x = numbers(shape, degree)
    c = series(projection, start, x)
    largest = law.force(float(np.abs(legendre.legval(np.linspace(-1, 1, 50), c)).max()))
    for k, value in enumerate([*projection.force(start, SIZE, x), projection.next_coefficient(start, x)]):
        unit = [0.0] * k + [1.0]
        exact = (k + 0.5) * integral(lambda s, e=unit: law.force(legendre.legval(s, c)) * legendre.legval(s, e), c)
        assert value == pytest.approx(exact, abs=1e-7 * largest)


@given(
    start=st.floats(-1e-2, 1e-2), end=st.floats(-1e-2, 1e-2), mean=st.floats(-1e-2, 1e-2), skew=st.floats(-5e-3, 5e-3),
    degree=st.sampled_from([0, 1, 2]), q=st.floats(1.0, 4.0), chi=st.floats(0.0, 3.0),
)  # fmt: skip
@example(start=0.0, end=2.9e-158, mean=2.9e-158, skew=0.0, degree=2, q=1.0, chi=0.0)
def test_damping_never_gives_energy(start, end, mean, skew, degree, q, chi):
    """To 64 roundings of the energies; below 1e-308 J a rounding is the smallest double, whatever their size."""
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


# -- degree 0: the discrete gradient ----------------------------------------------------------------------------------


@pytest.mark.parametrize("q", [1.0, 1.5, 3.0])
@pytest.mark.parametrize("change", [0.0, 1e-14, 1e-9, 1e-4, -1e-4])
def test_small_changes_do_not_cancel(change, q):
    """DG = λp^q (1 + q δ/2 + q(q−1) δ²/6 + …) for p1 = p(1 + δ): the quotient would lose EPS/δ."""
    p, law = 2e-3, Compliance(1e4, q)
    exact = law.force(p) * (1.0 + q * change / 2 + q * (q - 1.0) * change**2 / 6)
    # The next term is q(q−1)(q−2) δ³/24 ≤ δ³/4.
    found = Projection(law, 0).force(p, SIZE, [p * (1.0 + change)])[0]
    assert found == pytest.approx(exact, rel=8 * EPS + abs(change) ** 3)
