"""Saved states: the same step repeated is the same to the last bit, here and in another instance."""

import ctypes as ct

import pytest

OK, ERROR = 0, 3
PHASES = ["instantiated", "initialization", "stepping"]


def advance(case, k, time, steps, impulse):
    """A run with changing inputs; all outputs after every step."""
    rows = []
    for i in range(steps):
        k.set(case.force, 0.1 * (i + 1))
        k.derive(case.force, 1, -0.3 * i)
        if i == 1:
            k.set(case.impulse, impulse)
        size = 0.01 * (1 + i % 3)
        k.step(time, size)
        time += size
        rows.append(k.outputs())
    return rows


def test_the_bytes_of_a_state_are_all_that_another_instance_needs(case):
    """tests/fuzz repeats steps from their states."""
    k, twin, fresh = case.moving(), case.moving(), case.instance()
    for one in (k, twin):
        advance(case, one, 0.0, 3, 0.2)
    time, blob = 0.01 + 0.02 + 0.03, k.serialized()
    assert twin.serialized() == blob  # no pointers in it
    first = advance(case, k, time, 7, 0.2)
    k.free()
    fresh.restore(fresh.deserialized(blob))
    assert advance(case, fresh, time, 7, 0.2) == first
    assert fresh.serialized() != blob


@pytest.mark.parametrize("overwritten", [False, True])
def test_inputs_that_were_not_set_yet_belong_to_the_state(case, overwritten):
    """A state from outside may know a force, or come from an instance that does not."""
    k, other = case.moving(), case.moving()
    other.set(case.force, 0.7)
    token = k.deserialized(other.serialized())
    if overwritten:
        assert k.call("GetFMUState", ct.byref(token)) == OK
    k.set(case.force, 0.2)
    k.restore(token)
    assert k.get(case.force) == (0.0 if overwritten else 0.7)


@pytest.mark.parametrize("phase", PHASES)
def test_a_state_carries_its_phase_parameters_and_time(case, phase):
    def finish(k):
        if phase == "instantiated":
            assert k.try_enter(2.0) == OK
        if phase != "stepping":
            assert k.call("ExitInitializationMode") == OK
        k.step(2.01 if phase == "stepping" else 2.0, 0.02)
        return list(k.outputs())

    k, fresh = case.instance(), case.instance()
    values = {"start_time": 2.0, **case.parameters}
    if phase == "instantiated":
        del values["start_time"]
        for name, value in values.items():
            k.set(name, value)
    elif phase == "initialization":
        k.enter(**values)
    else:
        k.start(**values).step(2.0, 0.01)
    blob = k.serialized()
    expected = finish(k)
    # Into an instance that knows nothing of all this.
    fresh.restore(fresh.deserialized(blob))
    assert finish(fresh) == expected


@pytest.mark.parametrize("same", [True, False], ids=["same parameters", "others"])
def test_a_state_carries_the_set_up_of_the_run_and_derivatives_of_inputs(case, same):
    """When the run ends, its tolerance, and both orders: bytes in an instance that is built without them."""
    loose = {"relative_tolerance": 1e-3, "absolute_tolerance": 1e-3} if case.name == "spring" else {}
    k = case.moving(**loose, stop_time=0.15, tolerance=1e-13)
    other = case.moving(**loose) if same else case.running(tolerance=1e-13)
    k.set(case.force, 0.3)
    k.derive(case.force, 1, 50.0)
    k.derive(case.force, 2, -700.0)
    other.restore(other.deserialized(k.serialized()))
    for one in (k, other):
        one.step(0.0, 0.1)
    assert other.outputs() == k.outputs()
    assert other.try_step(0.1, 0.1) == ERROR
    assert "goes past the stop time 0.15" in other.message


def damaged(blob, position):
    return blob[:position] + bytes([blob[position] ^ 0x55]) + blob[position + 1 :]


@pytest.mark.parametrize(
    ("damage", "why"),
    [
        (lambda b: b"", "0 bytes are fewer"),
        (lambda b: b[:40], "40 bytes are fewer"),
        (lambda b: damaged(b, 0), "not written by the FMU"),
        (lambda b: damaged(b, 20), "not written by the FMU"),
        (lambda b: b[:-8], "checksum"),
        (lambda b: b + b"\0" * 8, "checksum"),
        (lambda b: damaged(b, len(b) - 1), "checksum"),
        (lambda b: bytes(len(b)), "not written by the FMU"),
    ],
)
def test_foreign_bytes_are_refused_with_the_reason(case, damage, why):
    k = case.moving()
    blob = k.serialized()
    assert k.status(k.deserialized, damage(blob)) == ERROR
    assert why in k.message


def test_a_state_of_the_other_fmu_is_refused(beam, spring):
    blob = beam.running().serialized()
    k = spring.running()
    assert k.status(k.deserialized, blob) == ERROR
    assert f"not written by the FMU {spring.description.guid}" in k.message
