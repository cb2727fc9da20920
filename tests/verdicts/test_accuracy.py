"""An accuracy asked for is kept: judged by the monolithic reference, on scenes that are not shipped."""

import numpy as np
import pytest
from scenes import scene_from_dict, table

from springbeam import SceneError, load_scene, with_changes
from springbeam.monolithic.event_driven import integrate as reference
from springbeam.results.distance import distance
from springbeam.results.recording import MemoryRecorder
from springbeam.run import accuracy as search
from springbeam.run.runner import run
from springbeam.run.simulate import simulate

SCENES = table("verdicts/accuracy.toml")


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
