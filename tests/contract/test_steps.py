"""fmi2DoStep: which steps are refused, and what a refused step leaves behind."""

import math

import pytest

OK, DISCARD, ERROR = 0, 2, 3


def test_times_may_be_multiplied_or_summed_and_sizes_be_differences(case):
    # 1e5 s into a run, times carry 1e-11 s of rounding; 1e-9 of this step would be less.
    k = case.moving(start_time=1e5)
    size, time = 1e-3, 1e5
    for i in range(300):
        multiplied = 1e5 + i * size
        following = 1e5 + (i + 1) * size
        k.step(multiplied if i % 2 else time, following - multiplied)
        time += size


def test_no_step_past_the_stop_time(case):
    k = case.running(stop_time=0.3)
    # 0.1 + 0.1 + 0.1 > 0.3 in floating point: rounding is no reason to refuse.
    time = 0.0
    for _ in range(3):
        k.step(time, 0.1)
        time += 0.1
    assert time > 0.3
    assert k.try_step(time, 0.1) == ERROR
    assert "past the stop time 0.3" in k.message


AHEAD = {"contact_law": 2, "communication_step": 1e-3, "tip_response": 1e-4}
#: FMU, parameters, inputs of a step that is refused, its size, the size of one that is not, and what is said.
REFUSALS = [
    ("beam", {}, {"tip_impulse": 1e308}, 0.1, 0.1, "not finite"),
    ("beam", {"integrator": 2}, {"tip_force": 1e308}, 0.1, 0.1, "not finite"),
    ("beam", {"communication_step": 1e-3}, {"tip_force": 1e308}, 1e-3, 1e-3, "not finite"),
    ("spring", {"linear_stiffness": 3.0, "cubic_stiffness": -0.2}, {"impulse": 100.0}, 1.0, 1e-3, "past its hilltop"),
    ("spring", {"linear_stiffness": 1e6}, {"contact_force": 1.0}, 1e6, 1e-3, "too much of the motion"),
    ("spring", {"linear_stiffness": 3.0}, {"contact_force": 1e308}, 0.1, 0.1, "range of floating-point numbers"),
    ("spring", AHEAD, {"tip_displacement": -1e-3}, 2e-3, 1e-3, "a step of 0.002 s, but communication_step = 0.001 s"),
    ("spring", AHEAD, {"tip_velocity_forecast": -1e308}, 1e-3, 1e-3, "no contact force was found"),
]


@pytest.mark.parametrize(("name", "parameters", "inputs", "size", "smaller", "why"), REFUSALS)
def test_after_any_refusal_a_master_goes_on(loaded, name, parameters, inputs, size, smaller, why):
    """With another step or other inputs, without restoring a state, as if the refused step had not been tried."""
    k, twin = (loaded[name].running(**parameters) for _ in range(2))
    for slave in (k, twin):
        slave.step(0.0, 1e-3)
    before = k.outputs()
    told = k.integer("warnings")
    token = k.state()
    start = {i: k.get(i) for i in inputs}
    for i, value in inputs.items():
        k.set(i, value)
    assert k.try_step(1e-3, size) == DISCARD
    assert why in k.message
    assert k.integer("warnings") == told + 1  # in the results, where messages are hidden
    # Nothing was done: the last time that holds is the start of the step.
    assert k.reached() == 1e-3
    if size != smaller:  # the inputs are still there
        k.step(k.reached(), smaller)
        assert k.outputs() != before
        k.restore(token)
    for i, value in start.items():
        k.set(i, value)
    for slave in (k, twin):
        slave.step(1e-3, smaller)
    assert k.outputs() == twin.outputs()


@pytest.mark.parametrize("tolerance", [0.1, 1e-4, 0.0, -1.0, math.nan, 1e-3])
def test_a_loose_tolerance_of_the_importer_changes_nothing(case, tolerance):
    plain, loose = case.moving(), case.moving(tolerance=tolerance)
    for k in (plain, loose):
        k.step(0.0, 0.5)
    assert loose.outputs() == plain.outputs()


def test_a_tighter_tolerance_of_the_importer_is_followed(spring):
    # Softening Duffing from rest at 0.5: the period is 4K(m)/ω with ω² = k1 + k2 A²/2, m = −k2 A²/(2 ω²).
    period = 3.650498199690303
    values = {"linear_stiffness": 3.0, "cubic_stiffness": -0.2, "displacement": 0.5}
    values |= {"relative_tolerance": 1e-4, "absolute_tolerance": 1e-12}
    errors = []
    for tolerance in (None, 1e-9):
        k = spring.running(**values, tolerance=tolerance)
        k.step(0.0, period)
        errors.append(abs(k.get("displacement") - 0.5) + abs(k.get("velocity")))
    assert errors[1] < errors[0] / 100
