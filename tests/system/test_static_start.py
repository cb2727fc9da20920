"""A start at rest: a scene whose loads do not change stays where statics have it, to rounding, whatever joins its ends.

Closed forms: the tip of the continuous beam under its weight is at u₀ = −ρAg (L⁴/8EI + L²/2KAG); under a contact force
it is at u₀ + c C, c = L³/3EI + L/KAG, and the top of a linear spring at (f − C)/k₁. Elements of degree 4 are exact.
"""

import numpy as np
import pytest
import scenes
from references import reference

from springbeam.motion.events import EventKind
from springbeam.run.runner import run_in_memory
from springbeam.scene import scene_from_dict
from springbeam.scene.statics import tip_compliance

G = 9.81
K1 = 2.0e3
MASS = 0.05
LINK = 1.0e5
BEAM = {
    "length": 0.8,
    "width": 0.03,
    "height": 0.003,
    "density": 2700.0,
    "young_modulus": 7.0e10,
    "poisson_ratio": 0.33,
    "n_elements": 4,
    "element_degree": 4,
    "approach": "elastic",
}
SPRING = {"mass": MASS, "linear_stiffness": K1}
TIME = {"t_end": 0.02, "initial_state": "static"}
WEIGHT = {"on": "base", "amplitude": G}


def scene(**tables):
    given = {"time": TIME, "beam": BEAM, "coupling": {"macro_step": 1e-3}, "loads": [WEIGHT], **tables}
    return scene_from_dict({name: table for name, table in given.items() if table is not None})


def hanging(beam):
    """Return u₀ [m]."""
    EI = beam.young_modulus * beam.second_moment_of_area
    KAG = beam.shear_coefficient * beam.area * beam.shear_modulus
    return -beam.density * beam.area * G * (beam.length**4 / (8.0 * EI) + beam.length**2 / (2.0 * KAG))


def pressed(beam, k, link):
    """Return C [N] between the beam and a spring k under their weight, with a link between them."""
    return (-MASS * G / k - hanging(beam)) / (tip_compliance(beam) + 1.0 / k + (1.0 / link if link else 0.0))


def link(law, **keys):
    return {"contact": {"law": law, "stiffness": LINK, **keys}}


#: The phase in which ends touch, where that is not a tie.
PHASES = {"above Ψ": "touch", "wall": "touch", "compliance": "touch", "rigid stop": "seated", "elastic stop": "touch"}


@pytest.mark.parametrize("name", scenes.group("touching"))
def test_ends_that_touch_stay_at_rest_under_the_force_of_statics(name):
    what = scenes.named(f"touching/{name}")
    k = np.inf if what.spring is None else K1
    stiffness = LINK if name in ("link", "compliance", "elastic stop") else 0.0
    run = run_in_memory(what)
    C = pressed(what.beam, k, stiffness)
    columns = run.columns
    u = hanging(what.beam) + tip_compliance(what.beam) * C
    assert columns["u_tip"][0] == pytest.approx(u, rel=1e-9, abs=1e-9 * -hanging(what.beam))
    assert np.ptp(columns["u_tip"]) < 1e-13 * -hanging(what.beam)
    assert set(columns["phase"]) == {PHASES.get(name, "tied")}
    force = columns["contact_force" if "contact_force" in columns else "foundation_force"]
    # A gap of an ulp of the parts that the tip is the sum of is closed by the first step, with at most the beam's mass.
    mass = what.beam.density * what.beam.area * what.beam.length
    parts = -hanging(what.beam)
    rounding = mass * np.spacing(parts) / run.steps["size"][1] ** 2
    np.testing.assert_allclose(force, C, rtol=1e-8, atol=rounding)
    assert np.abs(columns["energy_residual"]).max() < 1e-13


FLOOR = -0.01  # m, above where the load takes the spring
ELEMENT = {"element": "spring_damper", "mass": MASS, "stiffness": K1}


@pytest.mark.parametrize("lower", [SPRING, ELEMENT], ids=["spring", "element"])
@pytest.mark.parametrize(
    "law", [{}, {"contact": {"law": "tie"}}, link("compliance", exponent=1.0)], ids=["tied", "tie", "compliance"]
)
def test_a_spring_that_would_rest_below_its_stop_rests_on_it(lower, law):
    """N = C + k₁ φ + m g − f, and C is the force that bends the beam to the stop, or what the law makes of the rest.

    The stop is elastic: a top that fell on it would bounce for ever.
    """
    what = scene(spring={**lower, "external_force": -30.0}, stop={"position": FLOOR, "restitution": 1.0}, **law)
    run = run_in_memory(what)
    soft = 1.0 / LINK if what.contact.soft else 0.0
    C = (FLOOR - hanging(what.beam)) / (tip_compliance(what.beam) + soft)
    np.testing.assert_allclose(run.y, FLOOR, rtol=1e-14)
    np.testing.assert_allclose(run.contact_force, C, rtol=1e-8)
    np.testing.assert_allclose(run.foundation_force, C + K1 * FLOOR + MASS * G + 30.0, rtol=1e-8)
    assert set(run.phase) == {"seated"}
    assert {event.kind for event in run.events} <= {EventKind.IMPACT}
    assert np.abs(run.energy_residual).max() < 1e-13
    if what.spring is not None:
        beside = reference(what)
        assert beside.foundation_force[-1] == pytest.approx(run.foundation_force[-1], rel=1e-8)
        assert {event.kind for event in beside.events} <= {EventKind.IMPACT}


def test_a_beam_without_inertia_starts_where_it_rests():
    beam = {**BEAM, "fidelity": "quasi_static", "distributed_load": -5.0, "alpha_b": 0.01}
    what = scene(beam=beam, spring=SPRING, loads=None)
    run = run_in_memory(what)
    columns = run.columns
    loaded = what.beam
    EI = loaded.young_modulus * loaded.second_moment_of_area
    KAG = 5 / 6 * loaded.area * loaded.shear_modulus
    free = -5.0 * (0.8**4 / (8.0 * EI) + 0.8**2 / (2.0 * KAG))
    np.testing.assert_allclose(columns["y"], free / (1.0 + K1 * tip_compliance(what.beam)), rtol=1e-10)
    C = columns["contact_force"][0]
    arm = 0.8 * (1.0 - np.linspace(0.0, 1.0, 21))
    np.testing.assert_allclose(run.bending_moment[0], C * arm - 5.0 * arm**2 / 2.0, atol=1e-10)
    np.testing.assert_allclose(run.shear_force[0], C - 5.0 * arm, atol=1e-10)
