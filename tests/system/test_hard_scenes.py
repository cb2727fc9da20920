"""Scenes whose events decide the motion, each against the event-driven reference."""

from __future__ import annotations

import numpy as np
import pytest

from springbeam import simulate
from springbeam.monolithic import event_driven
from springbeam.scene import scene_from_dict, with_changes

#: The spring is past the hilltop of its own potential, √(3/4000) m, while the beam, 25 times stiffer, holds it.
PAST_THE_HILLTOP = {
    "time": {"t_end": 0.4},
    "beam": {"young_modulus": 100.0, "shear_modulus": 100.0, "n_elements": 50, "initial_velocity_slope": -1.0},
    "spring": {"mass": 1.0, "linear_stiffness": 3.0, "cubic_stiffness": -4000.0},
    "coupling": {"scheme": "energy", "degree": 2, "macro_step": 2.5e-4},
}
#: After the second release the ends part and graze each other three times within 1.5 ms.
GRAZING = {
    "time": {"t_end": 0.25},
    "beam": {
        "density": 1.0,
        "shear_coefficient": 1.0,
        "area": 1.1948,
        "second_moment_of_area": 0.00356077,
        "young_modulus": 70526.88,
        "shear_modulus": 31842.07,
        "length": 1.0374,
        "n_elements": 16,
        "initial_velocity_slope": -0.882128,
    },
    "spring": {"mass": 0.03937697, "linear_stiffness": 158.2, "cubic_stiffness": 1641670.0},
    "coupling": {"scheme": "energy", "degree": 2, "macro_step": 3.3e-4},
}


@pytest.mark.parametrize(
    ("tables", "bound"), [(PAST_THE_HILLTOP, 1e-11), (GRAZING, 5e-3)], ids=["past the hilltop", "grazing"]
)
def test_the_motion_is_that_of_the_reference(tables, bound):
    scene = scene_from_dict(tables)
    run = simulate(scene)
    rows = np.arange(0, len(run), 20)
    reference = event_driven.simulate(scene, sample_times=run.time[rows])
    for name in ("u_tip", "y"):
        assert np.abs(run[name][rows] - reference[name]).max() <= bound * np.ptp(reference[name]), name


@pytest.mark.parametrize(
    ("scheme", "degree", "lowest", "highest"),
    [("energy", 1, 3.0, 4.5), ("energy", 2, 4.5, 7.0), ("hermite", 1, 3.5, 5.0), ("hermite", 2, 5.0, 7.0)],
)
def test_times_of_separation_have_the_order_of_the_motion(scheme, degree, lowest, highest):
    """C itself has order degree + 1 at the ends of a step, and carries the image of the mismatch with `energy`; errors
    are means over steps of four sizes, since where in a step a separation falls decides."""
    scene = with_changes(scene_from_dict(GRAZING), time={"t_end": 0.06})
    exact = event_driven.simulate(scene, sample_times=[0.0]).events[-1]

    def error(size):
        coupling = {"scheme": scheme, "degree": degree, "macro_step": size}
        event = simulate(with_changes(scene, coupling=coupling)).events[-1]
        assert (event.kind, exact.kind) == ("separation", "separation")
        return np.log2(abs(event.time - exact.time))

    coarse, fine = (np.mean([error(size / parts) for size in 3.3e-4 * np.linspace(0.85, 1.0, 4)]) for parts in (2, 4))
    assert lowest <= coarse - fine <= highest
