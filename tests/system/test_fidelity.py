"""As much model as a scene needs: elements of any degree, a beam without inertia."""

from contextlib import closing

import numpy as np
import pytest
from scenes import scene_from_dict

from springbeam import simulate, with_changes
from springbeam.bodies.fmu_bodies import FmuBeam
from springbeam.bodies.protocol import NO_FORCE
from springbeam.monolithic.semi_discrete import modal_beam
from springbeam.scene import Beam


@pytest.mark.parametrize("reduced", [False, True])
@pytest.mark.parametrize(("degree", "n"), [(1, 12), (2, 6), (3, 4), (5, 2), (12, 1)])
def test_the_fmu_vibrates_with_the_frequencies_of_the_reference(degree, n, reduced):
    """After a unit tip impulse v_tip(t) = Σ φ_k(L)² cos ω_k t: every frequency and every tip value takes part."""
    beam = Beam.with_ones(
        young_modulus=3.0, shear_modulus=7.0, n_elements=n, element_degree=degree, reduced_integration=reduced
    )
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


def quasi_static(**beam):
    """A loaded beam comes down on a heavy spring that moves already."""
    return scene_from_dict(
        {
            "time": {"t_end": 2.0},
            "beam": {
                "fidelity": "quasi_static", "young_modulus": 30.0, "shear_modulus": 50.0, "alpha_b": 0.05,
                "distributed_load": -1.0, "initial_velocity_slope": -1.0, **beam,
            },
            "spring": {"mass": 2.0, "linear_stiffness": 3.0, "initial_velocity": -0.5},
            "coupling": {"degree": 2, "macro_step": 0.01},
        }
    )  # fmt: skip


def test_without_inertia_is_the_limit_of_a_light_beam():
    """The beam FMU at density ρ → 0: the difference is of first order in ρ, through meeting, release and retie."""
    light = simulate(quasi_static())
    differences = []
    for density in (1e-3, 1e-4, 1e-5):
        beam = {"fidelity": "dynamic", "density": density, "element_degree": 4, "n_elements": 2}
        run = simulate(with_changes(light.scene, beam=beam))
        assert [e.kind for e in run.events] == [e.kind for e in light.events] == ["impact", "release", "retie"]
        differences.append(np.abs(np.interp(light.time, run.time, run.y) - light.y)[light.time < 0.8].max())
    assert differences[0] / differences[1] == pytest.approx(10.0, rel=0.01)
    assert differences[1] / differences[2] == pytest.approx(10.0, rel=0.01)
    assert differences[2] < 1e-6
