"""`crosscheck` passes where co-simulation and reference solve the same problem, and fails where they do not."""

import json

import numpy as np
import pytest
import tomli_w
from commands import command
from draw import USUAL, drawn, scene_dict

from springbeam import load_scene, with_changes
from springbeam.monolithic import event_driven
from springbeam.scene import scene_from_dict
from springbeam.studies.comparison import compare, errors_judged
from springbeam.studies.crosscheck import crosscheck

SOFT = load_scene("soft")


def write(scene, folder):
    path = folder / "scene.toml"
    path.write_text(tomli_w.dumps(scene.model_dump(exclude_none=True, exclude_unset=True)))
    return path


@pytest.mark.parametrize(
    ("error", "at", "passed"),
    [
        ([0.15, 0.1, 0.25], 2, True),
        ([0.25, 0.5, 0.55], 1, False),
        ([0.0, 0.0, 0.42], 2, False),
        ([0.21, 0.2, 0.4], 2, True),
    ],
)
def test_an_error_may_be_twice_what_the_companion_has_differed_by_so_far_and_the_floor(error, at, passed):
    """Reported is the largest error or, where a bound is broken, the one that is furthest out of it."""
    changed = np.array([0.1, 0.0, 0.2])
    floor = np.full(3, 0.01)
    found = errors_judged("y", np.array([1.0, 2.0, 3.0]), np.array(error), changed, floor)
    rms = np.sqrt(np.mean(np.square(error)))
    bound = (0.21, 0.21, 0.41)[at]
    assert (found["at"], found["error"], found["passed"]) == (at + 1.0, error[at], passed)
    assert (found["l2"], found["bound"]) == pytest.approx((rms, bound), rel=1e-14)


def test_what_cannot_be_compared_has_not_agreed(tmp_path):
    """Tip and top touch at one velocity: the least change of it decides whether they are joined at once."""
    beam = {"n_elements": 3, "fidelity": "quasi_static"}
    spring = {"initial_velocity": -1.0}
    grazing = with_changes(SOFT, beam=beam, spring=spring, time={"t_end": 0.05}, coupling={"macro_step": 1e-3})
    found = crosscheck(grazing)
    assert (found.document["verdict"], found.document["quantities"]) == ("not comparable", [])
    assert "Nothing could be compared" in found.document["notes"][-1]
    assert found.code == 4


def test_a_run_that_is_not_resolved_cannot_agree(tmp_path):
    """`paper-fig2` turns its slowest mode 967 rad in a macro step. Compared for 6 µs it had "passed"."""
    unresolved = with_changes(load_scene("paper-fig2"), time={"t_end": 0.6}, beam={"n_elements": 4, "n_modes": 0})
    result = command("crosscheck", write(unresolved, tmp_path), "--out", tmp_path / "out", "--json")
    found = json.loads(result.stdout)
    assert (result.exit_code, found["verdict"], found["quantities"]) == (4, "not comparable", [])
    assert found["horizon"] == unresolved.contact_time
    assert found["notes"][0].startswith("not resolved")


WRONG = {
    "sign of the cubic term": {"spring": {"cubic_stiffness": 0.2}},
    "beam": {"beam": {"density": 1.001}},
    "degree": {"beam": {"element_degree": 2}},
    "law": {"contact": {"law": "compliance", "stiffness": 1e6}},
    "restitution": {"stop": {"restitution": 0.9}},
    "load that varies": {"loads": [{"on": "tip", "signal": "harmonic", "frequency": 12.0, "amplitude": 1e-3}]},
}


@pytest.mark.parametrize("what", WRONG)
def test_a_wrong_reference_fails(monkeypatch, what):
    """The reference is given another problem than the co-simulation: nothing in the bounds may hide that."""
    right = event_driven.integrate
    monkeypatch.setattr(
        event_driven, "integrate", lambda given, **options: right(with_changes(given.scene, **WRONG[what]), **options)
    )
    coupling = {"macro_step": 1e-3, "degree": 0 if what == "law" else 2}
    scene = with_changes(SOFT, time={"t_end": 0.1}, beam={"n_elements": 8}, coupling=coupling)
    assert compare(scene)["verdict"] == "differs"


def test_the_command_tells_by_its_exit_code(monkeypatch, tmp_path):
    """Results stay as they are until they are to be replaced."""
    out = tmp_path / "both"
    arguments = ["crosscheck", "duffing", "--set", "time.t_end=1", "--out", out]
    right = event_driven.integrate
    for options, mass, code in (([], 1.0, 0), ([], 1.01, 2), (["--force"], 1.01, 1)):

        def heavier(given, mass=mass, **more):
            return right(with_changes(given.scene, spring={"mass": mass}), **more)

        monkeypatch.setattr(event_driven, "integrate", heavier)
        assert command(*arguments, *options).exit_code == code
    assert (out / "crosscheck.png").stat().st_size > 10_000


#: A tenth of scenes that a campaign draws, at coarse steps, and the verdict on each.
DRAWN = {0: "not comparable", 8: "agrees", 12: "agrees", 15: "agrees"}


def tenth(number):
    scene = scene_from_dict(scene_dict(list(drawn(USUAL, 24, 5))[number]))
    start = scene.contact_time or 0.0
    return with_changes(scene, time={"t_end": start + 0.1 * (scene.time.t_end - start)})


@pytest.mark.parametrize("number", DRAWN)
def test_a_right_run_at_coarse_steps_does_not_differ(number):
    found = compare(tenth(number))
    assert [row for row in (*found["quantities"], *found["events"]) if not row["passed"]] == []
    assert found["verdict"] == DRAWN[number]


@pytest.mark.parametrize("number", [number for number, verdict in DRAWN.items() if verdict == "agrees"])
def test_a_reference_of_a_beam_that_is_a_little_heavier_fails_at_coarse_steps(monkeypatch, number):
    right = event_driven.integrate

    def heavier(given, **options):
        return right(with_changes(given.scene, beam={"density": 1.001 * given.scene.beam.density}), **options)

    monkeypatch.setattr(event_driven, "integrate", heavier)
    assert compare(tenth(number))["verdict"] == "differs"
