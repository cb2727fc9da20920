"""Scenes that once ended in silent garbage, as random grids found them; test_beside_reference.py has others."""

from pathlib import Path

import numpy as np
import pytest
from scenes import scene_from_dict

from springbeam import RunStopped, load_scene, simulate, with_changes
from springbeam.monolithic import event_driven
from springbeam.scene.reading import tomllib

SCENES = tomllib.loads(Path(__file__).with_name("extremes.toml").read_text(encoding="utf-8"))
MASSLESS = SCENES["massless"]
SCENES["massless and damped"] = {
    **MASSLESS,
    "beam": {**MASSLESS["beam"], "alpha_b": 1e-5, "distributed_load": -2.0},
    "coupling": {**MASSLESS["coupling"], "degree": 2},
}


def overlap(run):
    """Largest depth of the top below the foundation, of a free tip below the top, or gap of a tie [m]."""
    apart = np.where(
        run.phase == "free", np.maximum(-run.gap, 0.0), np.where(run.phase == "seated", 0.0, np.abs(run.gap))
    )
    if run.scene.contact.law == "compliance":
        apart = np.zeros(1)
    stop = run.scene.stop
    return float(max(apart.max(), 0.0 if stop is None else (stop.position - run.y).max()))


@pytest.mark.parametrize("name", [*SCENES])
def test_bodies_neither_overlap_nor_part_and_energy_is_kept(name):
    """To 1e-9 m where the tip moves by 0.1 m or more, and 1e-8 of the energy.

    1e-9 m is two ulp of what the force does in the worst of them: 4e5 N would move the light top by 2e6 m in a step.
    """
    scene = SCENES[name]
    run = simulate(scene_from_dict(scene))
    assert run.time[-1] == scene["time"]["t_end"]
    assert overlap(run) < 1e-9
    assert run.summary["max_energy_residual"] < 1e-8


def test_bouncing_without_end_stops_by_name(monkeypatch):
    """A damped beam on a lossless stop: its rebounds shrink, but never by enough to be the last."""
    monkeypatch.setattr("springbeam.run.stepping._MAX_IN_STEP", 300)
    beam = {"density": 672.6, "area": 0.07, "shear_modulus": 53.6, "alpha_b": 1.0, "n_elements": 6}
    tables = {
        "time": {"t_end": 1.5},
        "beam": {**beam, "initial_velocity_slope": -1.0},
        "stop": {"position": 0.0},
        "coupling": {"macro_step": 0.1},
    }
    with pytest.raises(RunStopped, match=r"chatters: 300 events within a macro step of 0\.1 s"):
        simulate(scene_from_dict(tables))


@pytest.mark.parametrize("size", [2e-4, 8e-4])
def test_impacts_that_die_out_under_a_tie_of_degree_2_end_seated(size):
    """Each flight is half as long as the one before; the force that reverses the mismatch grows as its inverse.

    Neither may that force hide what presses the spring down, nor may it, fitted on a flight of nanoseconds, be the
    guess for a macro step: trial steps then went kilometres away, took IDA a million steps, and were halved.
    """
    scene = with_changes(load_scene("steel-bumper"), time={"t_end": 0.003}, coupling={"degree": 2, "macro_step": size})
    run = simulate(scene)
    assert run.summary["halved_steps"] == 0
    kinds = [event.kind for event in run.events]
    bounces = kinds.index("seated") - kinds.index("stop_impact")
    # A rebound below 1e-8 of the fastest impact is the last, and each is half as fast.
    assert 10 < bounces <= np.log2(1e8) + 1


def test_a_tip_that_is_let_go_does_not_strike_at_once():
    """Under `hermite` it leaves the stop with velocity 0, but for 1e-17 m/s that may point down; the reference has two
    contacts, each of which ends once."""
    scene = with_changes(load_scene("beam-on-stop"), time={"t_end": 0.5})
    runs = [event_driven.simulate(scene)]
    for degree, size in ((1, 1e-3), (2, 1e-3), (2, 4e-3)):
        coupling = {"scheme": "hermite", "degree": degree, "macro_step": size}
        runs.append(simulate(with_changes(scene, coupling=coupling)))
    for run in runs:
        kinds = [event.kind for event in run.events if event.kind != "stop_impact"]
        assert kinds == ["seated", "separation"] * 2, run.scene.coupling


def test_a_force_too_large_for_a_double_halves_the_step():
    """Two masses at 10 km/s, C = λ p¹⁰⁰: over a whole step the tip would go 10 km deep. They leave as after any elastic
    impact, (m1 − m2)/(m1 + m2) V and 2 m1/(m1 + m2) V."""
    beam, spring = ({"element": "point_mass", "mass": mass} for mass in (1.0, 2.0))
    scene = with_changes(
        load_scene("soft"),
        time={"t_end": 6.0},
        beam={**beam, "displacement": 1.0, "velocity": -1e4},
        spring=spring,
        stop=None,
        contact={"law": "compliance", "stiffness": 5e-193, "exponent": 100.0},
        coupling={"macro_step": 1.0},
    )
    run = simulate(scene)
    assert run.summary["halved_steps"] > 0
    assert (run.v_tip[-1], run.z[-1]) == pytest.approx((1e4 / 3.0, -2e4 / 3.0), rel=1e-10)
