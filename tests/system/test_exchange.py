"""What ordinary masters do, measured against the energy scheme and the reference."""

import numpy as np
import pytest

from springbeam import RunStopped, load_scene, simulate, with_changes
from springbeam.monolithic import event_driven

ORDINARY = [("jacobi", 0), ("jacobi", 1), ("gauss_seidel", 0), ("gauss_seidel", 1)]


def soft(stiffness, size, scheme, degree, t_end):
    law = {"law": "compliance", "stiffness": stiffness, "exponent": 1.0}
    coupling = {"scheme": scheme, "degree": degree, "macro_step": size}
    return with_changes(load_scene("soft"), time={"t_end": t_end}, contact=law, coupling=coupling)


@pytest.mark.parametrize(("scheme", "degree"), ORDINARY)
def test_a_stiff_contact_gains_energy_and_the_run_says_so(scheme, degree):
    with pytest.raises(RunStopped, match=f"{scheme} of degree {degree}"):
        simulate(soft(1e8, 0.004, scheme, degree, 0.2))


@pytest.mark.parametrize("scheme", ["jacobi", "gauss_seidel"])
def test_what_the_law_dissipates_is_booked(scheme):
    """χ = 0.5 s/m: what is left once that is booked is of order 1, and far below what the law takes."""
    left = []
    for size in (2e-5, 1e-5):
        scene = soft(1e3, size, scheme, 0, 0.02)
        run = simulate(with_changes(scene, contact={"damping": 0.5, "exponent": 1.5}))
        left.append(run.summary["max_energy_residual_joule"])
    assert np.log2(left[0] / left[1]) == pytest.approx(1.0, abs=0.1)
    assert run.e_dissipated[-1] > 100.0 * left[1]


@pytest.mark.parametrize(("scheme", "degree"), ORDINARY)
def test_order_is_degree_plus_one_where_the_contact_is_resolved(scheme, degree):
    """λ = 100 N/m: ω_contact H = √(λ/m_tip) H ≤ 0.07; displacement of the spring while the contact lasts."""
    errors = []
    for size in (4e-4, 2e-4):
        scene = soft(100.0, size, scheme, degree, 0.03)
        trajectory = simulate(scene)
        reference = event_driven.simulate(scene, sample_times=trajectory.time)
        errors.append(np.abs(trajectory.y - reference.y).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(degree + 1, abs=0.4)
