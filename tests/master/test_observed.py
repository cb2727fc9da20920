"""What the records of a run show of its resolution, with made-up records of two masses."""

import numpy as np
import pytest
from bodies import DuffingBody, Upper

from springbeam.bodies.elements import RigidWall
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


@pytest.mark.parametrize(("mismatch", "size", "swing"), [(9.0, H, 2e-3), (4.0, H, 1e-3), (9.0, 0.9 * H, 0.0)])
def test_rows_that_go_up_and_down_about_a_smooth_curve_jitter(mismatch, size, swing):
    """y = (n/10)³ ± 2 mm while tied, at rows H apart; but no more than the mismatch parts the ends, w H/4."""
    n = np.arange(8)
    y = (n / 10.0) ** 3 + 2e-3 * (-1.0) ** n
    steps = records(Phase(Joint.TIED), y=y, u_tip=2.0 * y, v_tip=np.append(np.zeros(7), 1e-3 * mismatch / H))
    steps["phase"], steps["size"][1:] = steps["phase"][0], size
    assert observed(*pair(), steps, []).jitter == pytest.approx(swing / np.ptp(y), rel=1e-9, abs=1e-12)


def sinking(depth, force):
    """Steps in which the top rises past the resting tip on straight lines, to ``depth`` [m] at the rows."""
    steps = records(Phase(), z=np.append(0.0, np.diff(depth)) / H)
    steps["z_after"] = np.append(np.diff(depth), 0.0) / H
    steps["y"] = steps["y_after"] = depth
    before = np.append(0.0, depth[:-1])
    steps["y_integral"], steps["y_integral_2"] = 0.5 * H * (before + depth), H**2 * (2.0 * before + depth) / 6.0
    steps["contact_force"] = force
    return steps


def test_a_contact_is_late_by_each_steps_own_penetration():
    """x²/12 of each step, x² = 2 λ p (1/2 + 1) H² of the deeper of its ends."""
    stiffness, depth = 3.0, np.array([0.0, 0.1, 0.2, -0.1])
    seen = observed(*pair(0, law="compliance", stiffness=stiffness, exponent=2.0), sinking(depth, 1.0), [])
    assert seen.late == pytest.approx(2.0 * stiffness * (0.1 + 0.2 + 0.2) * 1.5 * H**3 / 12.0, rel=1e-12)
    assert seen.contact_frequency == pytest.approx(np.sqrt(2.0 * stiffness * 0.2 * 1.5), rel=1e-12)


@pytest.mark.parametrize("law", ["compliance", "link"])
def test_a_force_misses_the_law_by_its_impulse_along_the_path(law):
    """λ p² where 1 N acts; in the last step contact opens 2/3 on. Or k p. The top has 300 kg·m/s."""
    stiffness, depth = 3.0, np.array([0.0, 0.1, 0.2, -0.1])
    asked = stiffness * np.array([0.1**2 / 3.0, (0.2**3 - 0.1**3) / 0.3, 2.0 / 3.0 * 0.2**2 / 3.0])
    if law == "link":
        asked = stiffness * 0.5 * (depth[:-1] + depth[1:])
    seen = observed(*pair(law=law, stiffness=stiffness, exponent=2.0), sinking(depth, 1.0), [])
    assert seen.missed == pytest.approx(H * np.linalg.norm(asked - 1.0) / 300.0, rel=1e-4)


def test_a_contact_between_two_rows_is_seen():
    """p = 1.6 s (1 − s) − 0.1 m on a step: where no row shows it and no force acts, the law asks for ∫ λ p₊ dτ."""
    steps = sinking(np.array([-0.1, -0.1]), 0.0)
    steps["z_after"][0], steps["z"][1] = 1.6 / H, -1.6 / H
    steps["y_integral"] += 1.6 * H / 6.0
    steps["y_integral_2"] += 1.6 * H**2 / 12.0
    seen = observed(*pair(law="compliance", stiffness=3.0, exponent=1.0), steps, [])
    assert seen.contact_frequency == pytest.approx(np.sqrt(3.0 * 1.5), rel=1e-12)
    half = np.sqrt(0.3 / 1.6)  # of the time that it lasts
    assert seen.missed == pytest.approx(3.0 * H * 4.0 / 3.0 * 0.3 * half / (1.6 / H), rel=1e-2)


@pytest.mark.parametrize("law", ["compliance", "link"])
def test_a_force_misplaces_the_lower_end_by_its_course_inside_steps(law):
    """C is the mean of what the law asks for on two steps on which p grows by 0.1 m each: it acts too early in both."""
    stiffness, depth = 3.0, np.array([0.0, 0.1, 0.2])
    steps = sinking(depth, stiffness * np.array([0.0, 0.05, 0.15]))
    seen = observed(*pair(law=law, stiffness=stiffness, exponent=1.0), steps, [])
    course = stiffness * 0.1 * H**2 * (1.0 / 4.0 - 1.0 / 6.0)  # ∫ (H − τ) C dτ
    assert seen.missed == pytest.approx(0.0, abs=1e-15)
    assert seen.misplaced == pytest.approx(2.0 * course / TOP / 0.2, rel=1e-9)
    steps["contact_force"], steps["contact_force_rate"] = stiffness * np.array([0.0, 0.0, 0.1]), stiffness * 0.1 / H
    assert observed(*pair(law=law, stiffness=stiffness, exponent=1.0), steps, []).misplaced < 1e-15


@pytest.mark.filterwarnings("error")
def test_an_elastic_stop_is_not_misplaced():
    """It has no momentum either: the body that moves is the tip."""
    scene, both = pair(law="compliance", stiffness=3.0, exponent=1.0)
    both.lower = RigidWall(0.0)
    steps = sinking(np.array([0.0, 0.1]), 1.0)
    steps["y"] = steps["y_after"] = steps["z"] = steps["z_after"] = 0.0
    steps["v_tip"] = steps["v_tip_after"] = -1.0
    seen = observed(scene, both, steps, [])
    assert (seen.misplaced, seen.momentum) == (0.0, TIP)


def test_strokes_count_by_their_impulse_and_twice():
    """The top has 1 kg·m/s: 2 N·s turns it round, 0.25 N·s counts a quarter of that of 1 N·s or more."""
    kinds = [("impact", 0.0), ("separation", 0.0), ("stop_impact", 2.0), ("stop_impact", 0.25), ("seated", 0.0)]
    steps = records(Phase(), z=np.ones(9))
    steps["events"] = len(kinds)
    events = [Event(H * n, EventKind(kind), impulse_foundation=impulse) for n, (kind, impulse) in enumerate(kinds)]
    assert observed(*pair(), steps, events).contacts == 1.0 + 2.0 * 1.25
    assert observed(*pair(), steps, []).contacts == 1.0
