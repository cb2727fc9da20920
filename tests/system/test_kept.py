"""FMUs of both versions give the same bits; bodies that are kept for the next run step as new ones, are few, and are
freed."""

from math import nan

import numpy as np
import pytest
import scenes
from scenes import load_of

from springbeam import PointMass, RunStopped, SceneError, load_scene, simulate, with_changes
from springbeam.bodies import fmu, fmu_bodies
from springbeam.bodies.factory import load_bodies
from springbeam.bodies.fmu import MOST_KEPT, release
from springbeam.bodies.protocol import NO_FORCE, StepRefused

SCENES = scenes.group("kept")
SOFT = SCENES["transmission"]


pytestmark = pytest.mark.usefixtures("none_kept")


@pytest.fixture
def made(monkeypatch):
    """The names of the instances that are made from now on."""
    names = []
    make = fmu.Fmu.__init__

    def noted(self, name, *rest):
        names.append(name)
        make(self, name, *rest)

    monkeypatch.setattr(fmu.Fmu, "__init__", noted)
    return names


def numbers(scene):
    """Return all that a run leaves and that is no time of the clock."""
    run = simulate(scene)
    assert run.steps is not None
    counts = {name: value for name, value in run.summary.items() if name not in ("wall_time", "setup_time")}
    shapes = [np.asarray(part).tobytes() for part in run.shapes or ()]
    return {**{name: np.asarray(column).tobytes() for name, column in run.columns.items()}, "": shapes, **counts}


@pytest.mark.parametrize("name", SCENES)
def test_a_kept_body_steps_to_the_bits_of_a_new_one(name, made):
    first = numbers(SCENES[name])
    new = len(made)
    assert numbers(SCENES[name]) == first
    assert (new, len(made)) == (len(SCENES[name].fmus), new)


@pytest.mark.parametrize("force", [(nan, 0.0, 0.0), (0.0, 0.0, nan)])
def test_a_force_that_is_no_number_makes_no_step(force):
    for body in load_bodies(load_scene("soft"), 0.0, 2)[:2]:
        body.mark()
        with pytest.raises(StepRefused, match="the force it should step under is not finite"):
            body.advance(0.0, 1e-3, force)
        body.close()


def test_the_last_derivative_alone_acts():
    H = 1e-7  # too short for what is behind an end: its mass takes F̈ H³/6
    bent = (0.0, 0.0, 6.0 / H**3)
    beam, spring, _ = load_bodies(load_scene("soft"), 0.0, 2)
    for body, forces in ((beam, (bent,)), (spring, (NO_FORCE, bent))):
        before = body.motion().velocity
        assert body.advance(0.0, H, *forces).velocity - before == pytest.approx(1.0 / body.mass, rel=1e-4)
        body.close()


def test_a_load_moves_the_tip_as_the_lowest_mode_of_a_slender_beam_says():
    """∫ φ dx of it is 0.3915 of the length times its tip."""
    scene = with_changes(load_scene("soft"), beam={"density": 3.0, "area": 0.5, "length": 2.0})
    beam, spring, _ = load_bodies(scene, 0.0, 2)
    loads = [load_of(**keys) for keys in ({"on": "beam"}, {"on": "beam", "shape": [1.0, -2.0]}, {"on": "base"})]
    assert [beam.moved_by(load) for load in loads] == pytest.approx([0.783, 3.0 * 0.783, 1.5 * 0.783], rel=0.03)
    assert beam.moved_by(load_of(on="tip")) == 1.0
    beam.close()
    spring.close()


def test_few_are_kept_and_the_oldest_is_freed(monkeypatch):
    closed = []
    close = fmu.Fmu.close
    monkeypatch.setattr(fmu.Fmu, "close", lambda self: (closed.append(self), close(self)))
    springs = [with_changes(load_scene("duffing"), spring={"mass": m}, time={"t_end": 0.1}) for m in range(1, 7)]
    for scene in springs:
        simulate(scene)
    assert len(closed) == len(springs) - MOST_KEPT
    release()
    assert len(closed) == len(springs)
    assert not any(one.faultless for one in closed)


def test_a_simulation_that_is_refused_gives_its_bodies_back(made):
    for _ in range(2):
        with pytest.raises(SceneError, match="must start there or above"):
            simulate(SOFT, lower=PointMass(1.0, displacement=1.0))
    assert made == ["beam"]


def test_a_body_whose_calls_fail_is_not_kept(made, monkeypatch):
    def failing(self):
        raise self.fmu.failed(3, "cannot save the state")

    with monkeypatch.context() as during:
        during.setattr(fmu_bodies.FmuBody, "mark", failing)
        with pytest.raises(RunStopped, match=r"beam\.fmu: cannot save the state"):
            simulate(SOFT)
    simulate(SOFT)
    assert made == ["beam", "spring", "beam"]  # the spring had not been called


# -- either version of FMI

LOADS = [
    {"on": "beam", "at": 0.5, "signal": "harmonic", "amplitude": 0.3, "frequency": 4.0},
    {"on": "spring", "signal": "harmonic", "amplitude": 0.2, "frequency": 7.0},
]


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"contact": {"law": "compliance"}},
        {"coupling": {"degree": 1}, "loads": LOADS},
    ],
)
def test_either_version_of_fmi_gives_the_same_bits(changes, monkeypatch):
    scene = with_changes(load_scene("soft"), time={"t_end": 0.3}, **changes)
    runs = []
    for version in ("2.0", "3.0"):
        monkeypatch.setenv("SPRINGBEAM_FMI", version)
        runs.append(simulate(scene))
    old, new = runs
    assert len(old.events) > 1
    assert old.events == new.events
    pairs = [(old[name], new[name]) for name in old.columns]
    for one, other in (*pairs, (old.steps, new.steps), *zip(old.shapes, new.shapes, strict=True)):
        assert one.tobytes() == other.tobytes()
