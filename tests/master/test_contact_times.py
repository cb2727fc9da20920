"""How far two runs are apart in the times of their contacts, on events made by hand."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import scene_from_dict

from springbeam.results.contact_times import contact_changes
from springbeam.results.contact_times import contact_time_difference as difference
from springbeam.results.trajectory import Event, Trajectory

SCENE = scene_from_dict(
    {"time": {"t_end": 1.0}, "beam": {"initial_velocity_slope": -1.0}, "spring": {}, "stop": {"position": -0.1}}
)


def run(*events, phase="free"):
    columns = {"time": np.array([0.0, 1.0]), "phase": np.array([phase, phase])}
    return Trajectory(SCENE, columns, [Event(time, kind) for time, kind in events])


CONTACT = run((0.1, "impact"), (0.4, "separation"))


def test_a_shift_counts_in_full():
    shifted = run((0.103, "impact"), (0.395, "separation"))
    assert difference(CONTACT, shifted, window=0.01) == (pytest.approx(0.005), 2)
    assert difference(shifted, CONTACT, window=0.01) == (pytest.approx(0.005), 2)


def test_a_graze_and_a_flight_shorter_than_the_window_are_no_evidence():
    graze = run((0.1, "impact"), (0.4, "separation"), (0.7, "impact"), (0.7, "separation"))
    flight = run((0.1, "impact"), (0.1, "separation"), (0.105, "impact"), (0.4, "separation"))
    for other in (graze, flight):
        assert difference(CONTACT, other, window=0.01)[0] == 0.0
        assert difference(other, CONTACT, window=0.01)[0] == 0.0


def test_a_lasting_contact_that_one_run_lacks_counts():
    second = run((0.1, "impact"), (0.4, "separation"), (0.7, "impact"), (0.8, "separation"))
    assert difference(CONTACT, second, window=0.01)[0] == pytest.approx(0.3)  # to the end of the run
    assert difference(second, CONTACT, window=0.2)[0] == 0.0


@pytest.mark.parametrize(
    ("last", "phase", "distance"),
    [((0.4, "release"), "free", 0.0), ((0.4, "release"), "touch", 0.6)],
    ids=["opens", "goes on in touch"],
)
def test_a_release_ends_the_contact_only_without_a_push(last, phase, distance):
    assert difference(CONTACT, run((0.1, "impact"), last, phase=phase), window=0.01)[0] == pytest.approx(distance)


def test_strokes_that_die_out_are_one_however_many():
    few = run((0.2, "stop_impact"), (0.25, "stop_impact"), (0.26, "seated"), (0.5, "unseated"))
    many = run(*((0.2 + 0.06 * (1 - 0.5**k), "stop_impact") for k in range(9)), (0.26, "seated"), (0.502, "unseated"))
    assert difference(few, many, window=0.06) == (pytest.approx(0.002), 2)


def test_a_stroke_that_one_run_lacks_counts():
    assert difference(run((0.2, "stop_impact")), run((0.2, "stop_impact"), (0.6, "stop_impact")), 0.01)[
        0
    ] == pytest.approx(0.4)


def test_changes_of_contact_are_named_in_their_order():
    events = run(
        (0.0, "impact"), (0.3, "stop_impact"), (0.305, "seated"), (0.35, "unseated"), (0.4, "release"), (0.6, "impact"),
        (0.605, "separation"),
    )  # fmt: skip
    expected = [("closes", 0.0), ("strikes", 0.3), ("leaves", 0.35), ("opens", 0.4)]
    assert contact_changes(events, 0.01) == expected  # the last contact is too short
    assert contact_changes(events, 0.004)[-2:] == [("closes", 0.6), ("opens", 0.605)]


@pytest.mark.parametrize(("phase", "last"), [("free", [("opens", 0.4)]), ("touch", [])])
def test_a_last_release_into_touch_opens_nothing(phase, last):
    assert contact_changes(run((0.0, "impact"), (0.4, "release"), phase=phase), 0.01) == [("closes", 0.0), *last]
