"""A wall that moves as given, below a point mass: beside closed forms."""

import cmath
from math import pi

import numpy as np
import pytest

from springbeam import simulate
from springbeam.scene import scene_from_dict
from springbeam.scene.loads import SIGNALS

#: Of the wall: amplitude [m] and ω [rad/s].
A = 0.01
OMEGA = 20.0 * pi
WALL = {"on": "wall", "signal": "harmonic", "amplitude": A, "frequency": OMEGA / (2.0 * pi)}
#: What rounding leaves of energies after some hundred steps, over the largest.
ROUNDING = 1e-13


def run(contact, macro_step, degree=2, t_end=0.3, load=WALL, **mass):
    tables = {
        "time": {"t_end": t_end},
        "beam": {"element": "point_mass", "mass": 1.0, **mass},
        "spring": {"element": "moving_wall"},
        "contact": contact,
        "coupling": {"macro_step": macro_step, "degree": degree},
        "loads": [load],
    }
    return simulate(scene_from_dict(tables))


def driven(t, k, c):
    """Return u of ü + c (u̇ − ẏ) + k (u − y) = 0 from rest, y = A sin ωt: a forced motion and a free one."""
    forced = A * (k + 1j * c * OMEGA) / (k - OMEGA**2 + 1j * c * OMEGA)
    fast = complex(-0.5 * c, cmath.sqrt(k - 0.25 * c**2).real)
    # Im(forced e^{iωt}) + Re(free e^{fast t}) with u(0) = u̇(0) = 0.
    real = -forced.imag
    free = complex(real, (real * fast.real + OMEGA * forced.real) / fast.imag)
    return (forced * np.exp(1j * OMEGA * t)).imag + (free * np.exp(fast * t)).real


@pytest.mark.parametrize(("degree", "order", "size"), [(0, 2, 1e-3), (1, 4, 1e-3), (2, 6, 4e-3)])
def test_a_mass_on_a_link_follows_with_the_order_of_the_degree(degree, order, size):
    law = {"law": "link", "stiffness": 5e3, "damping": 20.0}
    errors = []
    for H in (size, 0.5 * size):
        found = run(law, H, degree)
        errors.append(np.abs(found.u_tip - driven(found.time, 5e3, 20.0)).max())
        assert found.summary["max_energy_residual"] < ROUNDING
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.3)


def test_a_mass_that_is_tied_to_it_feels_its_acceleration():
    """C = m ÿ. Its error is that of ÿ, by differences of fourth order over H/256: (ωH/256)⁴/5, and their rounding, of
    which 128/12 add up: of the speed, and of the time by ÿ."""
    found = run({"law": "tie"}, 1e-3, velocity=A * OMEGA)
    exact = -A * OMEGA**2 * np.sin(OMEGA * found.time)
    rounding = 2.0**-52 * (A * OMEGA + 0.3 * A * OMEGA**2)
    bound = A * OMEGA**2 * (OMEGA * 1e-3 / 256.0) ** 4 / 5.0 + 128.0 / 12.0 * rounding / (1e-3 / 256.0)
    assert np.abs(found.contact_force - exact).max() < bound
    assert found.summary["max_energy_residual"] < ROUNDING


def test_a_cam_is_where_its_table_has_it(tmp_path):
    """A cubic table of A (1 − cos ωt)/2; what is tied to it is there, too."""
    t = np.linspace(0.0, 0.3, 301)
    file = tmp_path / "cam.csv"
    np.savetxt(file, np.column_stack([t, 0.5 * A * (1.0 - np.cos(OMEGA * t))]), delimiter=",")
    cam = {"on": "wall", "signal": "table", "file": str(file), "interpolation": "cubic"}
    found = run({"law": "tie"}, 1e-3, load=cam)
    exact = 0.5 * A * (1.0 - np.cos(OMEGA * found.time))
    # A not-a-knot spline is right to (ωΔ)⁴ near its ends, 5/384 of that within.
    assert np.abs(found.u_tip - exact).max() < 0.5 * A * (OMEGA * 1e-3) ** 4
    assert found.summary["max_energy_residual"] < ROUNDING


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
