"""Each contact of a run by itself: against exact bounces, and all of them together against the results of the run."""

import numpy as np
import pytest

from springbeam import load, simulate

MASS = 0.5  # kg
SPEED = 2.0  # m/s
STIFFNESS = 1e5  # N/m
OMEGA = np.sqrt(STIFFNESS / MASS)
BALL = {"element": "point_mass", "mass": MASS, "velocity": -SPEED, "displacement": 0.1}
ON_WALL = {"time": {"t_end": 0.1}, "beam": BALL, "spring": {"element": "rigid_wall"}}


@pytest.mark.parametrize("degree", [1, 2])
def test_an_elastic_bounce(degree):
    """Half a period of m and λ; ten steps in it, of which none has its deepest place at a row."""
    run = simulate(
        ON_WALL
        | {
            "contact": {"law": "compliance", "stiffness": STIFFNESS, "exponent": 1.0},
            "coupling": {"macro_step": 0.1 * np.pi / OMEGA, "degree": degree},
        }
    )
    (contact,) = run.contacts
    close = 2e-3 if degree == 1 else 2e-5
    assert contact.begin == pytest.approx(0.05, rel=1e-3)
    assert contact.duration == pytest.approx(np.pi / OMEGA, rel=close)
    assert contact.impulse == pytest.approx(2.0 * MASS * SPEED, rel=1e-12)
    assert contact.peak_force == pytest.approx(SPEED * np.sqrt(STIFFNESS * MASS), rel=close)
    assert contact.peak_time == pytest.approx(contact.begin + 0.5 * contact.duration, abs=1e-3 * contact.duration)
    assert contact.depth == pytest.approx(SPEED / OMEGA, rel=close)
    assert contact.loss == 0.0
    velocities = contact.v_tip_before, contact.z_before, contact.v_tip_after, contact.z_after
    assert velocities == pytest.approx((-SPEED, 0.0, SPEED, 0.0), rel=100.0 * close, abs=0.0)
    assert run.summary["contact_force_max"] == contact.peak_force
    assert "contact_force_window" not in run.summary


def test_the_peak_of_a_link_is_that_of_its_law():
    """Two masses of 1 kg: v √(k μ), with 100 steps of 0.9 rad each; a mean over a window had been 1.4 N."""
    k = 1e5
    omega = np.sqrt(2.0 * k)
    run = simulate({
        "time": {"t_end": 100 * 0.9 / omega},
        "beam": {"element": "point_mass", "mass": 1.0, "velocity": -1.0},
        "spring": {"element": "point_mass", "mass": 1.0},
        "contact": {"law": "link", "stiffness": k},
        "coupling": {"macro_step": 0.9 / omega},
    })  # fmt: skip
    assert run.summary["contact_force_max"] == pytest.approx(np.sqrt(0.5 * k), rel=1e-4)
    assert run.contacts == []


def test_an_impact_on_a_stop_has_no_length():
    """The impulse (1 + e) m v, a mean over the window; ½ m v² (1 − e²) is lost."""
    run = simulate({
        "time": {"t_end": 0.1},
        "beam": BALL,
        "stop": {"position": 0.0, "restitution": 0.5},
        "contact": {"force_window": 1e-3},
        "coupling": {"macro_step": 1e-3},
    })  # fmt: skip
    (contact,) = run.contacts
    impulse = 1.5 * MASS * SPEED
    assert contact[:2] == (pytest.approx(0.05, rel=1e-12), 0.0)
    assert contact.impulse == pytest.approx(impulse, rel=1e-14)
    assert contact.peak_force == pytest.approx(impulse / 1e-3, rel=1e-14)
    assert contact.loss == pytest.approx(0.5 * MASS * SPEED**2 * 0.75, rel=1e-14)
    assert (contact.closing, contact.opening) == pytest.approx((SPEED, 0.5 * SPEED), rel=1e-14)


@pytest.mark.parametrize("scene", ["soft", "vibro-impact", "beam-on-stop", "steel-bumper"])
def test_all_contacts_together_are_the_results_of_the_run(scene, tmp_path):
    run = simulate(scene)
    found = run.contacts
    summary = run.summary
    assert len(found) == summary["number_of_contacts"]
    assert sum(contact.impulse for contact in found) == pytest.approx(summary["contact_impulse"], rel=1e-12)
    assert sum(contact.duration for contact in found) == pytest.approx(summary["contact_duration_total"], rel=1e-12)
    assert max(contact.peak_force for contact in found) <= summary["contact_force_max"] * (1.0 + 1e-12)
    lost = {"soft": "loss_impact", "vibro-impact": "loss_contact", "steel-bumper": "loss_impact"}
    assert sum(contact.loss for contact in found) == pytest.approx(summary[lost.get(scene, "loss_stop")], rel=1e-12)
    # The file has them, and they follow from the others if it is lost.
    directory = run.save(tmp_path / "run")
    table = np.genfromtxt(directory / "contacts.csv", delimiter=",", names=True)
    np.testing.assert_array_equal(table["impulse"], [contact.impulse for contact in found])
    assert load(directory).contacts == found
