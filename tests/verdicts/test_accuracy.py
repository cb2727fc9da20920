"""An accuracy asked for is kept: judged by the monolithic reference, on scenes that are not shipped."""

import numpy as np
import pytest
from judge import ERRORS, Reference, judge
from references import reference
from scenes import scene_from_dict, table

from springbeam import SceneError, load_scene, with_changes
from springbeam.results.distance import distance
from springbeam.results.recording import MemoryRecorder
from springbeam.run import accuracy as search
from springbeam.run.runner import run
from springbeam.run.simulate import simulate

SCENES = table("verdicts/accuracy.toml")
FOUND = table("verdicts/found.toml")


def errors(found, reference):
    """Errors by name; of the peak force beside shorter steps."""
    span = found.time[-1] - found.time[0]
    apart = distance(found, reference, found.summary["accuracy"]["asked"] * span)
    wrong = {name: getattr(apart, name) for name in ("motion", "times", "impulses")}
    if not found.scene.contact.rigid:
        sharp = {"macro_step": found.scene.coupling.H / 8.0, "tolerance": 1e-12}
        exact = simulate(with_changes(found.scene, coupling=sharp)).summary["contact_force_max"]
        wrong["force"] = abs(found.summary["contact_force_max"] / exact - 1.0)
    return wrong


@pytest.mark.parametrize("name", SCENES)
def test_the_promise_is_kept_on_the_whole_curve(name):
    """Motion at 201 times and 25 rows of the run, times of contact, impulses, and of soft laws the peak force."""
    found = simulate(scene_from_dict(SCENES[name]))
    times = np.union1d(np.linspace(found.time[0], found.time[-1], 201), found.time[:: len(found) // 25 + 1])
    asked = found.summary["accuracy"]["asked"]
    wrong = errors(found, reference(found.scene, sample_times=times))
    assert max(wrong.values()) <= asked, wrong
    assert all(found.summary["errors"][name] <= asked for name in search.KEPT if name in found.summary["errors"])


@pytest.mark.parametrize("name", FOUND["alone"])
def test_a_spring_alone_is_right_with_an_accuracy_and_says_so(name):
    found = judge(scene_from_dict({"accuracy": 1e-3, **FOUND["alone"][name]}))
    assert not found["warns"]
    assert max(found[error] for error in ERRORS) <= 1e-3
    assert found["do_steps"] <= 250


@pytest.mark.parametrize("name", FOUND["impulses"])
def test_impulses_are_part_of_the_promise(name):
    scene = scene_from_dict({"accuracy": 1e-3, **FOUND["impulses"][name]})
    found = judge(scene, Reference(scene))
    assert 0.0 < found["error_impulses"] <= 1e-3
    assert found["factor"] <= 1.0


@pytest.mark.parametrize("name", FOUND["warned"])
def test_what_a_campaign_found_wrong_warns(name):
    run = simulate(scene_from_dict(FOUND["warned"][name]))
    assert run.summary["resolved"] is False
    assert any("steps 2.3 times as long differ by" in warning for warning in run.summary["warnings"])


@pytest.mark.parametrize("name", FOUND["curves"])
def test_curves_that_a_campaign_found_wrong_between_right_rows_warn(name):
    """Its last moments show 0.8 %: up to half of the error where waves turn by more than 2π in a step."""
    scene = scene_from_dict(FOUND["curves"][name])
    found = judge(scene, Reference(scene))
    assert 0.01 < found["error_motion"] < 0.02
    assert found["warns"]


@pytest.mark.parametrize("name", FOUND["hard"])
def test_runs_agree_where_rounding_decides(name):
    tables = dict(FOUND["hard"][name])
    most = tables.pop("steps")
    run = simulate(scene_from_dict(tables))
    exact = reference(run.scene, sample_times=np.linspace(0.0, tables["time"]["t_end"], 401)[1:])
    for column in {"u_tip", "y"} & set(run.columns):
        off = np.abs(run.at(exact.time)[column] - exact[column]).max()
        assert off <= tables["accuracy"] * np.ptp(exact[column]) + 1e-15
    assert run.summary["accuracy"]["pilot_steps"] + run.do_steps <= most


# -- a scene that asks for an accuracy, in the studies ---------------------------------------------------------------


@pytest.mark.parametrize(
    ("most", "said"),
    [(5, "runs in up to .*, damp the beam"), (60, "with 60 steps: the error of .* is up to .*, damp the beam")],
)
def test_an_accuracy_that_is_not_reached_says_what_fails_and_how_far_it_was(monkeypatch, most, said):
    scene = load_scene("soft", ["time.t_end=0.05"], 1e-9)
    monkeypatch.setattr(search, "_FEWEST", 8.0 if most > 8 else most)
    monkeypatch.setattr(search, "_MOST", most)
    with pytest.raises(SceneError, match=said):
        search.pick(scene)


ASKING = {
    "accuracy": 1e-4,
    "time": {"t_end": 0.05},
    "beam": {"young_modulus": 100.0, "shear_modulus": 100.0, "n_elements": 6, "initial_velocity_slope": -1.0},
    "spring": {"linear_stiffness": 3.0},
}


def test_what_runs_a_scene_as_it_is_wants_the_accuracy_picked():
    scene = scene_from_dict(ASKING)
    with pytest.raises(SceneError, match=r"accuracy = 0\.0001"):
        run(scene, MemoryRecorder(scene))
