"""Scenes whose events decide the motion, and those that once ended in silent garbage, as random grids found them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scenes import scene_from_dict

from springbeam import RunStopped, simulate
from springbeam.monolithic import event_driven
from springbeam.results.trajectory import Trajectory
from springbeam.scene import load_scene, with_changes

#: 50 mg of spring top, pressed by a tip 1000 times as fast as its own motion, on a foundation 1 μm below it.
LIGHT_TOP: dict[str, Any] = {
    "time": {"t_end": 1.1},
    "beam": {
        "young_modulus": 17885.07755576211,
        "shear_modulus": 256499219.47909188,
        "alpha_b": 1.217011381316669e-05,
        "n_elements": 20,
        "distributed_load": -81.33167919511276,
        "initial_deflection_slope": -0.013490073039208586,
        "initial_velocity_slope": -397.50598887880676,
    },
    "spring": {
        "mass": 5.10727730917388e-05,
        "damping": 0.29746331064206644,
        "linear_stiffness": 10.038074989653742,
        "equilibrium": -0.013490073039208586,
    },
    "stop": {"position": -0.0134911314588013, "restitution": 0.0},
    "coupling": {"scheme": "energy", "degree": 2, "macro_step": 0.04588660142843529},
}
#: The joined ends' velocities differ by more than they are, so that one goes up while both go down.
APART_IN_VELOCITY: dict[str, Any] = {
    "time": {"t_end": 0.8},
    "beam": {
        "young_modulus": 6889.121050596661,
        "shear_modulus": 0.1127417158494687,
        "n_elements": 10,
        "n_modes": 4,
        "reduced_integration": True,
        "distributed_load": -2.48839261750369,
        "initial_deflection_slope": -0.006789087967755466,
        "initial_velocity_slope": -3.594559348133762e-05,
    },
    "spring": {
        "mass": 0.0001376684946785231,
        "damping": 0.011145872564707377,
        "linear_stiffness": 85.90959777375905,
        "cubic_stiffness": 0.017965453168076347,
        "equilibrium": -0.006789917349061245,
    },
    "contact": {"impact": "tip"},
    "coupling": {"scheme": "energy", "degree": 1, "macro_step": 0.04073890724982703},
}
#: The tip presses a seated top of 50 mg with 9e6 N, whose last digits would push it through the foundation.
PRESSED: dict[str, Any] = {
    "time": {"t_end": 0.02},
    "beam": {
        "young_modulus": 44366075944.74867,
        "shear_modulus": 1274346676.7082489,
        "alpha_b": 0.06276628539724227,
        "n_elements": 1,
        "reduced_integration": True,
        "initial_deflection_slope": 0.007239936527611721,
        "initial_velocity_slope": -82.54712966911293,
        "approach": "elastic",
    },
    "spring": {
        "mass": 5.068548060276392e-05,
        "damping": 0.11806274695037138,
        "linear_stiffness": 0.0187822957994099,
        "cubic_stiffness": 6.641441049608001,
        "equilibrium": 0.007239936527611721,
    },
    "stop": {"position": 0.007239936525594132, "restitution": 0.7282489335013479},
    "contact": {"impact": "rest"},
    "coupling": {"scheme": "energy", "degree": 0, "macro_step": 0.00020525565830561526},
}
#: A contact that opens and closes again in one step, while the top goes down to the foundation.
TOUCHED_INSIDE: dict[str, Any] = {
    "time": {"t_end": 12.0},
    "beam": {"young_modulus": 100.0, "shear_modulus": 100.0, "n_elements": 20, "initial_velocity_slope": -1.0},
    "spring": {"mass": 1.0, "linear_stiffness": 3.0, "cubic_stiffness": -0.601470260637113},
    "stop": {"position": -0.015, "restitution": 1.0},
    "contact": {"law": "compliance", "stiffness": 1e12, "exponent": 1.5},
    "coupling": {"scheme": "energy", "degree": 0, "macro_step": 0.1},
}
#: A tip without inertia, pushed up and caught again 19 times; its motion is not resolved.
MASSLESS: dict[str, Any] = {
    "time": {"t_end": 0.11678941769204387},
    "beam": {
        "fidelity": "quasi_static",
        "young_modulus": 4.9641101979833895,
        "shear_modulus": 11103.839364632882,
        "initial_deflection_slope": -0.05114935699199129,
        "initial_velocity_slope": -219.82260701189102,
    },
    "spring": {
        "mass": 7.61551708231511e-05,
        "linear_stiffness": 0.7029796552182894,
        "cubic_stiffness": -1.4689769809304957e-06,
        "equilibrium": -0.051841500654440764,
        "external_force": 125.4295156403688,
    },
    "stop": {"position": -0.051841506787638984, "restitution": 0.015759203164818266},
    "coupling": {"scheme": "energy", "degree": 0, "macro_step": 0.00012358335348744304},
}
#: That tip under a load, with degree 2, and damped.
MASSLESS_DAMPED: dict[str, Any] = {
    **MASSLESS,
    "beam": {**MASSLESS["beam"], "alpha_b": 1e-5, "distributed_load": -2.0},
    "coupling": {**MASSLESS["coupling"], "degree": 2},
}
#: Rebounds that would rise less than positions can be told apart go on for ever.
UNSEEN_REBOUNDS: dict[str, Any] = {
    "time": {"t_end": 6.0},
    "beam": {
        "fidelity": "quasi_static",
        "young_modulus": 3394964.8163038185,
        "shear_modulus": 222097213143.90494,
        "alpha_b": 0.016991907407246848,
        "distributed_load": -0.002226947588458922,
        "initial_deflection_slope": 0.02816330172729592,
        "initial_velocity_slope": -0.0010879964298179403,
    },
    "spring": {
        "mass": 5649.570472753743,
        "linear_stiffness": 0.1184600237132991,
        "cubic_stiffness": 5632163.85160786,
        "equilibrium": 0.02816330172729592,
    },
    "stop": {"position": 0.028152738155721495, "restitution": 0.21333047808589017},
    "coupling": {"scheme": "energy", "degree": 0, "macro_step": 0.06447089441077368},
}
SCENES = {
    "light top": LIGHT_TOP,
    "apart in velocity": APART_IN_VELOCITY,
    "pressed": PRESSED,
    "touched inside": TOUCHED_INSIDE,
    "massless": MASSLESS,
    "massless and damped": MASSLESS_DAMPED,
    "unseen rebounds": UNSEEN_REBOUNDS,
}


def overlap(run: Trajectory) -> float:
    """Largest depth of the top below the foundation, of a free tip below the top, or gap of a tie [m]."""
    apart = np.where(
        run.phase == "free", np.maximum(-run.gap, 0.0), np.where(run.phase == "seated", 0.0, np.abs(run.gap))
    )
    if run.scene.contact.law == "compliance":
        apart = np.zeros(1)
    stop = run.scene.stop
    return float(max(apart.max(), 0.0 if stop is None else (stop.position - run.y).max()))


@pytest.mark.parametrize("name", SCENES)
def test_bodies_neither_overlap_nor_part_and_energy_is_kept(name):
    """To 1e-9 m where the tip moves by 0.1 m or more, and 1e-8 of the energy.

    1e-9 m is two ulp of what the force does in the worst of them: 4e5 N would move the light top by 2e6 m in a step.
    """
    scene = SCENES[name]
    run = simulate(scene_from_dict(scene))
    assert run.time[-1] == scene["time"]["t_end"]
    assert overlap(run) < 1e-9
    assert run.summary["max_energy_residual"] < 1e-8


def test_rebounds_that_cannot_be_seen_end_seated():
    """Restitution 0.21 takes the speed of an impact to 1e-8 of it, or to nothing that can be seen, in 12 impacts."""
    run = simulate(scene_from_dict(UNSEEN_REBOUNDS))
    kinds = [event.kind for event in run.events]
    assert kinds.count("stop_impact") <= 12
    assert kinds[-1] == "seated"


def test_bouncing_without_end_stops_by_name(monkeypatch):
    """A damped beam on a lossless stop: its rebounds shrink, but never by enough to be the last."""
    monkeypatch.setattr("springbeam.run.crowd._MAX_IN_STEP", 300)
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


@pytest.mark.parametrize(
    ("scheme", "degree", "size"), [("energy", 2, 1e-2), ("hermite", 1, 1e-3), ("hermite", 2, 1e-3)]
)
@pytest.mark.parametrize(("slope", "load"), [(0.0, -0.5), (0.05, -0.5), (0.05, 0.0)])
def test_a_tip_is_held_at_zero(scheme, degree, size, slope, load):
    """The tip rests where its displacement is 0 while the beam moves: that is a sum of modes as large as the beam's
    deflection, and so is its rounding. Relative to the tip's own motion no force would do."""
    beam = {"distributed_load": load, "initial_deflection_slope": slope, "n_elements": 10}
    stop = {"position": 0.0, "restitution": 0.0}
    coupling = {"scheme": scheme, "degree": degree, "macro_step": size}
    run = simulate(
        with_changes(load_scene("beam-on-stop"), time={"t_end": 0.5}, beam=beam, stop=stop, coupling=coupling)
    )
    seated = run.phase == "seated"
    assert seated.sum() * size > 0.01
    assert np.abs(run.u_tip[seated]).max() < 1e-14
    assert run.summary["halved_steps"] == 0


