"""Saved states: the same step repeated is the same to the last bit, here and in another instance."""

from __future__ import annotations

import ctypes as ct
from typing import Any

import pytest

OK, ERROR = 0, 3
PHASES = ["instantiated", "initialization", "stepping"]


def advance(case: Any, k: Any, time: float, steps: int, impulse: float = 0.0) -> list[list[float]]:
    """A run with changing inputs; all outputs after every step."""
    rows = []
    for i in range(steps):
        k.set(case.force, 0.1 * (i + 1))
        assert k.derive(case.force, 1, -0.3 * i) == OK
        if impulse and i == 1:
            k.set(case.impulse, impulse)
        size = 0.01 * (1 + i % 3)
        k.step(time, size)
        time += size
        rows.append(k.outputs())
    return rows


@pytest.mark.parametrize("impulse", [0.0, 0.2])
def test_repeat_from_a_saved_state_is_bit_identical(case: Any, impulse: float) -> None:
    k = case.running()
    advance(case, k, 0.0, 3, impulse)
    time = 0.01 + 0.02 + 0.03
    token = k.state()
    first = advance(case, k, time, 7, impulse)
    for _ in range(3):
        k.restore(token)
        assert advance(case, k, time, 7, impulse) == first


def test_pending_inputs_belong_to_the_state(case: Any) -> None:
    k = case.running()
    k.set(case.force, 0.7)
    assert k.derive(case.force, 1, 2.0) == OK
    assert k.derive(case.force, 2, -5.0) == OK
    k.set(case.impulse, 0.1)
    token = k.state()
    k.step(0.0, 0.05)
    first = k.outputs()
    k.set(case.force, 0.0)
    k.restore(token)
    assert k.get(case.force, case.impulse) == [0.7, 0.1]
    k.step(0.0, 0.05)
    assert k.outputs() == first


@pytest.mark.parametrize("overwritten", [False, True])
def test_inputs_that_were_not_set_yet_belong_to_the_state(case: Any, overwritten: bool) -> None:
    """A state from outside may know a force, or come from an instance that does not."""
    k, other = case.running(), case.running()
    other.set(case.force, 0.7)
    _, token = k.try_deserialize(other.serialized())
    if overwritten:
        assert k.call("fmi2GetFMUstate", ct.byref(token)) == OK
    k.set(case.force, 0.2)
    k.restore(token)
    assert k.get(case.force) == (0.0 if overwritten else 0.7)


def test_a_state_can_be_overwritten_and_freed(case: Any) -> None:
    k = case.running()
    token = k.state()
    k.step(0.0, 0.01)
    here = k.outputs()
    value = token.value
    assert k.call("fmi2GetFMUstate", ct.byref(token)) == OK
    assert token.value == value
    k.step(0.01, 0.01)
    k.restore(token)
    assert k.outputs() == here
    assert k.call("fmi2FreeFMUstate", ct.byref(token)) == OK
    assert token.value is None
    assert k.call("fmi2FreeFMUstate", ct.byref(token)) == OK  # NULL: ignored
    assert k.call("fmi2FreeFMUstate", None) == OK


def test_a_state_of_another_instance_or_freed_is_refused(case: Any) -> None:
    one, other = case.running(), case.running()
    token = one.state()
    assert other.call("fmi2SetFMUstate", token) == ERROR
    assert "not made by this instance" in other.message
    copy = ct.c_void_p(token.value)
    assert one.call("fmi2FreeFMUstate", ct.byref(token)) == OK
    assert one.call("fmi2SetFMUstate", copy) == ERROR
    assert "already freed" in one.message


