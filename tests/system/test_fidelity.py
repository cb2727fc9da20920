"""As much model as a scene needs: elements of any degree."""

from __future__ import annotations

from contextlib import closing

import numpy as np
import pytest

from springbeam.fmu import FmuBeam
from springbeam.monolithic.semi_discrete import modal_beam
from springbeam.scene import Beam
from springbeam.subsystem import NO_FORCE


@pytest.mark.parametrize("reduced", [False, True])
@pytest.mark.parametrize(("degree", "n"), [(1, 12), (2, 6), (3, 4), (5, 2), (12, 1)])
def test_the_fmu_vibrates_with_the_frequencies_of_the_reference(degree, n, reduced):
    """After a unit tip impulse v_tip(t) = Σ φ_k(L)² cos ω_k t: every frequency and every tip value takes part."""
    beam = Beam(young_modulus=3.0, shear_modulus=7.0, n_elements=n, element_degree=degree, reduced_integration=reduced)
    modes, size = modal_beam(beam), 0.05
    with closing(FmuBeam(beam, 0.0, 0.0)) as body:
        assert 1.0 / body.mass == pytest.approx(modes.inverse_tip_mass, rel=1e-12)
        body.apply_impulse(1.0)
        for step in range(40):
            body.advance(step * size, size, NO_FORCE)
            t = (step + 1) * size
            exact = np.sum(modes.tip**2 * np.cos(modes.omega * t))
            # Two independent eigenproblems: ω_max t ≈ 500 rad with frequencies to 1e-13.
            assert body.motion().velocity == pytest.approx(exact, abs=1e-10 * modes.inverse_tip_mass)
