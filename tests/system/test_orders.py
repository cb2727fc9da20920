"""The order of each scheme, from both sides."""

from functools import cache

import numpy as np
import pytest
from scenes import soft

from springbeam import load_scene, simulate, with_changes
from springbeam.monolithic import event_driven

#: Length of a smooth phase: the tip comes down on the spring at its start, and stays with it [s].
T = 0.064
LAWS = {
    "tie": {"law": "tie"},
    "link": {"law": "link", "stiffness": 1e3, "damping": 1.0},
    "kelvin_voigt": {"law": "kelvin_voigt", "stiffness": 1e6, "exponent": 3.0, "damping": 2.0},
    "compliance": {"law": "compliance", "stiffness": 1e6, "exponent": 3.0},
}
SCHEMES = [
    # The law, scheme and degree, the order, and a number of steps whose errors are above rounding and asymptotic.
    ("tie", "energy", 0, 4, 64),
    ("tie", "energy", 1, 4, 32),
    ("tie", "energy", 2, 8, 8),
    ("link", "energy", 0, 2, 32),
    ("link", "energy", 1, 4, 16),
    ("link", "energy", 2, 6, 16),
    ("kelvin_voigt", "energy", 0, 2, 64),
    ("kelvin_voigt", "energy", 1, 4, 32),
    ("kelvin_voigt", "energy", 2, 6, 16),
    ("compliance", "energy", 0, 2, 64),
    ("compliance", "energy", 1, 4, 32),
    ("compliance", "energy", 2, 6, 16),
    ("compliance", "jacobi", 0, 1, 256),
    ("compliance", "jacobi", 1, 2, 256),
    ("compliance", "gauss_seidel", 0, 1, 256),
    ("compliance", "gauss_seidel", 1, 2, 256),
]


@cache
def halfway(law, scheme, degree, count):
    """Return motions at T/2, and the force of a soft law, by ``count`` steps."""
    contact = LAWS[law]
    coupling = {"scheme": scheme, "degree": degree, "macro_step": T / count}
    scene = soft(3, stop=None, time={"t_end": T}, contact=contact, spring={"damping": 0.5}, coupling=coupling)
    run = simulate(scene, check=False)
    row = np.abs(run.time - 0.5 * T).argmin()
    forces = () if run.scene.contact.rigid else ("contact_force",)
    return np.array([run[name][row] for name in ("u_tip", "y", "v_tip", "z", *forces)])


@pytest.mark.parametrize(("law", "scheme", "degree", "order", "count"), SCHEMES)
def test_order(law, scheme, degree, order, count):
    """Beside degree 2 in 256 steps."""
    exact = halfway(law, "energy", 2, 256)
    coarse, fine = (np.abs(halfway(law, scheme, degree, n) - exact) for n in (count, 2 * count))
    assert np.log2(coarse / fine) == pytest.approx(np.full(len(exact), order), abs=0.25)


def test_order_of_the_force_of_a_tie():
    """The largest error of displacement, velocity and force in the FMUs' first contact, beside the reference."""
    scene = load_scene("soft", ["time.t_end=0.07"])
    errors = []
    for count in (64, 128):
        run = simulate(with_changes(scene, coupling={"degree": 0, "macro_step": 0.07 / count}))
        exact = event_driven.integrate(scene, sample_times=run.time)
        at = np.searchsorted(exact.time, run.time)
        late = run.time > 0.01
        errors.append([np.abs(run[name] - exact[name][at])[late].max() for name in ("y", "z", "contact_force")])
    assert np.log2(np.divide(*errors)) == pytest.approx(np.full(3, 4.0), abs=0.5)
