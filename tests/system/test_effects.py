"""Keys without effect: told where, and only where, a run is the same to the last bit without them."""

import numpy as np
import pytest
import scenes

from springbeam import SceneError, simulate, with_changes
from springbeam.scene.suspicions import EFFECTS, suspicions

#: The tip meets the spring at once, and the spring strikes the stop after some ms.
SCENES = scenes.group("effects")
VALUES = {
    "beam.n_elements": 3,
    "beam.element_degree": 2,
    "beam.reduced_integration": True,
    "beam.mass_matrix": "averaged",
    "beam.integrator": "midpoint",
    "beam.n_modes": 3,
    "stop.restitution": 0.25,
    "contact.stiffness": 2e3,
    "contact.exponent": 1.25,
    "contact.damping": 0.5,
    "contact.force_window": 3e-3,
    "coupling.degree": 1,
    "coupling.tolerance": 1e-3,
}
_RUNS = {}


def same(a, b):
    """Return whether two runs are the same to the last bit, but for what the clock says."""
    numbers = [
        {
            name: value
            for name, value in run.summary.items()
            if name not in ("wall_time", "setup_time", "scene", "warnings") and not isinstance(value, dict)
        }
        for run in (a, b)
    ]
    return (
        numbers[0] == numbers[1]
        and a.columns.keys() == b.columns.keys()
        and all(np.array_equal(a[name], b[name]) for name in a.columns)
    )


def made(name, scene):
    return _RUNS.setdefault(name, simulate(scene))


@pytest.mark.parametrize("place", VALUES)
@pytest.mark.parametrize("name", SCENES)
def test_a_key_is_told_where_it_changes_nothing(name, place):
    table, key = place.split(".")
    if SCENES[name].under(table) is None or (table == "coupling" and name in ("beam", "spring")):
        return  # an accuracy gives a scheme to one body as well: nothing is said of it
    if (name, place) == ("beam and soft stop", "coupling.tolerance"):
        return  # the response of a linear beam to a wall is known after one step: its force is found to rounding
    if getattr(SCENES[name].under(table), key, None) == VALUES[place]:
        return
    try:
        scene = with_changes(SCENES[name], **{table: {key: VALUES[place]}})
    except SceneError:
        return
    told = [line for line in suspicions(scene) if line.startswith(f"[{table}] {key} = ") and "plays no part" in line]
    assert same(made(name, SCENES[name]), simulate(scene)) == bool(told), (told, suspicions(scene))


def test_every_row_of_the_table_is_looked_at():
    assert {place for places, *_ in EFFECTS for place in places} <= VALUES.keys()


def test_a_load_that_begins_after_the_run_is_told():
    late = with_changes(SCENES["transmission"], loads=[{"on": "tip", "signal": "step", "start": 0.03}])
    assert suspicions(late) == ["[loads.0] start = 0.03: plays no part here; the run ends at [time] t_end = 0.03"]
    assert np.array_equal(simulate(late).y, simulate(SCENES["transmission"]).y)


def test_a_law_between_no_two_bodies_is_told():
    scene = with_changes(SCENES["spring"], contact={"law": "compliance", "stiffness": 1e3, "exponent": 1.5})
    assert [line.partition(":")[0] for line in suspicions(scene)] == [
        '[contact] law = "compliance"',
        "[contact] stiffness = 1000.0",
        "[contact] exponent = 1.5",
    ]
