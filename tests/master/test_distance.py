"""How far two runs are apart: each part on runs whose difference is known."""

from dataclasses import replace

import numpy as np
import pytest
from runs import a_trajectory

from springbeam import load_scene, simulate, with_changes
from springbeam.motion.events import Event, EventKind
from springbeam.results.contact_changes import contact_changes
from springbeam.results.distance import apart, distance, motion
from springbeam.results.spans import FLOOR, ROUNDING, span

TIMES = np.linspace(0.0, 1.0, 11)


def test_a_range_has_a_floor_and_differences_within_rounding_are_none():
    """An end at 0 whose position is rounded to 1e-13 m, and one that stays at 2 m."""
    still = np.zeros(3)
    assert span(still, 1e-13) == FLOOR * 1e-13
    assert span(still + 2.0) == FLOOR * ROUNDING * 2.0
    assert span([0.0, -0.3, 0.1], 1e-13) == 0.3
    assert apart(still + 1e-12, still, 1e-13) == pytest.approx(0.9e-12 / (FLOOR * 1e-13))
    assert not apart(still + 1e-13, still, 1e-13).any()
    assert apart(still + 1e-12, still) == pytest.approx(1e-12)


def test_the_parts_of_a_distance_are_those_of_runs_made_different():
    """All times of the contact are 1 ms later, all impulses a tenth smaller, both peaks 83 and 100 N."""
    run = simulate(with_changes(load_scene("soft"), beam={"n_elements": 4}, time={"t_end": 0.1}))
    later = replace(
        run,
        events=[
            replace(
                event,
                time=event.time + 1e-3,
                impulse_contact=0.9 * event.impulse_contact,
                impulse_foundation=0.9 * event.impulse_foundation,
            )
            for event in run.events
        ],
    )
    first = run.events[0].time
    assert distance(run, run, 1e-4) == (0.0, 0.0, 0.0, None, 0.0, 0.0)
    found = distance(later, run, 1e-4)
    assert found.motion == 0.0
    assert found.times == pytest.approx(1e-3 / (0.1 - run.time[0]), rel=1e-9)
    assert found.impulses == pytest.approx(0.1 / 0.9, rel=1e-9)  # over the smaller of both
    assert first < 0.1
    none = replace(run, events=[replace(event, impulse_contact=0.0, impulse_foundation=0.0) for event in run.events])
    assert distance(none, run, 1e-4).impulses == distance(run, none, 1e-4).impulses == 1.0


def test_curves_are_compared_between_the_rows_too_and_the_peaks_of_a_soft_force():
    """Beside 2001 times; in steps of 4 ms, between whose rows most of the difference lies."""
    contact = {"law": "compliance", "stiffness": 1e4, "exponent": 1.0}
    scene = with_changes(load_scene("soft"), contact=contact, beam={"n_elements": 4}, time={"t_end": 0.05})
    coarse, fine = (simulate(with_changes(scene, coupling={"macro_step": size})) for size in (4e-3, 1e-3))
    found = distance(coarse, fine, 5e-5)
    peaks = [run.summary["contact_force_max"] for run in (coarse, fine)]
    assert found.force == pytest.approx(1.0 - min(peaks) / max(peaks), rel=1e-12)
    times = np.linspace(0.0, 0.05, 2001)
    assert found.motion == pytest.approx(motion(coarse.at(times).columns, fine.at(times).columns), rel=0.05)
    assert found.motion > 1.2 * motion(coarse.at(coarse.time).columns, fine.at(coarse.time).columns)


def test_a_rest_on_the_foundation_begins_and_ends():
    events = [Event(0.2, EventKind.SEATED, seated=True), Event(0.4, EventKind.UNSEATED)]
    found = contact_changes(a_trajectory(events=events), 1e-3)
    assert [(change.kind, change.time) for change in found] == [("strikes", 0.2), ("leaves", 0.4)]


def test_contacts_are_one_that_follow_each_other_within_the_window_however_long_they_last():
    times = [(0.0, 0.5), (0.52, 0.7), (0.9, 1.0)]
    events = [
        event
        for closed, opened in times
        for event in (Event(closed, EventKind.IMPACT, joint="touch"), Event(opened, EventKind.SEPARATION))
    ]
    found = contact_changes(a_trajectory(events=events), 0.05)
    joined_times = [("closes", 0.0), ("opens", 0.7), ("closes", 0.9), ("opens", 1.0)]
    assert [(change.kind, change.time) for change in found] == joined_times
