"""Short steps do not make a run worse: its errors fall to rounding and stay there."""

import numpy as np
import pytest

from springbeam import simulate

#: Two oscillators that meet several times, or that are joined from the start.
ENDS = {
    "time": {"t_end": 0.1},
    "beam": {"element": "spring_damper", "mass": 2.0, "stiffness": 400.0, "damping": 0.3, "velocity": -1.0},
    "spring": {"element": "spring_damper", "mass": 0.5, "stiffness": 3000.0, "damping": 1.5},
}
LAWS = {
    "compliance": {"law": "compliance", "stiffness": 1e5, "exponent": 1.5, "damping": 0.2},
    "link": {"law": "link", "stiffness": 1e4, "damping": 1.0},
    "tie": {"law": "tie"},
}
#: At degree 2 a number of steps whose own error is below rounding: it is of order 6, and 2e-6 for 50 steps.
FEW = 1600


def end_of(law, degree, steps):
    """Return both displacements at the end [m], and the energy residual."""
    start = {"displacement": 0.003, "rest": 0.003} if law == "compliance" else {}
    scene = ENDS | {"beam": ENDS["beam"] | start, "contact": LAWS[law]}
    run = simulate(scene | {"coupling": {"macro_step": 0.1 / steps, "degree": degree}})
    return np.array([run[name][-1] for name in ("u_tip", "y")]), run.summary["max_energy_residual"]


@pytest.mark.parametrize("law", LAWS)
def test_errors_fall_to_rounding_and_stay_there(law):
    """A rounding a step adds up to its square root of so many; it had been 1e-7 with 51,200 steps."""
    few, kept = end_of(law, 2, FEW)
    many = 16 * FEW
    found, still_kept = end_of(law, 2, many)
    rounding = np.sqrt(many) * 16.0 * np.finfo(float).eps
    np.testing.assert_allclose(found, few, rtol=rounding)
    assert max(kept, still_kept) < rounding
