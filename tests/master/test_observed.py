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


@pytest.mark.parametrize("kind", ["separation", "release", "stop_impact", "seated"])
@pytest.mark.parametrize(("before", "at"), [(-0.3, 0.1), (0.0, 0.3)])
def test_the_impulse_of_a_mismatch_is_over_the_momentum_of_the_body_it_changes_more(kind, before, at):
    """2/3 kg times 0.3 m/s, at the event or a step before: it alternates. The top has 0.4 kg·m/s, the tip 1."""
    steps = records(Phase(Joint.TIED), v_tip=[0.0, 0.5, 0.4 + before, 0.4 + at], z=[0.0, 0.4, 0.4, 0.4])
    seen = observed(*pair(), steps, [Event(3 * H, EventKind(kind))])
    assert seen.mismatch_at_events == pytest.approx(0.2 / 0.4, rel=1e-12)


def test_on_the_foundation_a_mismatch_is_the_tips_alone():
    steps = records(Phase(Joint.TIED, seated=True), v_tip=[0.5, 0.0, -0.1, 0.3], z=[0.0] * 4)
    seen = observed(*pair(), steps, [Event(3 * H, EventKind.UNSEATED)])
    assert seen.mismatch_at_events == pytest.approx(0.3 / 0.5, rel=1e-12)


def test_a_beam_has_the_momentum_of_its_slowest_swing():
    """Its inertia at the tip times the tip's range in 2/ω₁, where the tip itself is slower than that."""
    steps = records(Phase(Joint.TIED, seated=True), u_tip=[0.0, 4.0, 4.0, 4.0], v_tip=[0.0, 0.0, 0.0, 0.3])
    seen = observed(*pair(), steps, [Event(3 * H, EventKind.UNSEATED)])
    momentum = tip_inertia(SCENE.beam) * 4.0 * 0.5 * slowest_frequency(SCENE.beam)
    assert seen.momentum == pytest.approx(momentum, rel=1e-12)
    assert seen.mismatch_at_events == pytest.approx(TIP * 0.3 / momentum, rel=1e-12)


@pytest.mark.parametrize(("later", "mismatch"), [(0.4, 0.1), (1.4, np.hypot(0.1, 0.5))])
def test_a_stroke_within_a_macro_step_of_another_is_not_counted(later, mismatch):
    """The rebounds that die out are as slow as one likes, and what the scheme leaves the ends is not."""
    steps = records(Phase(Joint.TIED), v_tip=[0.0, 0.5, 0.4, 0.5, 0.9], z=[0.0, 0.4, 0.4, 0.4, 0.4])
    steps["events"][-2:], steps["phase"][-1] = (1.0, 2.0), steps["phase"][0]
    steps["time"][-1] = steps["time"][-2] + later * H
    strokes = [Event(float(time), EventKind.STOP_IMPACT) for time in steps["time"][-2:]]
    seen = observed(*pair(), steps, strokes)
    assert seen.mismatch_at_events == pytest.approx(2.0 / 3.0 * mismatch / 0.4, rel=1e-12)


@pytest.mark.parametrize("kind", ["separation", "stop_impact"])
def test_mismatches_of_all_events_add_up(kind):
    """0.5 m/s at rows 3 and 4 and 0.1 m/s at row 6, of ends that stay tied in the records."""
    steps = records(Phase(Joint.TIED), v_tip=[0.0, 0.4, 0.4, 0.9, 0.9, 0.4, 0.5], z=[0.0, *6 * [0.4]])
    steps["phase"], steps["events"] = steps["phase"][0], [0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 3.0]
    events = [Event(time * H, EventKind(kind)) for time in (3.0, 4.5, 6.0)]
    steps["time"][4:] += 0.5 * H
    apart = np.linalg.norm([0.5, 0.5, 0.1])
    assert observed(*pair(), steps, events).mismatch_at_events == pytest.approx(2.0 / 3.0 * apart / 0.4, rel=1e-12)


@pytest.mark.parametrize("number", [3, 4, 30])
@pytest.mark.parametrize("seated", [False, True])
def test_at_degree_0_the_force_before_ends_part_tells(number, seated):
    """It falls by 2 N a step and goes up and down by 3 N, and turns a mismatch of ±0.01 m/s round besides; one step is
    off by 9 N, which the median leaves out, and earlier ones, by 50 N more, are too long ago. An event cuts the last
    one. Of a force of two steps alone nothing is known: the mismatch tells."""
    phase, n, mass = Phase(Joint.TIED, seated), np.arange(number), TIP if seated else TIP * TOP / (TIP + TOP)
    w = 0.01 * (-1.0) ** n
    both = 0.0 if seated else 0.5
    steps = records(phase, v_tip=both + w, z=np.full(number, both))
    steps["size"][-1] = 0.4 * H
    force = 20.0 - 2.0 * n + (3.0 + 50.0 * (n < number - 8)) * (-1.0) ** n + 9.0 * (n == number - 8)
    turning = mass * np.append(0.0, np.diff(w)) / np.where(n > 0, steps["size"], H)
    steps["foundation_force" if seated else "contact_force"] = force + turning
    seen = observed(*pair(degree=0), steps, [Event(H * (number - 1), EventKind.SEPARATION)])
    momentum = TIP * 0.01 if seated else TOP * 0.5
    alternates = number > 3
    assert seen.alternation == pytest.approx(3.0 * H / momentum if alternates else 0.0, rel=1e-9)
    assert seen.mismatch_at_events == pytest.approx(0.0 if alternates else mass * 0.01 / momentum, rel=1e-9)