@pytest.mark.parametrize("phase", PHASES)
def test_a_state_carries_its_phase_parameters_and_time(case: Any, phase: str) -> None:
    def finish(k: Any) -> list[float]:
        if phase == "instantiated":
            assert k.call("fmi2EnterInitializationMode") == OK
        if phase != "stepping":
            assert k.call("fmi2ExitInitializationMode") == OK
        time = 2.0 + (0.01 if phase == "stepping" else 0.0)
        k.step(time, 0.02)
        return list(k.outputs())

    k = case.fmu.instance()
    k.setup(start=2.0)
    for name, value in case.parameters.items():
        k.set(name, value)
    if phase != "instantiated":
        k.call("fmi2EnterInitializationMode")
    if phase == "stepping":
        k.call("fmi2ExitInitializationMode")
        k.step(2.0, 0.01)
    blob = k.serialized()
    expected = finish(k)
    # Into an instance that knows nothing of all this.
    fresh = case.fmu.instance()
    status, token = fresh.try_deserialize(blob)
    assert status == OK, fresh.message
    fresh.restore(token)
    assert finish(fresh) == expected


def test_serialized_repeat_in_a_new_instance_is_bit_identical(case: Any) -> None:
    k = case.running()
    advance(case, k, 0.0, 3, 0.2)
    blob = k.serialized()
    time = 0.01 + 0.02 + 0.03
    expected = advance(case, k, time, 7, 0.2)
    k.free()
    fresh = case.fmu.instance()
    status, token = fresh.try_deserialize(blob)
    assert status == OK, fresh.message
    fresh.restore(token)
    assert advance(case, fresh, time, 7, 0.2) == expected
    assert fresh.serialized() != blob


@pytest.mark.parametrize("before", ["garbage", "another state"])
def test_deserializing_ignores_what_the_pointer_held(case: Any, before: str) -> None:
    # FMI 2.0.4: the state is an output only; JavaFMI passes what is not initialised.
    k = case.running()
    advance(case, k, 0.0, 3)
    early = k.state()
    at_early = k.outputs()
    advance(case, k, 0.06, 2)
    token = ct.c_void_p(0xDEADBEEF if before == "garbage" else early.value)
    blob = k.serialized()
    at_late = k.outputs()
    status = k.call("fmi2DeSerializeFMUstate", blob, ct.c_size_t(len(blob)), ct.byref(token))
    assert status == OK, k.message
    k.restore(early)
    assert k.outputs() == at_early
    k.restore(token)
    assert k.outputs() == at_late


def test_serialized_bytes_hold_no_pointers(case: Any) -> None:
    # Two instances at different addresses with the same history: the same bytes.
    blobs = []
    for _ in range(2):
        k = case.running()
        advance(case, k, 0.0, 2)
        blobs.append(k.serialized())
    assert blobs[0] == blobs[1]


def damaged(blob: bytes, position: int) -> bytes:
    return blob[:position] + bytes([blob[position] ^ 0x55]) + blob[position + 1 :]


@pytest.mark.parametrize(
    ("damage", "why"),
    [
        (lambda b: b"", "0 bytes are fewer"),
        (lambda b: b[:40], "40 bytes are fewer"),
        (lambda b: damaged(b, 0), "do not begin with its mark"),
        (lambda b: damaged(b, 8), "byte order"),
        (lambda b: damaged(b, 12), "format"),
        (lambda b: damaged(b, 20), "written by the FMU"),
        (lambda b: b[:-8], "its header announces"),
        (lambda b: b + b"\0" * 8, "its header announces"),
        (lambda b: damaged(b, len(b) - 1), "checksum"),
        (lambda b: bytes(len(b)), "do not begin with its mark"),
    ],
)
def test_foreign_bytes_are_refused_with_the_reason(case: Any, damage: Any, why: str) -> None:
    k = case.running()
    blob = k.serialized()
    status, token = k.try_deserialize(damage(blob))
    assert status == ERROR
    assert token.value is None
    assert why in k.message


def test_a_state_of_the_other_fmu_is_refused(beam: Any, spring: Any) -> None:
    blob = beam.running().serialized()
    k = spring.running()
    assert k.try_deserialize(blob)[0] == ERROR
    assert f"written by the FMU {beam.description.guid}" in k.message


def test_serializing_into_too_little_space_is_refused(case: Any) -> None:
    k = case.running()
    token = k.state()
    assert k.call("fmi2SerializeFMUstate", token, ct.create_string_buffer(16), ct.c_size_t(16)) == ERROR
    assert "size = 16" in k.message
