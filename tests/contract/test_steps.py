"""fmi2DoStep: which steps are refused, and what a refused step leaves behind."""

from __future__ import annotations

import ctypes as ct
import math
from typing import Any

import pytest

OK, DISCARD, ERROR = 0, 2, 3


@pytest.mark.parametrize("size", [0.0, -1e-3, math.nan, math.inf])
def test_step_size_must_be_positive_and_finite(case: Any, size: float) -> None:
    k = case.running()
    assert k.try_step(0.0, size) == ERROR
    assert "communicationStepSize" in k.message


@pytest.mark.parametrize("time", [1e-3, -1e-3, math.nan])
def test_step_starts_where_the_last_ended(case: Any, time: float) -> None:
    k = case.running()
    assert k.try_step(time, 0.01) == ERROR
    assert "currentCommunicationPoint" in k.message


def test_a_run_may_start_at_any_time(case: Any) -> None:
    start = 1234.5
    early, late = case.running(), case.running(start_time=start)
    early.step(0.0, 0.01)
    late.step(start, 0.01)
    assert late.outputs() == early.outputs()


def test_times_may_be_multiplied_or_summed_and_sizes_be_differences(case: Any) -> None:
    # 1e5 s into a run, times carry 1e-11 s of rounding; 1e-9 of this step would be less.
    k = case.running(start_time=1e5)
    size, time = 1e-3, 1e5
    for i in range(300):
        multiplied = 1e5 + i * size
        following = 1e5 + (i + 1) * size
        k.step(multiplied if i % 2 else time, following - multiplied)
        time += size


def test_no_step_past_the_stop_time(case: Any) -> None:
    k = case.fmu.instance()
    k.setup(stop=0.3)
    k.initialize()
    # 0.1 + 0.1 + 0.1 > 0.3 in floating point: rounding is no reason to refuse.
    time = 0.0
    for _ in range(3):
        k.step(time, 0.1)
        time += 0.1
    assert time > 0.3
    assert k.try_step(time, 0.1) == ERROR
    assert "past the stop time 0.3" in k.message


def test_stop_time_before_start_time_is_refused(case: Any) -> None:
    k = case.fmu.instance()
    assert k.setup(start=1.0, stop=0.5) == ERROR
    assert "stopTime" in k.message


def softening(spring: Any) -> Any:
    return spring.running(linear_stiffness=3.0, cubic_stiffness=-0.2)


def test_escape_of_the_softening_spring_is_discarded_and_leaves_the_state(spring: Any) -> None:
    k, twin = softening(spring), softening(spring)
    for i in range(3):
        k.step(i * 0.1, 0.1)
        twin.step(i * 0.1, 0.1)
    before = k.outputs()
    token = k.state()
    k.set("impulse", 100.0)
    time = 0.1 + 0.1 + 0.1
    assert k.try_step(time, 0.1) == DISCARD
    assert "hilltop" in k.message
    assert k.outputs() == before
    # Nothing was done: the last time that holds is the start of the step.
    reached, status = ct.c_double(), ct.c_int()
    assert k.call("fmi2GetRealStatus", 2, ct.byref(reached)) == OK
    assert reached.value == time
    assert k.call("fmi2GetStatus", 0, ct.byref(status)) == OK
    assert status.value == DISCARD
    # A failed step has to be taken back before the next.
    assert k.try_step(time, 0.01) == ERROR
    k.restore(token)
    for slave in (k, twin):
        slave.step(time, 0.1)
    assert k.outputs() == twin.outputs()


@pytest.mark.parametrize("tolerance", [0.1, 1e-4, 0.0, -1.0, math.nan, 1e-3])
def test_a_loose_tolerance_of_the_importer_changes_nothing(case: Any, tolerance: float) -> None:
    plain, loose = case.fmu.instance(), case.fmu.instance()
    plain.setup()
    assert loose.setup(tolerance=tolerance) == OK
    for k in (plain, loose):
        for name, value in case.parameters.items():
            k.set(name, value)
        k.initialize()
        k.step(0.0, 0.5)
    assert loose.outputs() == plain.outputs()


def test_a_tighter_tolerance_of_the_importer_is_followed(spring: Any) -> None:
    # Softening Duffing from rest at 0.5: the period is 4K(m)/ω with ω² = k1 + k2 A²/2, m = −k2 A²/(2 ω²).
    period = 3.650498199690303
    errors = []
    for tolerance in (None, 1e-9):
        k = spring.instance()
        k.setup(tolerance=tolerance)
        for name, value in {
            "linear_stiffness": 3.0,
            "cubic_stiffness": -0.2,
            "displacement": 0.5,
            "relative_tolerance": 1e-4,
            "absolute_tolerance": 1e-12,
        }.items():
            k.set(name, value)
        k.initialize()
        k.step(0.0, period)
        errors.append(abs(k.get("displacement") - 0.5) + abs(k.get("velocity")))
    assert errors[1] < errors[0] / 100
