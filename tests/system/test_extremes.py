"""Scenes that once ended in silent garbage, each as the grid of `springbeam stability` found it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from springbeam import simulate
from springbeam.scene import scene_from_dict
from springbeam.trajectory import Trajectory

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


def overlap(run: Trajectory) -> float:
    """Largest depth of the top below the foundation, of a free tip below the top, or gap of a tie [m]."""
    apart = np.where(
        run.phase == "free", np.maximum(-run.gap, 0.0), np.where(run.phase == "seated", 0.0, np.abs(run.gap))
    )
    stop = run.scene.stop
    return float(max(apart.max(), 0.0 if stop is None else (stop.position - run.y).max()))


@pytest.mark.parametrize("scene", [LIGHT_TOP, APART_IN_VELOCITY], ids=["light top", "apart in velocity"])
def test_bodies_neither_overlap_nor_part_and_energy_is_kept(scene):
    """Both bounds of the grid: 1e-9 of the motion (the tip's ω₁ amplitude is some 0.1 m), 1e-8 of the energy."""
    run = simulate(scene_from_dict(scene))
    assert run.time[-1] == scene["time"]["t_end"]
    assert overlap(run) < 1e-10
    assert run.summary["max_energy_residual"] < 1e-8
