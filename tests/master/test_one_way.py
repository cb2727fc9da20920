"""One-way coupling: what it neglects stays below the bound, one body steps once, the ledger closes."""

import numpy as np
import pytest
from bodies import DuffingBody, simulate, solve, stopping, unit_beam

from springbeam import RigidWall, RunStopped, load_scene, with_changes
from springbeam.bodies.protocol import NO_FORCE
from springbeam.contact.laws import Compliance
from springbeam.coupling.one_way import OneWay
from springbeam.coupling.protocol import NotConverged, Step
from springbeam.coupling.soft import SoftSolver
from springbeam.results.steps import STEP
from springbeam.run.neglect import Neglect

LAW = (100.0, 1.0)


def scene(**tables):
    """`soft` with normal compliance on a beam some 1e4 times stiffer than the contact."""
    base = {
        "time": {"t_end": 0.04},
        "contact": {"law": "compliance", "stiffness": LAW[0], "exponent": LAW[1]},
        "beam": {"young_modulus": 1e6, "shear_modulus": 1e6, "n_elements": 8},
        "coupling": {"macro_step": 2e-4, "feedback_tolerance": 0.1},
    }
    return with_changes(load_scene("soft"), **{t: {**base.get(t, {}), **tables.get(t, {})} for t in {**base, **tables}})


HEAVY = {"mass": 100.0, "linear_stiffness": 1e6, "cubic_stiffness": 0.0, "initial_velocity": 0.5}
CASES = {
    "rings": ("beam_drives", {}),
    "damped": ("beam_drives", {"beam": {"alpha_b": 1e-3, "n_elements": 2}}),
    "Hertz": ("beam_drives", {"contact": {"exponent": 1.5, "stiffness": 1e3}}),
    "lossy foundation": (
        "beam_drives",
        {"stop": {"position": -0.002, "restitution": 0.3}, "spring": {"external_force": -0.5}},
    ),
    "on the foundation": (
        "beam_drives",
        {"stop": {"position": -1e-6, "restitution": 0.0}, "spring": {"external_force": -5.0}},
    ),
    "heavy spring": ("spring_drives", {"beam": {"young_modulus": 100.0, "shear_modulus": 100.0}, "spring": HEAVY}),
}


@pytest.mark.parametrize("what", CASES)
def test_what_is_neglected_is_below_the_bound(what):
    """|Δu| ≤ 2V/k at the driving end, and not far below: the contact rings at the beam's own frequencies."""
    feedback, changes = CASES[what]
    two_way = simulate(scene(**changes))
    one_way = simulate(scene(**{**changes, "coupling": {"feedback": feedback}}))
    driver, driven = ("u_tip", "y") if feedback == "beam_drives" else ("y", "u_tip")
    _, mine, theirs = np.intersect1d(one_way.time, two_way.time, return_indices=True)
    assert len(mine) > 180
    difference = {name: np.abs(one_way[name][mine] - two_way[name][theirs]).max() for name in (driver, driven)}
    bound = one_way.summary["neglected_motion"]
    assert 0.02 * bound < difference[driver] < bound
    assert difference[driven] < bound
    assert one_way.summary["max_energy_residual"] < 1e-13


def test_a_step_on_the_foundation_is_of_the_degree_asked_for_whatever_was_tried_before(monkeypatch):
    """A step with the lower end let go was tried, found no force above degree 0, and was not taken."""
    coupling = OneWay(Compliance(1e3, 1.5), 2, 1e-12, upper_drives=True)
    beam, top, wall = unit_beam(4), DuffingBody(), RigidWall(0.0)
    aim = SoftSolver.aim

    def fails_above_0(self, *given):
        if self.degree > 0:
            raise NotConverged(1.0, 1)
        return aim(self, *given)

    with monkeypatch.context() as failing:
        failing.setattr(SoftSolver, "aim", fails_above_0)
        assert solve(coupling, 1e-2, beam, top)[1:] == (0.0, 0.0)
    beam.rewind()
    start = beam.motion(), wall.motion()
    contact = solve(coupling, 1e-2, beam, wall)
    coupling.accept(Step(0.0, 1e-2, contact, NO_FORCE, start, (beam.motion(), wall.motion())))
    assert contact[2] != 0.0
    assert coupling.state.reduced == 0


def steps_under(forces, depths):
    """Steps of 1 s under these forces, at whose ends the tip has sunk so deep [m]."""
    table = np.array(list(forces))
    steps = np.zeros(len(table), STEP)
    steps["size"], steps["y"] = 1.0, list(depths)
    for name, values in zip(("", "_rate", "_rate_2"), table.T, strict=True):
        steps[f"contact_force{name}"] = values
    return steps


def test_what_is_neglected_is_twice_the_variation_of_the_force_over_the_stiffness():
    """In one look or in several."""
    steps = steps_under([(c, 0.0, 0.0) for c in (2.0, 5.0, 1.0, 0.0)], [0.02, 0.05, 0.01, -0.2])
    motion, share = Neglect(scene().coupling, 50.0).by(steps)
    assert motion == pytest.approx(2.0 * np.cumsum([2.0, 3.0, 4.0, 1.0]) / 50.0)
    assert share == pytest.approx(motion / [0.02, 0.05, 0.05, 0.05])
    in_parts, event = Neglect(scene().coupling, 50.0), np.zeros(1, STEP)  # a row that ends no step changes nothing
    for part in (steps[:1], event, steps[1:3], steps[3:]):
        last, beside = in_parts.by(part)
    assert (last[-1], beside[-1]) == (motion[-1], share[-1])


def test_the_bound_counts_the_turns_of_a_polynomial_force():
    """∫|Ċ| of 1 − 6τ + 6τ² over [0, 1]: from 1 down to −1/2 and up again, 3; the jump to its start, 1."""
    for force, expected in (((1.0, 0.0, 0.0), 1.0), ((1.0, -6.0, 0.0), 7.0), ((1.0, -6.0, 12.0), 4.0)):
        motion, _ = Neglect(scene().coupling, 2.0).by(steps_under([force], [0.0]))
        assert motion[0] == pytest.approx(expected)


def test_a_run_stops_when_the_bound_passes_the_tolerance():
    allowed = 2e-4
    coupling = {"feedback": "beam_drives", "feedback_tolerance": allowed}
    run, stopped = stopping(scene(contact={"exponent": 1.5, "stiffness": 1e3}, coupling=coupling))
    assert isinstance(stopped, RunStopped)
    for words in ("'beam_drives'", "feedback_tolerance = 0.0002", "'two_way'"):
        assert words in str(stopped)
    assert 0.0 < run.time[-1] < 0.04
    assert allowed < run.summary["neglected_share"] < 1.1 * allowed
