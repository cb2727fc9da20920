"""How the check of a foreign FMU goes from one size of steps to the next, with checks made up; what a scene needs."""

from contextlib import nullcontext
from dataclasses import replace

import pytest
from scenes import table

from springbeam import PointMass, SceneError, load_scene, with_changes
from springbeam.bodies.protocol import NO_FORCE, Abilities, Body, Motion
from springbeam.run.setup import set_up
from springbeam.run.validation import refusals, tried, validate

# -- what a scene needs of its bodies -------------------------------------------------------------------------------

ASKED = table("master/cases.toml")["asked"]


@pytest.mark.parametrize("what", ASKED)
def test_a_scene_asks_of_a_body_what_it_needs_and_no_more(what):
    changes = dict(ASKED[what])
    lacks = changes.pop("lacks")
    asks = changes.pop("asks")
    setup = set_up(with_changes(load_scene("soft"), **changes, stop=None))
    lines = refusals(setup, {"spring": replace(Abilities(), **lacks)})
    assert [line.partition(" = ")[0].partition(":")[0] for line in lines] == asks


@pytest.mark.parametrize(("law", "refused"), [("compliance", 0), ("transmission", 2)])
def test_an_elastic_stop_asks_a_body_for_no_impulses(law, refused):
    """It pushes by a law; a rigid one strikes the tip."""
    contact = {"law": law, "stiffness": 1e4, "exponent": 1.0}
    setup = set_up(with_changes(load_scene("beam-on-stop"), contact=contact, stop={"restitution": 1.0}))
    lines = refusals(setup, {"beam": replace(Abilities(), impulse=False, velocity=False)})
    assert [line.partition(":")[0] for line in lines] == refused * ["[stop]"]


class Euler(Body):
    """1 kg by Euler's method, explicit where ``share`` is 0 and semi-implicit where it is 1; 1/2 is of order 2."""

    def __init__(self, share):
        self.mass = 1.0
        self.share = share
        self.state = Motion(0.0, 0.0, 0.0, 0.0)

    def motion(self):
        return self.state

    def advance(self, time, size, contact, foundation=NO_FORCE):
        w, v, *_ = self.state
        after = v - size * contact[0] / self.mass
        self.state = Motion(w + size * (v + self.share * (after - v)), after, 0.0, 0.0)
        return self.state


@pytest.mark.parametrize(("share", "order"), [(0.0, 1), (0.4, 1), (0.5, 2), (1.0, 1)])
def test_a_body_of_order_1_is_found_and_refused(share, order):
    found = tried(Euler(share), 0.0, 1e-3)
    assert found.order == order
    lines = refusals(set_up(with_changes(load_scene("soft"), coupling={"degree": 0})), {"spring": found})
    assert sum("a solver of order 1" in line for line in lines) == (order == 1)


class Unstruck(PointMass):
    apply_impulse = Body.apply_impulse


@pytest.mark.parametrize(("lower", "why"), [
    (PointMass(1.0), None),
    (PointMass(1.0, -0.015 * (1.0 + 1e-15)), None),
    (PointMass(1.0, -0.015 * (1.0 + 1e-9)), r"the body in \[spring\] starts below the foundation, at -0\.015"),
    (Unstruck(1.0), r"the body in \[spring\] cannot do that, it has no impulse"),
])  # fmt: skip
def test_bodies_are_admitted_where_they_can_begin(lower, why):
    """Above a foundation at −15 mm, to rounding; and struck, if the law is rigid."""
    scene = with_changes(load_scene("soft"), beam={"approach": "elastic"})
    with pytest.raises(SceneError, match=why) if why else nullcontext():
        validate(set_up(scene), PointMass(1.0, 0.1), lower)
