"""How the check of a foreign FMU goes from one size of steps to the next, with checks made up; what a scene needs."""

from contextlib import nullcontext
from dataclasses import replace

import pytest
from bodies import DuffingBody, Upper

from springbeam import SceneError, load_scene, with_changes
from springbeam.bodies.gate import admit, refusals
from springbeam.bodies.protocol import Abilities, Body

# -- what a scene needs of its bodies -------------------------------------------------------------------------------

LINKED, SLOW = {"contact": {"law": "link", "damping": 1.0}}, {"velocity": False}
#: The tip arrives at 0.6006 s, from where steps of 0.25 ms are counted.
LATE = {"beam": {"initial_deflection_slope": 0.6006}, "time": {"t_end": 1.6006}}


def stepped(start):
    return LATE | {"loads": [{"on": "spring", "signal": "step", "start": start}]}


@pytest.mark.parametrize(("changes", "lacks", "asks"), [
    (LINKED | {"coupling": {"scheme": "jacobi"}}, SLOW, ["[contact] damping"]),
    ({"contact": {"law": "link"}, "coupling": {"scheme": "jacobi"}}, SLOW, []),
    ({"contact": {"law": "link"}, "coupling": {"scheme": "jacobi", "degree": 1}}, SLOW, ["[coupling] degree"]),
    (LINKED, SLOW, []),
    *(({"coupling": {"scheme": scheme, "degree": degree}}, {"integrals": integrals}, ["[coupling] degree"] * lacking)
      for scheme, degree, integrals, lacking in (
          ("energy", 1, 1, 0), ("energy", 2, 1, 1), ("energy", 2, 0, 1))),
    *((stepped(start), {"any_size": False}, ["[[loads]]"] * apart)
      for start, apart in ((0.6026, 0), (0.602725, 1), (1.700225, 0))),
])  # fmt: skip
def test_a_scene_asks_of_a_body_what_it_needs_and_no_more(changes, lacks, asks):
    """A load that begins after the end, or where a step ends, asks for no steps of other sizes."""
    given = {"stop": None, "contact": {"law": "tie" if "integrals" in lacks else "compliance"}} | changes
    told = refusals(with_changes(load_scene("soft"), **given), {"spring": replace(Abilities(), **lacks)})
    assert [line.partition(" = ")[0].partition(":")[0] for line in told] == asks


class Unstruck(DuffingBody):
    apply_impulse = Body.apply_impulse


@pytest.mark.parametrize(("lower", "why"), [
    (DuffingBody(1.0), None),
    (DuffingBody(1.0, y=-0.015 * (1.0 + 1e-15)), None),
    (DuffingBody(1.0, y=-0.015 * (1.0 + 1e-9)), r"the body in \[spring\] starts below the foundation, at -0\.015"),
    (Unstruck(1.0), r"the body in \[spring\] cannot do that, it has no impulse"),
])  # fmt: skip
def test_bodies_are_admitted_where_they_can_begin(lower, why):
    """Above a foundation at −15 mm, to rounding; and struck, if the law is rigid."""
    scene = with_changes(load_scene("soft"), beam={"approach": "elastic"})
    with pytest.raises(SceneError, match=why) if why else nullcontext():
        admit(scene, 0.0, Upper(1.0, y=0.1), lower)
