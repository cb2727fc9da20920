"""What an engineer loads the pair for: forces, moments, stresses, gravity, a start at rest; impacts of the spring."""

import numpy as np
import pytest

X = np.linspace(0.0, 1.0, 21)


def along(k, name):
    return np.array(k.get(*[f"{name}[{i}]" for i in range(1, 22)]))


MESHES = [
    {"n_elements": 13},
    {"n_elements": 13, "integrator": 2, "reduced_integration": True},
    {"n_elements": 20, "n_modes": 4},
    {"n_elements": 7, "element_degree": 3, "mass_matrix": 2},
]


@pytest.mark.parametrize("mesh", MESHES)
def test_a_cantilever_at_rest_has_the_forces_of_statics(beam, mesh):
    """Q = P + q (L − x), M = P (L − x) + q (L − x)²/2, and a point force at x = 0.5: to rounding on any mesh."""
    point, g, height = 0.7, 9.81, 0.1
    k = beam.running(**mesh, initial_state=2, tip_force=2.0, tip_load=0.5, distributed_load=-3.0, gravity=g,
                     section_height=height, **{"point_force[1]": point})  # fmt: skip
    q, P = -3.0 - g, 2.5
    shear = P + q * (1.0 - X) + point * (X <= 0.5)
    moment = P * (1.0 - X) + q * (1.0 - X) ** 2 / 2 + point * np.maximum(0.0, 0.5 - X)
    assert along(k, "shear_force") == pytest.approx(shear, abs=2e-14)
    assert along(k, "bending_moment") == pytest.approx(moment, abs=2e-14)
    assert k.get("clamp_force", "clamp_moment") == pytest.approx([-shear[0], -moment[0]], abs=2e-14)
    assert k.get("max_bending_stress") == pytest.approx(abs(moment).max() * height / 2, rel=1e-13)  # I = 1
    u = k.get("tip_displacement")
    if "n_modes" not in mesh:  # full integration makes linear elements stiffer
        flexible = mesh.get("element_degree", 1) > 1
        exact = P * (1 / 3 + 1) + q * (1 / 8 + 1 / 2) + point * (0.5**2 * (3 - 0.5) / 6 + 0.5)
        assert u == pytest.approx(exact, rel=1e-12 if flexible else 5e-3)
    k.step(0.0, 0.1)
    assert k.get("tip_displacement") == pytest.approx(u, abs=1e-14 * abs(u))
    assert k.get("kinetic_energy") < 1e-24