# -- beside the event-driven reference --------------------------------------------------------------------------------

#: The spring is past the hilltop of its own potential, √(3/4000) m, while the beam, 25 times stiffer, holds it.
PAST_THE_HILLTOP = {
    "time": {"t_end": 0.4},
    "beam": {"young_modulus": 100.0, "shear_modulus": 100.0, "n_elements": 50, "initial_velocity_slope": -1.0},
    "spring": {"mass": 1.0, "linear_stiffness": 3.0, "cubic_stiffness": -4000.0},
    "coupling": {"scheme": "energy", "degree": 2, "macro_step": 2.5e-4},
}
#: After the second release the ends part and graze each other three times within 1.5 ms.
GRAZING = {
    "time": {"t_end": 0.25},
    "beam": {
        "density": 1.0,
        "shear_coefficient": 1.0,
        "area": 1.1948,
        "second_moment_of_area": 0.00356077,
        "young_modulus": 70526.88,
        "shear_modulus": 31842.07,
        "length": 1.0374,
        "n_elements": 16,
        "initial_velocity_slope": -0.882128,
    },
    "spring": {"mass": 0.03937697, "linear_stiffness": 158.2, "cubic_stiffness": 1641670.0},
    "coupling": {"scheme": "energy", "degree": 2, "macro_step": 3.3e-4},
}


