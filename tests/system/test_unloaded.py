"""Where the spring is without force: `unloaded` of [spring].

A linear spring that is unloaded at y₀ is one that is unloaded at 0 under a further load k1 y₀, whatever it meets.
"""

import numpy as np
import pytest
import scenes

from springbeam import simulate, with_changes
from springbeam.monolithic.event_driven import integrate as reference
from springbeam.scene import scene_from_dict

LOWER = 3.0  # N/m
Y0 = -0.02  # m
PAIR = {
    "time": {"t_end": 0.3},
    "beam": {"young_modulus": 100.0, "shear_modulus": 100.0, "initial_velocity_slope": -1.0, "n_elements": 6},
    "spring": {"mass": 1.0, "linear_stiffness": LOWER},
    "stop": {"position": -0.015},
    "coupling": {"macro_step": 1e-3},
}
SOFT = {"stiffness": 1e4, "exponent": 1.5}


@pytest.mark.parametrize(
    "tables",
    [
        {},
        {"contact": {"law": "compliance", **SOFT}},
        {"contact": {"law": "tie"}},
        {"contact": {"law": "link", "stiffness": 1e4}},
        {"beam": {"fidelity": "quasi_static"}},
    ],
    ids=["transmission", "compliance", "tie", "link", "quasi static"],
)
@pytest.mark.parametrize("program", [simulate, reference])
def test_a_linear_spring_is_one_under_the_load_of_its_preload(program, tables):
    scene = with_changes(scene_from_dict(PAIR), **tables)
    moved = program(with_changes(scene, spring={"unloaded": Y0}))
    loaded = program(with_changes(scene, spring={"external_force": LOWER * Y0}))
    assert scenes.kinds(moved) == scenes.kinds(loaded)
    for column in ("u_tip", "y", "contact_force", "foundation_force"):
        scale = np.abs(loaded[column]).max()
        np.testing.assert_allclose(moved[column], loaded[column], atol=1e-9 * scale)
    stored = 0.5 * LOWER * Y0**2  # that the load has not
    total = moved.e_total - stored - loaded.e_total
    np.testing.assert_allclose(total, 0.0, atol=1e-12)
