"""How far two runs are apart in the times of their contacts, on events made by hand."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import scene_from_dict

from springbeam.results.contact_times import contact_changes, foundation_contacts, tip_contacts
from springbeam.results.contact_times import contact_time_difference as difference
from springbeam.results.steps import STEP
from springbeam.results.trajectory import Event, Trajectory

SCENE = scene_from_dict(
    {"time": {"t_end": 1.0}, "beam": {"initial_velocity_slope": -1.0}, "spring": {}, "stop": {"position": -0.1}}
)


def run(*events, phase="free"):
    columns = {"time": np.array([0.0, 1.0]), "phase": np.array([phase, phase])}
    return Trajectory(SCENE, columns, [Event(time, kind) for time, kind in events])


@pytest.mark.parametrize(
    ("kinds", "free_at_end", "found"),
    [
        ("impact release separation", True, [(0.1, 0.3)]),  # above Ψ they still touch
        ("impact release retie", False, [(0.1, 1.0)]),
        ("impact release impact", False, [(0.1, 0.2), (0.3, 1.0)]),
        ("impact release", True, [(0.1, 0.2)]),
        ("impact release", False, [(0.1, 1.0)]),
        ("impact stop_impact separation", True, [(0.1, 0.3)]),
    ],
)
def test_contacts_of_the_tip_begin_with_an_impact_and_end_where_the_ends_part(kinds, free_at_end, found):
    events = [Event(0.1 * (k + 1), kind) for k, kind in enumerate(kinds.split())]
    contacts = tip_contacts(events, 1.0, free_at_end=free_at_end)
    assert np.array(contacts) == pytest.approx(np.array(found), rel=1e-12)


CONTACT = run((0.1, "impact"), (0.4, "separation"))
GRAZE = run((0.1, "impact"), (0.4, "separation"), (0.7, "impact"), (0.7, "separation"))
FLIGHT = run((0.1, "impact"), (0.1, "separation"), (0.105, "impact"), (0.4, "separation"))
SECOND = run((0.1, "impact"), (0.4, "separation"), (0.7, "impact"), (0.8, "separation"))
#: Strokes that die out are one however many.
FEW = run((0.2, "stop_impact"), (0.25, "stop_impact"), (0.26, "seated"), (0.5, "unseated"))
MANY = run(*((0.2 + 0.06 * (1 - 0.5**k), "stop_impact") for k in range(9)), (0.26, "seated"), (0.502, "unseated"))


def slight(share):
    """A stroke, and later one of so much less impulse."""
    events = [Event(time, "stop_impact", impulse_foundation=j) for time, j in ((0.2, 1.0), (0.6, share))]
    return Trajectory(SCENE, HARD.columns, events)


HARD = run((0.2, "stop_impact"))


@pytest.mark.parametrize(
    ("first", "second", "window", "expected"),
    [
        (CONTACT, run((0.103, "impact"), (0.395, "separation")), 0.01, 0.005),
        (run((0.103, "impact"), (0.395, "separation")), CONTACT, 0.01, 0.005),
        # A graze and a flight shorter than the window are no evidence.
        *((a, b, 0.01, 0.0) for other in (GRAZE, FLIGHT) for a, b in ((CONTACT, other), (other, CONTACT))),
        # A lasting contact that one run lacks counts to the end of the run.
        (CONTACT, SECOND, 0.01, 0.3),
        (SECOND, CONTACT, 0.2, 0.0),
        # A release ends the contact only without a push.
        (CONTACT, run((0.1, "impact"), (0.4, "release")), 0.01, 0.0),
        (CONTACT, run((0.1, "impact"), (0.4, "release"), phase="touch"), 0.01, 0.6),
        (FEW, MANY, 0.06, 0.002),
        (run((0.2, "stop_impact")), run((0.2, "stop_impact"), (0.6, "stop_impact")), 0.01, 0.4),
        # A stroke of 0.1 % of the impulse is no evidence, one of 1 % is.
        *((a, b, 0.01, 0.0) for a, b in ((HARD, slight(1e-3)), (slight(1e-3), HARD))),
        (HARD, slight(1e-2), 0.01, 0.4),
    ],
)
def test_how_far_two_runs_are_apart(first, second, window, expected):
    assert difference(first, second, window) == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize(("force", "apart"), [(1e-3, 0.0), (1e-2, 0.3)])
def test_a_short_contact_counts_by_its_impulse(force, apart):
    """1 N for 0.3 s, then ``force`` for 0.1 s with steps of 0.1 s, beside a run without the second contact."""
    steps = np.zeros(11, STEP)
    steps["time"], steps["size"] = np.arange(11) / 10.0, [0.0, *[0.1] * 10]
    steps["contact_force"][2:5] = 1.0
    alone = replace(CONTACT, steps=steps.copy())
    steps["contact_force"][8] = force
    both = replace(SECOND, steps=steps)
    for first, second in ((alone, both), (both, alone)):
        assert difference(first, second, 0.2) == pytest.approx(apart, abs=1e-15)
    kicked = [replace(e, impulse_contact=0.1 * force if e.time == 0.7 else 0.0) for e in SECOND.events]
    impact = replace(both, steps=alone.steps, events=kicked)
    assert difference(alone, impact, 0.2) == pytest.approx(apart, abs=1e-15)


def test_changes_of_contact_are_named_in_their_order():
    events = run(
        (0.0, "impact"), (0.3, "stop_impact"), (0.305, "seated"), (0.35, "unseated"), (0.4, "release"), (0.6, "impact"),
        (0.605, "separation"),
    )  # fmt: skip
    expected = [("closes", 0.0), ("strikes", 0.3), ("leaves", 0.35), ("opens", 0.4)]
    assert contact_changes(events, 0.01) == expected  # the last contact is too short
    strokes = [("strikes", 0.3), ("strikes", 0.305), ("leaves", 0.35)]  # an impact leaves at once, without a rest
    assert contact_changes(events, 0.004)[1:] == [*strokes, ("opens", 0.4), ("closes", 0.6), ("opens", 0.605)]
    # What closes and opens at once is seen without a window.
    assert contact_changes(GRAZE, 0.0)[-2:] == [("closes", 0.7), ("opens", 0.7)]


def test_a_rest_on_the_foundation_ends_where_the_tip_parts_from_it():
    rest = run((0.2, "seated"), (0.5, "separation")).events
    assert foundation_contacts(rest, 1.0) == [(0.2, 0.5)]


@pytest.mark.parametrize(("phase", "last"), [("free", [("opens", 0.4)]), ("touch", [])])
def test_a_last_release_into_touch_opens_nothing(phase, last):
    assert contact_changes(run((0.0, "impact"), (0.4, "release"), phase=phase), 0.01) == [("closes", 0.0), *last]
