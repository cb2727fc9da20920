"""Results that a scene rules out are found in the records: right runs have none, runs made wrong on purpose have."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scenes import named

from springbeam import load_scene, simulate
from springbeam.results.dense import inside
from springbeam.run.contradictions import PLACES, contradictions
from springbeam.run.setup import set_up

SCENES = {
    "pair": lambda: load_scene("soft", ["time.t_end=0.2"]),
    "spring": lambda: load_scene("duffing", ["time.t_end=2", "coupling.macro_step=0.02"]),
    "element on a stop": lambda: named("element on a stop"),
    "beam on a stop": lambda: load_scene("beam-on-stop", ["time.t_end=0.2"]),
}


@cache
def of(name):
    return simulate(SCENES[name]())


def found(run, **changes):
    """What contradicts the scene if records or events are ``changed``."""
    steps = run.steps.copy()
    for field, change in changes.get("steps", {}).items():
        steps[field] += change
    events = changes.get("events", run.events)
    setup = set_up(run.scene)
    places = inside(setup.soft is None, steps, *PLACES).extremes
    return contradictions(setup, steps, events, changes.get("contact_time", 0.0), places)


@pytest.mark.parametrize("name", SCENES)
def test_a_right_run_contradicts_nothing(name):
    run = of(name)
    assert run.summary["resolved"]
    assert found(run, contact_time=run.summary.get("contact_duration_total", 0.0)) == []


@pytest.mark.parametrize(("name", "end"), [("pair", "y"), ("element on a stop", "u_tip"), ("beam on a stop", "u_tip")])
@pytest.mark.parametrize(("share", "seen"), [(0.008, False), (0.012, True)])
def test_an_end_may_be_below_the_rigid_stop_by_a_percent_of_its_range(name, end, share, seen):
    """All of them touch the stop, so that a shift down is how far they are below it."""
    run = of(name)
    down = share * np.ptp(run[end])
    fields = [end, f"{end}_after"]
    told = found(run, steps=dict.fromkeys(fields, -down))
    assert any("below the rigid stop" in text for text in told) == seen


def test_a_tip_may_not_pass_the_top_of_the_spring():
    run = of("pair")
    raised = {"y": 0.02, "y_after": 0.02}
    assert any("below the spring's top" in text for text in found(run, steps=raised))


def test_a_gap_that_a_tie_leaves_inside_a_step_is_none():
    """It is 1.3 % of the motion, while rows have none: joined ends have one motion."""
    run = simulate(load_scene("soft", ["time.t_end=0.2", "coupling.macro_step=4e-3", "coupling.degree=0"]))
    assert found(run) == []


@pytest.mark.parametrize(
    ("number", "time"), [(0, -1.0), (-1, 0.0), (-1, 0.3)], ids=["before the start", "out of order", "after the end"]
)
def test_events_are_in_order_and_within_the_run(number, time):
    run = of("pair")
    events = list(run.events)
    events[number] = replace(events[number], time=time)
    assert len(found(run, events=events)) == 1


def test_contacts_last_no_longer_than_the_run():
    run = of("pair")
    assert found(run, contact_time=0.2) == []
    told = ["contacts last 0.201 s in a run of 0.2 s"]
    assert found(run, contact_time=0.201) == told
    assert found(run, steps={"time": 1.0}, events=[], contact_time=0.201) == told  # begins at 1 s
