"""``scheme = "auto"``: what it takes for which scene, and that what it takes is stable."""

import numpy as np
import pytest

from springbeam import load_scene, simulate, with_changes
from springbeam.scene.linearised import contact_energy, spring_frequency, spring_stiffness
from springbeam.scene.resolution import STABLE, choice, mesh_frequency, slowest_frequency, with_scheme_chosen
from springbeam.scene.statics import resting_height, tip_compliance
from springbeam.scene.tables import Spring

PAIR = load_scene("soft")


def auto(scene=PAIR, **changes):
    return with_changes(scene, coupling={"scheme": "auto", "degree": 0, **changes.pop("coupling", {})}, **changes)


@pytest.mark.parametrize(
    ("name", "expected"),
    [("soft", ("hermite", 2)), ("beam-on-stop", ("hermite", 2)), ("steel-bumper", ("energy", 2)),
     ("bar-impact", ("energy", 2)), ("paper-fig2", ("energy", 0)), ("duffing", ("energy", 0))],
)  # fmt: skip
def test_what_the_shipped_scenes_get(name, expected):
    assert choice(load_scene(name))[:2] == expected


@pytest.mark.parametrize(("share", "expected"), [(0.99, ("hermite", 2)), (1.01, ("energy", 2))])
def test_the_bound_is_on_the_fastest_frequency(share, expected):
    H = share * STABLE / mesh_frequency(PAIR.beam)
    assert choice(auto(coupling={"macro_step": H}))[:2] == expected
    stiff = {"spring": {"linear_stiffness": 1e8, "cubic_stiffness": 0.0}}
    spring = with_changes(PAIR, **stiff)
    assert spring_frequency(spring) == 1e4 > mesh_frequency(PAIR.beam)
    assert choice(auto(spring, coupling={"macro_step": share * STABLE / 1e4}))[:2] == expected


LONG, HARD = with_changes(PAIR, beam={"length": 2.0}), {"cubic_stiffness": 400.0}
PUSHES = [{"on": "spring", "amplitude": amplitude} for amplitude in (1.0, -2.0)]
BENT = {"initial_deflection_slope": 0.1}


@pytest.mark.parametrize(
    ("changes", "energy"),
    [
        ({}, 8.0 / 6.0),  # of u̇ = −x, ρA L³/6
        # Straight and not turned: KAG L/2 of the slope squared; undeformed it comes as a straight line to Ψ = −0.4.
        ({"beam": {**BENT, "approach": "elastic"}}, 8.0 / 6.0 + 100.0 * 0.1**2),
        ({"beam": BENT, "spring": {"equilibrium": -0.4}, "stop": None}, 8.0 / 6.0 + 100.0 * 0.2**2 + 0.24 - 1.28e-3),
        ({"beam": {"initial_velocity_slope": 0.0}, "spring": {"initial_velocity": -2.0, "external_force": -3.0}}, 2.0),
        ({"beam": None, "spring": {"equilibrium": 0.1, "external_force": -3.0}}, 0.015 - 5e-6),
        # Loads that begin at once: 2 F²/k of the spring, and of a tip force that bends the beam as far.
        ({"beam": None, "loads": PUSHES}, 2.0 * 3.0**2 / 3.0),
        ({"loads": [{"on": "beam", "at": 0.5}]}, 8.0 / 6.0 + 2.0 * 0.3125**2 * tip_compliance(LONG.beam)),
        ({"loads": [{"on": "beam", "shape": [0.0, 1.0]}]}, 8.0 / 6.0 + 2.0 * 0.55**2 * tip_compliance(LONG.beam)),
    ],
)
def test_the_energy_at_first_contact_is_that_by_hand(changes, energy):
    assert contact_energy(with_changes(LONG, **changes)) == pytest.approx(energy, rel=1e-9)


