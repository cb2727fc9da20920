"""What the records of a run show of its resolution, with made-up records of two masses."""

import numpy as np
import pytest
from bodies import DuffingBody, Upper

from springbeam.contact.phases import Joint, Phase
from springbeam.results.steps import STEP
from springbeam.results.trajectory import Event, EventKind
from springbeam.run.observed import observed
from springbeam.run.stepping import Pair
from springbeam.scene import load_scene, with_changes
from springbeam.scene.resolution import slowest_frequency
from springbeam.scene.statics import tip_inertia

#: Of 2 kg above and 1 kg below; the tip of the records rests, so that no motion of a beam adds to its momentum.
TIP, TOP, H = 2.0, 1.0, 1e-3
SCENE = with_changes(load_scene("soft"), coupling={"macro_step": H})


def pair(degree=1, **contact):
    scene = with_changes(SCENE, contact=contact, coupling={"degree": degree})
    return scene, Pair(scene, Upper(TIP), DuffingBody(TOP))


def records(phase, **columns):
    """Steps of H in ``phase``, whose last one ends on an event; ``columns`` are those before and after it."""
    number = len(next(iter(columns.values())))
    steps = np.zeros(number, STEP)
    steps["time"], steps["size"] = H * np.arange(number), np.where(np.arange(number), H, 0.0)
    steps["phase"], steps["events"][-1] = phase.number, 1.0
    steps["phase"][-1] = Phase(Joint.FREE).number
    for name, values in columns.items():
        steps[name] = steps[f"{name}_after"] = values
    return steps


def test_ends_move_with_both_masses_unless_the_lower_one_is_held():
    _, both = pair()
    assert both.reduced_mass(Phase(Joint.TIED)) == pytest.approx(TIP * TOP / (TIP + TOP), rel=1e-15)
    assert both.reduced_mass(Phase(Joint.TIED, seated=True)) == TIP


def test_a_beam_has_the_momentum_of_its_slowest_swing():
    """Its inertia at the tip times the tip's range in 2/ω₁, where the tip itself is slower than that."""
    steps = records(Phase(Joint.TIED, seated=True), u_tip=[0.0, 4.0, 4.0, 4.0], v_tip=[0.0, 0.0, 0.0, 0.3])
    seen = observed(*pair(), steps, [Event(3 * H, EventKind.UNSEATED)])
    momentum = tip_inertia(SCENE.beam) * 4.0 * 0.5 * slowest_frequency(SCENE.beam)
    assert seen.momentum == pytest.approx(momentum, rel=1e-12)
