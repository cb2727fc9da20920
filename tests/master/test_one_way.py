"""One-way coupling: what it neglects stays below the bound, one body steps once, the ledger closes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest
from bodies import simulate, stopping, unit_beam

from springbeam.bodies.elements import RigidWall
from springbeam.bodies.protocol import NO_FORCE, Force, Motion
from springbeam.contact.laws import Compliance
from springbeam.coupling.one_way import OneWay
from springbeam.coupling.projection import Projection
from springbeam.coupling.protocol import Step
from springbeam.results.steps import STEP
from springbeam.run.neglect import Past, neglected
from springbeam.run.outcome import RunStopped
from springbeam.scene import Beam, Scene, SceneError, load_scene, statics, with_changes

LAW = (100.0, 1.0)


def scene(**tables: dict[str, Any]) -> Scene:
    """`soft` with normal compliance on a beam some 1e4 times stiffer than the contact."""
    base: dict[str, dict[str, Any]] = {
        "time": {"t_end": 0.04},
        "contact": {"law": "compliance", "stiffness": LAW[0], "exponent": LAW[1]},
        "beam": {"young_modulus": 1e6, "shear_modulus": 1e6, "n_elements": 8},
        "coupling": {"macro_step": 2e-4, "feedback_tolerance": 0.1},
    }
    return with_changes(load_scene("soft"), **{t: {**base.get(t, {}), **tables.get(t, {})} for t in {**base, **tables}})


HEAVY = {"mass": 100.0, "linear_stiffness": 1e6, "cubic_stiffness": 0.0, "initial_velocity": 0.5}
CASES: dict[str, tuple[str, dict[str, dict[str, Any]]]] = {
    "rings": ("beam_drives", {}),
    "damped": ("beam_drives", {"beam": {"alpha_b": 1e-3, "n_elements": 2}}),
    "Hertz": ("beam_drives", {"contact": {"exponent": 1.5, "stiffness": 1e3}}),
    "lossy foundation": (
        "beam_drives",
        {"stop": {"position": -0.002, "restitution": 0.3}, "spring": {"external_force": -0.5}},
    ),
    "heavy spring": ("spring_drives", {"beam": {"young_modulus": 100.0, "shear_modulus": 100.0}, "spring": HEAVY}),
}


@pytest.mark.parametrize("what", CASES)
def test_what_is_neglected_is_below_the_bound(what: str) -> None:
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


def test_the_driving_body_steps_once_a_macro_step() -> None:
    for feedback, driver, changes in (
        ("beam_drives", "beam", {}),
        ("spring_drives", "spring", CASES["heavy spring"][1]),
    ):
        two_way = simulate(scene(**changes))
        one_way = simulate(scene(**{**changes, "coupling": {"feedback": feedback}}))
        assert one_way.summary["work"][driver] == one_way.summary["macro_steps"] == 200
        assert two_way.summary["work"][driver] > 1.2 * 200


def test_the_driving_body_moves_as_if_alone() -> None:
    alone = simulate(scene(time={"t_end": 0.02}, contact={"stiffness": 1e-300}))
    driving = simulate(scene(time={"t_end": 0.02}, coupling={"feedback": "beam_drives"}))
    assert np.array_equal(alone.u_tip, driving.u_tip)
    assert driving.contact_force.max() > 0.0


def test_a_resonant_force_keeps_to_the_bound() -> None:
    """The worst case: a force that reverses in step with the first mode adds 2 φ²C/ω² each half period."""
    beam = Beam.with_ones(n_elements=5, young_modulus=100.0, shear_modulus=100.0)
    stiffness = 1.0 / statics.tip_compliance(beam)
    body = unit_beam(5, slope=0.0)
    half = np.pi / body.omega[0]
    variation = previous = largest = 0.0
    for step in range(40):
        force = 1.0 if step % 2 else -1.0
        variation, previous = variation + abs(force - previous), force
        for _ in range(8):
            body.mark()
            body.advance(0.0, half / 8, (force, 0.0, 0.0))
            largest = max(largest, abs(body.motion().displacement))
        assert largest < 2.0 * variation / stiffness
    # The first mode carries most of the static compliance, and it is driven as hard as can be.
    assert largest > 0.5 * 2.0 * variation / stiffness * (body.b[0] / body.omega[0]) ** 2 * stiffness


def test_both_ends_known_leave_nothing_to_solve() -> None:
    """The beam drives and the spring is seated: C is the discrete gradient of where the tip has gone."""
    beam, start = unit_beam(6), 1e-3
    beam.mark()
    law = Compliance(*LAW)
    one_way = OneWay(law, 0, 1e-12, upper_drives=True)
    ends = (beam.motion()._replace(displacement=-start), RigidWall(0.0).motion())
    force = one_way.solve(beam, RigidWall(0.0), 0.0, 0.01, ends, (5.0, 0.0, 0.0)).contact
    assert force == (Projection(law, 0).force(start, 0.01, [-beam.motion().displacement])[0], 0.0, 0.0)
    assert beam.steps == 1


def test_the_work_on_the_end_that_does_not_feel_the_force_is_booked() -> None:
    one_way = OneWay(Compliance(*LAW), 0, 1e-12, upper_drives=True)
    tip = 0.0
    for force, moved, depth in ((2.0, -0.1, 0.02), (5.0, 0.2, 0.05), (1.0, 0.3, 0.01), (0.0, 0.0, -0.2)):
        before, tip = tip, tip + moved
        ends = [(Motion(u, 0.0, 0.0, 0.0), Motion(u + depth, 0.0, 0.0, 0.0)) for u in (before, tip)]
        one_way.accept(Step(0.0, 1.0, (force, 0.0, 0.0), NO_FORCE, *ends))
    assert one_way.booking(ends[1]).unfelt == pytest.approx(2.0 * -0.1 + 5.0 * 0.2 + 1.0 * 0.3)


def steps_under(forces: Iterable[Force], depths: Iterable[float]) -> np.ndarray:
    """Steps of 1 s under these forces, at whose ends the tip has sunk so deep [m]."""
    table = np.array(list(forces))
    steps = np.zeros(len(table), STEP)
    steps["size"], steps["y"] = 1.0, list(depths)
    for name, values in zip(("", "_rate", "_rate_2"), table.T, strict=True):
        steps[f"contact_force{name}"] = values
    return steps


def test_what_is_neglected_is_twice_the_variation_of_the_force_over_the_stiffness() -> None:
    """In one look or in several."""
    steps = steps_under([(c, 0.0, 0.0) for c in (2.0, 5.0, 1.0, 0.0)], [0.02, 0.05, 0.01, -0.2])
    bound = neglected(steps, 50.0, Past())
    assert bound.motion == pytest.approx(2.0 * np.cumsum([2.0, 3.0, 4.0, 1.0]) / 50.0)
    assert bound.share == pytest.approx(bound.motion / [0.02, 0.05, 0.05, 0.05])
    past = Past()
    for part in (steps[:1], steps[1:3], steps[3:]):
        motion, _, past = neglected(part, 50.0, past)
    assert motion[-1] == bound.motion[-1]
    assert past == bound.past


def test_the_bound_counts_the_turns_of_a_polynomial_force() -> None:
    """∫|Ċ| of 1 − 6τ + 6τ² over [0, 1]: from 1 down to −1/2 and up again, 3; the jump to its start, 1."""
    for force, expected in (((1.0, 0.0, 0.0), 1.0), ((1.0, -6.0, 0.0), 7.0), ((1.0, -6.0, 12.0), 4.0)):
        assert neglected(steps_under([force], [0.0]), 2.0, Past()).motion[0] == pytest.approx(expected)


def test_a_run_stops_when_the_bound_passes_the_tolerance() -> None:
    allowed = 2e-4
    coupling = {"feedback": "beam_drives", "feedback_tolerance": allowed}
    run, stopped = stopping(scene(contact={"exponent": 1.5, "stiffness": 1e3}, coupling=coupling))
    assert isinstance(stopped, RunStopped)
    for words in ("'beam_drives'", "feedback_tolerance = 0.0002", "'two_way'"):
        assert words in str(stopped)
    assert 0.0 < run.time[-1] < 0.04
    assert allowed < run.summary["neglected_share"] < 1.1 * allowed


def test_an_ordinary_scheme_is_refused() -> None:
    with pytest.raises(SceneError, match='scheme = "energy"'):
        scene(coupling={"feedback": "beam_drives", "scheme": "jacobi"})


def test_the_papers_ratio() -> None:
    """Figure 2: tangent stiffness of the compliance at the depth of the foundation over the beam's, 2.5e-10."""
    paper = load_scene("paper-fig2")
    law, depth = paper.contact, paper.spring.equilibrium - paper.stop.position
    tangent = law.stiffness * law.exponent * depth ** (law.exponent - 1.0)
    assert tangent * statics.tip_compliance(paper.beam) == pytest.approx(2.5e-10, rel=1e-12)
