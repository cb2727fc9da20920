"""A wall that moves as a table has it; closed forms of others are cases of tests/scenes.toml."""

import numpy as np
import pytest
import scenes

from springbeam import simulate, with_changes
from springbeam.scene.loads import SIGNALS


def test_a_cam_is_where_its_table_has_it(tmp_path):
    """A cubic table of A (1 − cos ωt)/2; what is tied to it is there, too."""
    A = 0.01
    omega = 20.0 * np.pi
    t = np.linspace(0.0, 0.3, 301)
    file = tmp_path / "cam.csv"
    np.savetxt(file, np.column_stack([t, 0.5 * A * (1.0 - np.cos(omega * t))]), delimiter=",")
    load = {"on": "wall", "signal": "table", "file": str(file), "interpolation": "cubic", "amplitude": 1.0}
    rest = {"beam": {"velocity": 0.0, "external_force": 0.0}, "contact": {"law": "tie"}, "time": {"t_end": 0.3}}
    run = simulate(with_changes(scenes.named("shaking table"), **rest, loads=[load]))
    # A not-a-knot spline is right to (ωΔ)⁴ near its ends, 5/384 of that within.
    assert np.abs(run.u_tip - 0.5 * A * (1.0 - np.cos(omega * run.time))).max() < 0.5 * A * (omega * 1e-3) ** 4
    assert run.summary["max_energy_residual"] < 1e-13


KEYS = {
    "harmonic": {"frequency": 7.0, "phase": 0.3},
    "chirp": {"frequency": 3.0, "frequency_end": 9.0, "duration": 0.4},
    "half_sine": {"duration": 0.4},
    "sawtooth": {"duration": 0.4},
    "trapezoid": {"duration": 0.4, "rise": 0.1},
    "ramp": {"duration": 0.2},
}


@pytest.mark.parametrize("signal", sorted(set(SIGNALS) - {"table"}))
def test_the_change_of_a_signal_is_its_derivative(signal):
    """By a central difference of 1e-5 s, right to (ωh)²/6 of the rate: 1e-7 of it, and rounding 1e-10/s."""
    load = SIGNALS[signal](on="wall", amplitude=2.0, signal=signal, **KEYS.get(signal, {}))
    t = np.array([0.013, 0.07, 0.15, 0.27, 0.33])
    h = 1e-5
    by_difference = (load.value(t + h) - load.value(t - h)) / (2.0 * h)
    assert load.change(t) == pytest.approx(by_difference, rel=1e-6, abs=1e-4)
