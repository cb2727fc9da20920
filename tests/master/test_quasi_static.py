"""A beam without inertia: statics against the mesh, the joined motion against its closed form, the ledger."""

import numpy as np
import pytest
from bodies import pair_of
from scenes import scene_from_dict

from springbeam.bodies.quasi_static import QuasiStaticBeam
from springbeam.monolithic.event_driven import integrate as reference
from springbeam.monolithic.semi_discrete import assemble, constant_forces
from springbeam.scene import Beam, load_scene, statics, with_changes
from springbeam.scene.statics import SHAPE_POINTS
from springbeam.studies.linearised import contact_energy

BEAM = Beam.with_ones(
    density=2.0, area=0.5, second_moment_of_area=0.3, young_modulus=30.0, shear_modulus=50.0, shear_coefficient=0.8,
    length=1.3, n_elements=4, distributed_load=-1.5, tip_load_coefficient=4.0,
)  # fmt: skip


# -- statics --------------------------------------------------------------------------------------------------------


def test_statics_are_those_of_a_mesh_that_holds_them():
    """Degree 5 holds the deflection under a load that is linear in each element (u of degree 5, θ of degree 4)."""
    d = assemble(BEAM.model_copy(update={"element_degree": 5}))
    load = d.nodal(*constant_forces(BEAM.model_copy(update={"element_degree": 5})))
    by_force = np.linalg.solve(d.K, d.tip_vector)
    by_load = np.linalg.solve(d.K, load)
    assert statics.tip_compliance(BEAM) == pytest.approx(by_force[d.tip], rel=1e-12)
    assert statics.tip_load_deflection(BEAM) == pytest.approx(by_load[d.tip], rel=1e-12)
    assert statics.load_energy(BEAM) == pytest.approx(load @ by_load, rel=1e-12)
    hanging = BEAM.model_copy(update={"tip_load_coefficient": 0.0})
    assert statics.tip_reach(hanging) == -statics.tip_load_deflection(hanging) > 0.0
    moving = BEAM.model_copy(update={"initial_velocity_slope": -30.0})
    energy = 0.5 * (30.0 * d.slope_shape) @ d.M @ (30.0 * d.slope_shape)  # that is ½ F²/k with u = F/k
    assert statics.tip_reach(moving) == pytest.approx(np.sqrt(2.0 * energy * by_force[d.tip]), rel=0.02)
    at_rest = QuasiStaticBeam(BEAM, 0, statics.tip_load_deflection(BEAM), 0.0).energies()
    assert at_rest.potential == pytest.approx(0.5 * load @ by_load, rel=1e-12)
    sampler = d.interpolated()
    np.testing.assert_allclose(statics.tip_force_shape(BEAM, SHAPE_POINTS), sampler @ by_force, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(statics.load_shape(BEAM, SHAPE_POINTS), sampler @ by_load, rtol=1e-11, atol=1e-15)
    shape = by_force / by_force[d.tip]
    assert statics.tip_inertia(BEAM) == pytest.approx(shape @ d.M @ shape, rel=1e-12)


# -- the pair -------------------------------------------------------------------------------------------------------


def scene(**tables):
    """A stiff beam under a load on a spring that it meets in motion; no cubic term, no foundation."""
    data = {
        "time": {"t_end": 0.7},
        "beam": {
            "fidelity": "quasi_static", "young_modulus": 30.0, "shear_modulus": 50.0, "density": 0.1,
            "distributed_load": -1.0, "initial_velocity_slope": -1.0,
        },
        "spring": {"mass": 2.0, "linear_stiffness": 3.0, "initial_velocity": -0.5},
        "coupling": {"macro_step": 0.01},
    }  # fmt: skip
    return scene_from_dict({table: {**data.get(table, {}), **tables.get(table, {})} for table in {**data, **tables}})


def test_what_holds_the_ends_is_the_force_of_the_reference():
    given = scene(stop={"position": -0.05}, beam={"alpha_b": 0.02})
    exact = reference(given)
    joined = np.isin(exact.phase, ("tied", "touch"))
    y, z, force = (exact[name][joined] for name in ("y", "z", "contact_force"))
    with pair_of(given) as pair:
        found = pair.upper.holding_force(y, z)
    np.testing.assert_allclose(found, force, rtol=1e-9, atol=1e-12 / statics.tip_compliance(given.beam))


def test_the_energy_at_contact_is_that_of_the_start_and_of_loads():
    """½ ∫ρA (s₁x)² dx, ½ KAG L s₀², and 2 F²/k, F the tip force that bends a slender beam as far as the load."""
    beam = {"approach": "elastic", "initial_deflection_slope": 0.01, "n_elements": 4}
    load = {"on": "beam", "shape": [1.0, 2.0], "amplitude": 5.0}
    scene = with_changes(load_scene("soft"), beam=beam, loads=[load])
    own = scene.beam
    start = own.density * own.area * own.initial_velocity_slope**2 * own.length**3 / 6.0
    start += 0.5 * statics.shear_stiffness(own) * own.length * 0.01**2
    force = 5.0 * own.length * ((0.5 - 0.125) + 2.0 * (3.0 / 8.0 - 0.1))  # ∫ (1 + 2ξ) ξ² (3 − ξ)/2 dξ
    expected = start + 2.0 * force**2 * statics.tip_compliance(own)
    assert contact_energy(scene) == pytest.approx(expected, rel=1e-12)
