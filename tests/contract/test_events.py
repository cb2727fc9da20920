"""Steps of the spring that end at an event (FMI 3.0: early return and event mode)."""

import ctypes as ct
import math

import pytest

OK = 0
#: A top that falls on its foundation: y = -t - t² meets -0.1 at FALL with the velocity -1 - 2 FALL, and loses half.
FALLING = {"linear_stiffness": 0.0, "gravity": 2.0, "velocity": -1.0, "stop_enabled": True, "stop_position": -0.1}
FALLING |= {"restitution": 0.5}
FALL = (math.sqrt(1.4) - 1.0) / 2.0

pytestmark = pytest.mark.parametrize("version", ["3.0"])


def told(k):
    return k.early.value, k.event.value, k.end.value


def handle(k):
    """Event mode."""
    flags = [ct.byref(ct.c_bool(True)) for _ in range(5)]
    assert k.call("EnterEventMode") == OK, k.message
    assert k.call("UpdateDiscreteStates", *flags, ct.byref(ct.c_double())) == OK, k.message
    assert k.call("EnterStepMode") == OK, k.message


def started(fmu, events=True, early=True, **values):
    k = fmu.instance(events=events, early=early).start(**values)
    if events:
        assert k.call("EnterStepMode") == OK
    return k


def test_a_step_ends_at_an_impact_and_event_mode_applies_the_impulse(spring):
    k = started(spring, **FALLING)
    k.step(0.0, 0.2)
    assert told(k) == (True, True, False)
    assert k.reached() == pytest.approx(FALL, rel=1e-12)
    before = -1.0 - 2.0 * FALL
    assert k.get("displacement", "velocity") == pytest.approx([-0.1, before], rel=1e-12)
    assert k.get("number_of_impacts") == 0
    token = k.state()
    handle(k)
    assert k.get("displacement", "velocity", "last_impact_time") == pytest.approx(
        [-0.1, -0.5 * before, FALL], rel=1e-12
    )
    assert k.get("number_of_impacts") == 1
    assert k.get("impact_loss") == pytest.approx(0.375 * before**2, rel=1e-12)
    rows = []
    for again in (False, True):
        if again:  # the event that is due belongs to the state
            k.restore(token)
            handle(k)
        k.step(FALL, 0.05)
        assert told(k) == (False, False, False)
        rows.append(k.outputs())
    assert rows[0] == rows[1]


def test_without_event_mode_the_impulse_is_applied_where_the_step_ends(spring):
    k = started(spring, events=False, **FALLING)
    twin = started(spring, **FALLING)
    for one in (k, twin):
        one.step(0.0, 0.2)
    handle(twin)
    assert told(k) == (True, False, False)
    assert k.outputs() == twin.outputs()


def test_event_mode_keeps_the_derivatives_of_inputs(spring):
    k = started(spring, **FALLING)
    twin = started(spring, **FALLING)
    for one in (k, twin):
        one.derive("external_force", 1, 3.0)
    handle(k)
    for one in (k, twin):
        one.step(0.0, 0.05)
    assert k.outputs() == twin.outputs()


@pytest.mark.parametrize("events", [True, False])
def test_where_early_return_is_forbidden_steps_are_those_of_fmi_2(spring, fmus, events):
    k = started(spring, events=events, early=False, **FALLING)
    old = fmus["2.0"]["spring"].running(**FALLING)
    for i in range(10):
        for one in (k, old):
            one.step(0.2 * i, 0.2)
        assert told(k) == (False, False, False)
        assert k.outputs() == old.outputs()
    assert k.get("number_of_impacts") > 3


def test_impacts_that_die_out_are_a_few_events_and_end_at_rest(spring):
    """Each is told once: as many events as impacts, and at last a release by a force that lifts the top."""
    k = started(spring, **FALLING)
    time = 0.0
    events = 0
    while time < 2.0:
        k.step(time, 2.0 - time)
        time = k.reached()
        if k.event.value:
            events += 1
            handle(k)
    impacts = k.get("number_of_impacts")
    assert (events, k.get("velocity")) == (impacts, 0.0)
    assert 5 < impacts < 50
    k.derive("external_force", 1, 4.0)  # more than m g = 2 after 0.5 s
    k.step(time, 1.0)
    assert told(k) == (True, True, False)
    assert k.reached() == pytest.approx(time + 0.5, rel=1e-12)
    handle(k)
    k.set("external_force", 2.1)
    k.step(k.reached(), 0.3)
    assert told(k) == (False, False, False)
    assert k.get("displacement") == pytest.approx(-0.1 + 0.1 * 0.3**2 / 2, rel=1e-9)


def test_event_mode_takes_inputs_and_no_parameters(spring):
    """An input acts after an update, too."""
    k = spring.instance(events=True).start(mass=2.0)
    k.set("contact_force", 3.0)
    flags = [ct.byref(ct.c_bool(True)) for _ in range(5)]
    assert k.call("UpdateDiscreteStates", *flags, ct.byref(ct.c_double())) == OK, k.message
    assert k.get("acceleration") == -1.5
    assert k.access("SetFloat64", spring.references("mass"), 1, (ct.c_double * 1)(4.0)) != OK
    assert "'mass' can only be set before the end of initialization mode" in k.message
