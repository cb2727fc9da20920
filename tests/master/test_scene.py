"""Scene files: what is accepted, what is refused, and whether the refusal says what to do."""

import math
from copy import deepcopy

import numpy as np
import pytest
import scenes
from scenes import TABLE, scene_from_dict, without_false

import springbeam
from springbeam.scene import Beam, SceneError, load_scene, with_changes
from springbeam.scene.plausibility import warnings_of

DOUBTS = scenes.table("bad_inputs.toml")["doubts"]


def changed(**tables):
    """The dictionary of `PAIR` with keys changed; ``None`` takes a table or a key out."""
    data = load_pair()
    for table, changes in tables.items():
        if changes is None:
            data.pop(table, None)
        elif isinstance(changes, dict) and isinstance(data.get(table, {}), dict):
            merged = {**data.get(table, {}), **changes}
            data[table] = {key: value for key, value in merged.items() if value is not None}
        else:
            data[table] = changes
    return data


def load_pair():
    return deepcopy(TABLE["pair"])


GOOD = {name: changed(**without_false(changes)) for name, changes in TABLE["accepted"].items()}


@pytest.mark.parametrize("data", GOOD.values(), ids=GOOD)
def test_accepted_and_unchanged_by_a_round_trip(data):
    scene = scene_from_dict(data)
    assert scene_from_dict(scene.model_dump(exclude_none=True)) == scene


ARRIVALS = scenes.table("master/cases.toml")["arrivals"]


@pytest.mark.parametrize("name", ARRIVALS)
def test_contact_time_of_the_undeformed_approach(name):
    """t_c = (Ψ/L − s₀)/s₁ of u = (s₀ + s₁ t) x; Ψ is φ without a spring."""
    changes = without_false(ARRIVALS[name])
    expected = changes.pop("at", None)
    t_c = scene_from_dict(changed(**changes)).contact_time
    assert t_c == (None if expected is None else pytest.approx(expected, rel=1e-14))


def test_a_change_of_the_law_or_of_a_signal_keeps_the_keys_that_the_new_one_has_too():
    """λ and q of compliance are no keys of a tie, λ is one of a link; a key that is new and another's is refused."""
    given = {"law": "compliance", "stiffness": 7.0, "exponent": 1.5, "damping": 0.25}
    compliant = with_changes(load_scene("soft"), contact=given)
    tied = with_changes(compliant, contact={"law": "tie"}).contact
    linked = with_changes(compliant, contact={"law": "link"}).contact
    assert tied.model_dump(exclude_unset=True) == {"law": "tie"}
    assert linked.model_dump(exclude_unset=True) == {"law": "link", "stiffness": 7.0, "damping": 0.25}
    with pytest.raises(
        SceneError,
        match=r'exponent = 2.0: is for .* or "compliance" or "kelvin_voigt", this is law = "link"',
    ):
        with_changes(compliant, contact={"law": "link", "exponent": 2.0})
    load = {"on": "spring", "signal": "harmonic", "frequency": 9.0, "start": 0.5, "duration": 1.0}
    shaken = with_changes(compliant, loads=[load])
    (ramp,) = with_changes(shaken, **{"loads.0": {"signal": "ramp"}}).loads
    assert ramp.model_dump(exclude_unset=True) == {"on": "spring", "signal": "ramp", "start": 0.5, "duration": 1.0}


@pytest.mark.parametrize("load", [0.0, 2.0, -2.0])
@pytest.mark.parametrize("stop", [None, -1.0, -10.0])
def test_a_softening_spring_may_start_with_the_energy_of_its_lower_rim(load, stop):
    """Rims from a general root finder; a foundation inside the well bars the one below."""
    k1 = 3.0
    k2 = -0.2
    low, _, high = sorted(np.roots([k2, 0.0, k1, -load]).real)
    rims = (high,) if stop == -1.0 else (low, high)
    depth = min(0.5 * k1 * y**2 + 0.25 * k2 * y**4 - load * y for y in rims)
    with_beam = changed(beam={"initial_velocity_slope": -9.0}, stop=None)  # ρA L³ s₁²/6 beside a well of k1²/4|k2|
    assert (
        "starts with 13.5 J, the softening spring's well is 11.2 J deep" in warnings_of(scene_from_dict(with_beam))[0]
    )
    for factor in (1.0 - 1e-9, 1.0 + 1e-9):
        spring = {"external_force": load, "initial_velocity": factor * math.sqrt(2.0 * depth)}
        scene = changed(beam=None, stop=stop and {"position": stop}, spring=spring)
        if factor < 1.0:
            assert warnings_of(scene_from_dict(scene)) == []
            continue
        with pytest.raises(SceneError, match=r"escapes from a well .* J deep"):
            scene_from_dict(scene)
        scene["spring"]["damping"] = 0.1
        assert "J deep; the run stops if it escapes" in warnings_of(scene_from_dict(scene))[0]


@pytest.mark.parametrize(
    ("given", "follows"),
    [
        ({"width": 0.02, "height": 0.005}, {"area": 1e-4, "second_moment_of_area": 0.02 * 0.005**3 / 12}),
        ({"diameter": 0.1}, {"area": math.pi * 0.05**2, "second_moment_of_area": math.pi * 0.05**4 / 4}),
        ({"poisson_ratio": 0.25}, {"shear_modulus": 40.0}),
        ({"approach_speed": 3.0}, {"initial_velocity_slope": -1.5}),
    ],
)
def test_other_ways_to_give_a_beam_mean_the_same(given, follows):
    """A beam given another way is the beam of ρ, A, I, …; it is kept, and changed, as it was given."""
    without = dict.fromkeys((*follows, *(("shear_coefficient",) if "area" in follows else ())))
    beam = {
        k: v for k, v in {**Beam.ones(), "length": 2.0, "young_modulus": 100.0, **given}.items() if k not in without
    }
    scene = springbeam.scene.scene_from_dict({**load_pair(), "spring": None, "stop": None, "beam": beam})
    assert {key: getattr(scene.beam, key) for key in follows} == pytest.approx(follows, rel=1e-15)
    assert scene.beam.shear_coefficient == (5 / 6 if "width" in given else 0.9 if "diameter" in given else 1.0)
    kept = scene.model_dump(exclude_none=True)["beam"]
    assert given.items() <= kept.items()
    assert not kept.keys() & without.keys()
    assert with_changes(scene, title="again").beam == scene.beam
    back = with_changes(scene, beam={**follows, **{k: 1.0 for k in without if k not in follows}})
    assert back.beam.model_dump(exclude_none=True).keys().isdisjoint(given)


@pytest.mark.parametrize("name", DOUBTS)
def test_what_can_hardly_be_meant_is_told(name):
    changes = dict(DOUBTS[name])
    scene = load_scene(changes.pop("of"))
    said = changes.pop("said")
    lines = warnings_of(with_changes(scene, **without_false(changes)))
    assert len(lines) == len(said), lines
    assert all(fragment in line for fragment, line in zip(said, lines, strict=True)), lines