@pytest.mark.parametrize(
    ("spring", "stop", "depth"),
    [
        ({"equilibrium": 0.1}, PAIR.stop, 0.0),  # softening, at rest
        ({**HARD, "equilibrium": 0.1}, PAIR.stop, 0.1),
        ({**HARD, "equilibrium": 0.01}, PAIR.stop, 0.015),
        # ½ k1 y² + ¼ k2 y⁴ = ½ m v² of the spring, without the beam
        ({**HARD, "initial_velocity": np.sqrt(3.0 * 0.2**2 + 200.0 * 0.2**4)}, None, 0.2),
    ],
)
def test_a_spring_is_as_stiff_as_where_it_goes(spring, stop, depth):
    lone = with_changes(PAIR, beam=None, spring=spring, stop=stop)
    cubic = spring.get("cubic_stiffness", 0.0)
    assert spring_stiffness(lone) == pytest.approx(3.0 + 3.0 * cubic * depth**2, rel=1e-9)


@pytest.mark.parametrize(
    ("k1", "k2", "psi", "force", "height"),
    [
        (3.0, 0.0, 9.0, 6.0, 2.0),
        (3.0, -0.25, 2.2, 2.75, 1.0),  # the other places are unstable
        (-1.0, 1.0, -0.1, 0.0, -1.0),  # two are stable
        (-1.0, 1.0, 0.1, 0.0, 1.0),
        (3.0, -0.25, 0.0, 4.01, None),
    ],
)
def test_a_spring_rests_where_it_is_stable_and_nearest_to_where_it_starts(k1, k2, psi, force, height):
    spring = Spring(mass=1.0, linear_stiffness=k1, cubic_stiffness=k2, equilibrium=psi)
    assert resting_height(spring, force) == (height if height is None else pytest.approx(height, rel=1e-12))


@pytest.mark.parametrize(("turn", "expected"), [(0.99, ("energy", 2)), (1.01, ("energy", 0))])
def test_unresolved_motion_gets_degree_0(turn, expected):
    assert choice(auto(coupling={"macro_step": turn / slowest_frequency(PAIR.beam)}))[:2] == expected


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"coupling": {"relative_tolerance": 1e-4}}, ("hermite", 2)),
        # Where hermite is not defined it is not taken.
        ({"beam": {"integrator": "midpoint"}}, ("energy", 0)),
        ({"beam": {"fidelity": "quasi_static"}}, ("energy", 2)),
        ({"coupling": {"macro_step": 1e-6}}, ("hermite", 2)),
    ],
)
def test_what_changes_of_soft_get(changes, expected):
    assert choice(with_changes(PAIR, **changes))[:2] == expected


def test_a_scheme_that_is_chosen_is_defined():
    for changes in ({"contact": {"law": "compliance"}}, {"beam": {"integrator": "midpoint"}}):
        assert with_scheme_chosen(auto(**changes))[0].coupling.scheme == "energy"


@pytest.mark.parametrize("contact", [{"law": "compliance", "exponent": 1.5}, {"law": "link"}], ids=lambda c: c["law"])
@pytest.mark.parametrize("coupling", [{"macro_step": 4e-3}, {"relative_tolerance": 1e-3}], ids=lambda c: next(iter(c)))
def test_soft_laws_get_degree_2_which_is_never_worse(contact, coupling):
    """y at 0.24 s; at 4 ms the contact turns up to 2.5 rad a step, where degree 0 is off by percents of the motion."""
    law = {"stop": None, "time": {"t_end": 0.24}, "beam": {"n_elements": 10}, "contact": {"stiffness": 1e4, **contact}}
    scene = with_changes(PAIR, **law)
    taken = auto(scene, coupling={"macro_step": None, **coupling})
    assert choice(taken)[:2] == ("energy", 2)
    exact = simulate(with_changes(scene, coupling={"macro_step": 1.25e-4, "degree": 2})).y
    error = {
        degree: abs(simulate(with_changes(taken, coupling={"scheme": "energy", "degree": degree})).y[-1] - exact[-1])
        for degree in (0, 2)
    }
    assert error[2] <= 0.1 * error[0]
    assert error[2] <= 1e-3 * np.ptp(exact)
