"""The reference's own beam against exact solutions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

from springbeam.monolithic.semi_discrete import assemble, modal_beam
from springbeam.scene import Beam
from springbeam.scene.statics import SHAPE_POINTS
from springbeam.studies.verify.beam import clamped_free_frequencies


def beam(bending: float = 1.0, shear: float = 1.0, **changes: object) -> Beam:
    return Beam.with_ones(young_modulus=bending, shear_modulus=shear, **changes)  # type: ignore[arg-type]


def static_compliance(bending: float, shear: float, n: int, reduced: bool) -> float:
    """Tip deflection of the discrete unit-length beam under a unit tip force, exact."""
    h = 1.0 / n
    if reduced:
        return (1.0 - h**2 / 4.0) / (3.0 * bending) + 1.0 / shear
    return (1.0 / (3.0 * bending) + 1.0 / shear) / (1.0 + shear * h**2 / (12.0 * bending))


@pytest.mark.parametrize("reduced", [False, True])
@pytest.mark.parametrize(("bending", "shear", "n"), [(1.0, 1.0, 1), (2.0, 7.0, 5), (1.0, 1e6, 10), (100.0, 100.0, 50)])
def test_static_tip_deflection_is_the_discrete_one(bending: float, shear: float, n: int, reduced: bool) -> None:
    d = assemble(beam(bending, shear, n_elements=n, reduced_integration=reduced))
    u = spsolve(d.K, d.tip_vector)[d.tip]
    # Rounding × condition number of K, at most about n⁴ KAG/EI here.
    assert u == pytest.approx(static_compliance(bending, shear, n, reduced), rel=1e-8 if shear > 1e5 else 1e-11)


@pytest.mark.parametrize("degree", [3, 4, 7, 12])
@pytest.mark.parametrize("reduced", [False, True])
def test_one_element_of_degree_three_or_more_is_statically_exact(degree: int, reduced: bool) -> None:
    """L³/3EI + L/KAG: under a tip force θ has degree 2 and u degree 3."""
    d = assemble(beam(2.0, 7.0, n_elements=1, element_degree=degree, length=1.5, reduced_integration=reduced))
    u = np.linalg.solve(d.K.toarray(), d.tip_vector)[d.tip]
    # Rounding × condition number of K, some p⁴.
    assert u == pytest.approx(1.5**3 / 6.0 + 1.5 / 7.0, rel=1e-11)


@pytest.mark.parametrize(("degree", "n"), [(1, 40), (2, 16), (3, 8), (4, 5)])
@pytest.mark.parametrize("reduced", [False, True])
def test_the_order_of_the_frequencies_is_twice_the_degree(degree: int, n: int, reduced: bool) -> None:
    exact = np.array(clamped_free_frequencies()[:6])
    assert exact[0] == pytest.approx(1.27396492100357, abs=1e-12)
    elements = {"element_degree": degree, "reduced_integration": reduced}
    errors = [modal_beam(beam(n_elements=m, **elements)).omega[:6] / exact - 1.0 for m in (n, 2 * n)]
    orders = np.log2(errors[0] / errors[1])
    # Of higher degrees the errors of the lowest modes are rounding, those of the highest not small yet.
    judged = orders if degree == 1 else orders[2:4]
    assert np.all(np.abs(judged - 2 * degree) < 0.08 * degree)
    if degree == 1 and not reduced:
        assert errors[1][0] * exact[0] == pytest.approx(1.67e-5, rel=0.3)


def test_frequencies_scale_with_the_root_of_the_stiffness() -> None:
    soft, stiff = modal_beam(beam(n_elements=20)), modal_beam(beam(3.6e10, 3.6e10, n_elements=20))
    np.testing.assert_allclose(stiff.omega, soft.omega * np.sqrt(3.6e10), rtol=1e-12)


@pytest.mark.parametrize("degree", [1, 2, 3, 8, 12])
def test_forms_are_the_integrals_of_polynomials(degree: int) -> None:
    """θ = x^p, u = x^p/2 lie in the space: ∫ of their squares and strains, ∫u and ∫ψₙu in closed form."""
    n, length, p = 2, 1.4, degree
    b = beam(3.0, 5.0, n_elements=n, element_degree=p, length=length, density=7.0, area=0.5,
             second_moment_of_area=0.25)  # fmt: skip
    d = assemble(b)
    # Values at the nodes, which are where u = x of the slope shape says.
    x = d.slope_shape[1::2]
    q = np.zeros(d.size)
    q[0::2], q[1::2] = x**p, 0.5 * x**p
    moment = 3.0 * 0.25 * p * p * length ** (2 * p - 1) / (2 * p - 1)
    slope, product, square = (length ** (2 * p - 1 + k) / (2 * p - 1 + k) for k in range(3))
    shear = 5.0 * 0.5 * (0.25 * p * p * slope - p * product + square)
    assert q @ d.K @ q == pytest.approx(moment + shear, rel=1e-12)
    assert q @ d.M @ q == pytest.approx(7.0 * (0.25 + 0.25 * 0.5) * square, rel=1e-13)
    assert d.uniform_load @ q == pytest.approx(0.5 * length ** (p + 1) / (p + 1), rel=1e-13)
    h = length / n
    left = length - h
    hat = sum(
        sign * (length**k - left**k) / k * factor for sign, k, factor in ((1, p + 2, 1 / h), (-1, p + 1, left / h))
    )
    assert d.hat_load @ q == pytest.approx(0.5 * hat, rel=1e-12)
    np.testing.assert_allclose(d.deflection_sampler() @ q, 0.5 * (SHAPE_POINTS * length) ** p, atol=1e-14)


def test_shape_is_sampled_at_the_agreed_points() -> None:
    d = assemble(beam(n_elements=7, length=3.0))
    np.testing.assert_allclose(d.deflection_sampler() @ d.slope_shape, 3.0 * SHAPE_POINTS, atol=1e-15)


def test_all_modes_reproduce_the_matrices() -> None:
    b = beam(2.0, 9.0, n_elements=6, density=3.0)
    d, m = assemble(b), modal_beam(b)
    identity = np.eye(12)
    np.testing.assert_allclose(m.basis.T @ d.M @ m.basis, identity, atol=1e-13)
    np.testing.assert_allclose(m.basis.T @ d.K @ m.basis, np.diag(m.omega**2), atol=1e-12 * m.omega[-1] ** 2)
    Minv = np.linalg.inv(d.M.toarray())
    assert m.inverse_tip_mass == pytest.approx(Minv[-1, -1], rel=1e-12)


@pytest.mark.parametrize("n_modes", [1, 3, 8])
def test_truncated_beam_keeps_static_answers_and_its_start(n_modes: int) -> None:
    """Tip force, uniform load and u = x lie in the space, however few the modes; the tip is exact under any load."""
    b = beam(
        4.0, 9.0, n_elements=30, n_modes=n_modes, distributed_load=-2.0, tip_load_coefficient=-6.0,
        initial_velocity_slope=-1.0,
    )  # fmt: skip
    d, m = assemble(b), modal_beam(b)
    assert len(m.omega) == n_modes + 3
    assert m.tip**2 @ m.omega**-2.0 == pytest.approx(static_compliance(4.0, 9.0, 30, False), rel=1e-11)
    full = spsolve(d.K, -2.0 * d.uniform_load - 6.0 * d.hat_load)
    assert m.tip @ (m.load / m.omega**2) == pytest.approx(full[d.tip], rel=1e-11)
    uniform = spsolve(d.K, d.uniform_load)
    found = m.basis @ (m.basis.T @ d.uniform_load / m.omega**2)
    np.testing.assert_allclose(found, uniform, atol=1e-11 * abs(uniform).max())
    np.testing.assert_allclose(m.basis @ m.slope_shape, d.slope_shape, atol=1e-12)
    np.testing.assert_allclose(m.omega[:n_modes], modal_beam(b.model_copy(update={"n_modes": 0})).omega[:n_modes])


@pytest.mark.parametrize("key", ["tip_load_coefficient", "initial_deflection_slope", "initial_velocity_slope"])
@pytest.mark.parametrize("value", [1e-300, -6.0])
def test_loads_and_starts_do_not_change_the_basis(key: str, value: float) -> None:
    b = beam(4.0, 9.0, n_elements=30, n_modes=4).model_copy(
        update={"tip_load_coefficient": 0.0, "initial_deflection_slope": 0.0, "initial_velocity_slope": 0.0}
    )
    plain, other = modal_beam(b), modal_beam(b.model_copy(update={key: value}))
    np.testing.assert_array_equal(other.basis, plain.basis)


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_averaged_mass_gains_two_orders_on_a_bar(degree: int) -> None:
    """EI so large that only shear waves are left: ω = 3.5 π; order 2p of the consistent mass, 2p + 2 averaged."""
    for mass_matrix, order in (("consistent", 2 * degree), ("averaged", 2 * degree + 2)):
        errors = []
        for n in (16, 32) if degree == 1 else (8, 16):
            bar = beam(1e13, 1.0, n_elements=n, element_degree=degree, mass_matrix=mass_matrix)
            errors.append(abs(modal_beam(bar).omega[3] / (3.5 * np.pi) - 1.0))
        assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.25)


@pytest.mark.parametrize(("metre", "second"), [(1e-9, 1.0), (1.0, 1e-9), (1e3, 1.0)])
def test_units_do_not_matter(metre: float, second: float) -> None:
    """Rotations are then far larger than displacements: the sparse modes of a beam of micrometres were lost."""

    def slender(metre: float, second: float) -> Beam:
        scales = {"length": metre, "area": 1e-2 * metre**2, "second_moment_of_area": 1e-5 * metre**4}
        stiffness = 1.0 / (metre * second**2)
        mesh = {"n_elements": 22, "element_degree": 12, "n_modes": 19}
        return beam(1e4 * stiffness, 4e3 * stiffness, **scales, density=100.0 / metre**3, **mesh)

    found, expected = modal_beam(slender(metre, second)).omega * second, modal_beam(slender(1.0, 1.0)).omega
    assert found[:19] == pytest.approx(expected[:19], rel=1e-12)
    # The static shapes lie in the span of the modes but for some 1e-6 of them: what is left has lost so many digits.
    assert found[19:] == pytest.approx(expected[19:], rel=1e-8)


def test_sparse_and_dense_modes_span_the_same_space() -> None:
    """Above the dense size the lowest modes come from shift-and-invert; the frequencies must not tell."""
    few = beam(3.6e10, 3.6e10, n_elements=201, n_modes=6)
    sparse, dense = modal_beam(few), modal_beam(few.model_copy(update={"n_modes": 0}))
    np.testing.assert_allclose(sparse.omega[:6], dense.omega[:6], rtol=1e-10)


def test_nearly_all_modes_make_no_dependent_shape() -> None:
    m = modal_beam(beam(n_elements=5, n_modes=9, initial_velocity_slope=-1.0))
    assert len(m.omega) == 10