@pytest.mark.parametrize(
    ("tables", "bound"), [(PAST_THE_HILLTOP, 1e-11), (GRAZING, 5e-3)], ids=["past the hilltop", "grazing"]
)
def test_the_motion_is_that_of_the_reference(tables, bound):
    scene = scene_from_dict(tables)
    run = simulate(scene)
    rows = np.arange(0, len(run), 20)
    reference = event_driven.simulate(scene, sample_times=run.time[rows])
    for name in ("u_tip", "y"):
        assert np.abs(run[name][rows] - reference[name]).max() <= bound * np.ptp(reference[name]), name


@pytest.mark.parametrize(
    ("scheme", "degree", "lowest", "highest"),
    [("energy", 1, 3.0, 4.5), ("energy", 2, 4.5, 7.0), ("hermite", 1, 3.5, 5.0), ("hermite", 2, 5.0, 7.0)],
)
def test_times_of_separation_have_the_order_of_the_motion(scheme, degree, lowest, highest):
    """C itself has order degree + 1 at the ends of a step, and carries the image of the mismatch with `energy`; errors
    are means over steps of four sizes, since where in a step a separation falls decides."""
    scene = with_changes(scene_from_dict(GRAZING), time={"t_end": 0.06})
    exact = event_driven.simulate(scene, sample_times=[0.0]).events[-1]

    def error(size):
        coupling = {"scheme": scheme, "degree": degree, "macro_step": size}
        event = simulate(with_changes(scene, coupling=coupling)).events[-1]
        assert (event.kind, exact.kind) == ("separation", "separation")
        return np.log2(abs(event.time - exact.time))

    coarse, fine = (np.mean([error(size / parts) for size in 3.3e-4 * np.linspace(0.85, 1.0, 4)]) for parts in (2, 4))
    assert lowest <= coarse - fine <= highest
