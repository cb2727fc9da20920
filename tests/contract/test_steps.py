"""Steps and states: which steps are refused, and a step repeated from its state, here or in another instance."""

import math

import numpy as np
import pytest
from scenes import table

# -- fmi2DoStep: which steps are refused, and what a refused step leaves behind ---------------------------------------


DISCARD = 2
ERROR = 3


def test_no_step_past_the_stop_time_nor_from_another_time(case):
    k, other = (case.running(stop_time=0.3) for _ in range(2))
    assert other.try_step(1.1e-4, 0.1) == ERROR
    assert "the slave is at 0" in other.message
    # 0.1 + 0.1 + 0.1 > 0.3 in floating point: rounding is no reason to refuse.
    time = 0.0
    for _ in range(3):
        k.step(time, 0.1)
        time += 0.1
    assert time > 0.3
    assert k.try_step(time, 0.1) == ERROR
    assert "past the stop time 0.3" in k.message


VALUES = table("contract/values.toml")


@pytest.mark.parametrize("step", VALUES["refused"], ids=lambda step: step["said"])
def test_after_any_refusal_a_master_goes_on(loaded, step):
    """With another step or other inputs, without restoring a state, as if the refused step had not been tried."""
    name, parameters, inputs, (size, smaller) = (step[key] for key in ("fmu", "parameters", "inputs", "sizes"))
    k, twin = (loaded[name].running(**parameters) for _ in range(2))
    for slave in (k, twin):
        slave.step(0.0, 1e-3)
    before = k.outputs()
    told = k.get("warnings")
    token = k.state()
    start = {i: k.get(i) for i in inputs}
    for i, value in inputs.items():
        k.set(i, value)
    assert k.try_step(1e-3, size) == DISCARD
    assert k.messages[-1][:2] == (DISCARD, "logStatusDiscard")
    assert step["said"] in k.message
    assert k.get("warnings") == told + 1  # in the results, where messages are hidden
    # Nothing was done: the last time that holds is the start of the step.
    assert k.reached() == 1e-3
    assert k.ends() is (name == "beam")  # where no step size helps
    if size != smaller:  # the inputs are still there
        k.step(k.reached(), smaller)
        assert k.outputs() != before
        k.restore(token)
    for i, value in start.items():
        k.set(i, value)
    for slave in (k, twin):
        slave.step(1e-3, smaller)
    assert k.outputs() == twin.outputs()


def test_a_step_that_fails_twice_alike_ends_the_simulation(spring):
    """FMPy repeats a discarded step until the FMU asks to end. With another size or other inputs it may go on."""
    k = spring.running(linear_stiffness=3.0)
    k.set("contact_force", 1e308)
    for size, ends in ((0.1, False), (0.2, False), (0.2, True), (0.1, False), (0.1, True)):
        assert k.try_step(0.0, size) == DISCARD
        assert k.ends() is ends
    k.set("contact_force", -1e308)
    assert k.try_step(0.0, 0.1) == DISCARD
    assert not k.ends()
    k.set("contact_force", 1.0)
    k.step(0.0, 0.1)
    assert not k.ends()


@pytest.mark.parametrize("tolerance", [0.1, 1e-4, 0.0, -1.0, math.nan, 1e-3])
def test_a_loose_tolerance_of_the_importer_changes_nothing(case, tolerance):
    plain = case.moving()
    loose = case.moving(tolerance=tolerance)
    for k in (plain, loose):
        k.step(0.0, 0.5)
    assert loose.outputs() == plain.outputs()


# -- saved states: the same step repeated is the same to the last bit, here and in another instance -------------------


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
    k = case.moving()
    twin = case.moving()
    fresh = case.instance()
    for one in (k, twin):
        told = advance(case, one, 0.0, 3, 0.2)[-1]
    time = 0.01 + 0.02 + 0.03
    blob = k.serialized()
    assert twin.serialized() == blob  # no pointers in it
    first = advance(case, k, time, 7, 0.2)
    k.free()
    fresh.restore(fresh.deserialized(blob))
    assert fresh.outputs() == told
    assert advance(case, fresh, time, 7, 0.2) == first
    assert fresh.serialized() != blob


@pytest.mark.parametrize("entered", [False, True], ids=["instantiated", "initialization"])
def test_a_state_carries_its_phase_parameters_and_time(case, entered):
    """Into an instance that knows nothing of all this, and back into one that has gone on."""

    def finish(k):
        if not entered:
            k.enter(start_time=2.0)
        k.slave.exitInitializationMode()
        k.step(2.0, 0.02)
        return k.outputs()

    k = case.instance()
    fresh = case.instance()
    if entered:
        k.enter(start_time=2.0)
    for name, value in case.parameters.items():
        k.set(name, value)
    blob = k.serialized()
    expected = finish(k)
    for one in (fresh, k):
        one.restore(one.deserialized(blob))
        assert finish(one) == expected


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


@pytest.mark.parametrize(
    ("beside", "ratio"), [(3e-12, 0.0), (-3e-12, 0.0), (0.9e-6, 0.0), (1e-3, 1e-3), (-1e-3, -1e-3)]
)
def test_a_step_from_a_rounded_time_ends_where_the_importer_says(spring, beside, ratio):
    """A free top goes v H. Up to a millionth of H it goes as far; beyond it, for as long as is left to that time."""
    k = spring.running(linear_stiffness=0.0, velocity=1.0)
    H = 1e-3
    k.step(0.0, H)
    k.step(H * (1.0 + beside), H)
    assert k.reached() == H * (1.0 + beside) + H
    assert k.get("displacement") == pytest.approx((2.0 + ratio) * H, rel=1e-12)
    k.step(k.reached(), H)


def test_a_top_that_rests_rests_for_as_long_as_one_likes(spring):
    """Neither at its equilibrium nor under a load is there a motion that a step could miss: it was refused."""
    k = spring.running(linear_stiffness=300.0, displacement=0.25, external_force=75.0)
    k.step(0.0, 3e5)
    assert k.get("displacement", "velocity", "load_work") == [0.25, 0.0, 0.0]
    assert k.get("displacement_integral") == pytest.approx(0.25 * 3e5)
    k.set("external_force", 75.0 * (1.0 + 1e-9))
    assert k.try_step(3e5, 3e5) == DISCARD


def fnv(data):
    """FNV-1a, the checksum of a saved state."""
    value = 0xCBF29CE484222325
    for byte in data:
        value = (value ^ byte) * 0x100000001B3 % 2**64
    return value.to_bytes(8, "little")


def test_a_state_is_refused_whose_numbers_no_instance_has(case):
    """The checksum is right, each number in turn is none; then numbers out of the limits of the description.

    A negative mass had ended the process.
    """
    k = case.moving()
    k.step(0.0, 0.01)
    blob = k.serialized()
    before = k.outputs()
    end = len(case.description.guid) + 8
    numbers = np.frombuffer(blob[end:])
    parameters = case.named("parameter")
    assert numbers[4] == float(case.parameters.get(parameters[0], case.variables[parameters[0]].start))
    wrong = [(i, np.nan) for i in range(len(numbers))]
    wrong += [(0, 3.0), (0, 64.0), (1, np.inf), (2, -1.0), (3, 1.0), (4, -1.0), (4, 0.0), (5, np.inf)]
    choice = {"beam": "integrator", "spring": "contact_law"}[case.name]
    at = 4 + 3 * parameters.index(choice)
    wrong += [(at, 1.5), (at, float(case.variables[choice].max) + 1.0)]
    for i, value in wrong:
        changed = numbers.copy()
        changed[i] = value
        data = changed.tobytes()
        assert k.status(k.deserialized, blob[: end - 8] + fnv(data) + data) == ERROR, (i, value)
        assert "the bytes are not a saved state of this FMU: " in k.message
    k.restore(k.deserialized(blob))
    assert k.outputs() == before


def test_a_state_in_which_no_contact_force_was_found_is_a_state(spring):
    """Its force was infinite, as what no instance has."""
    k, other = (spring.running(contact_law=2, tip_response=1e-4) for _ in range(2))
    k.set("tip_displacement", -1e300)
    other.restore(other.deserialized(k.serialized()))
    for one in (k, other):
        assert one.status(one.get, "reaction") == ERROR
        assert "'reaction' = inf is not finite" in one.message


def test_whether_a_top_rests_on_its_foundation_follows_its_inputs(spring):
    """1 kg under 9.81 N, held by the foundation; 20 N lift it, with 10.19 m/s², as soon as they are set."""
    values = {"mass": 1.0, "linear_stiffness": 0.0, "gravity": 9.81, "stop_enabled": True, "stop_position": 0.0}
    rests = [1.0, 0.0]
    lifted = [0.0, pytest.approx(10.19)]
    k = spring.instance().enter(**values)
    assert k.get("seated", "acceleration") == rests
    k.slave.exitInitializationMode()
    time = 0.0
    for _ in range(2):
        for force, then in ((0.0, rests), (20.0, lifted), (9.8, rests), (0.0, rests)):
            k.set("external_force", force)
            assert k.get("seated", "acceleration") == then
            assert k.partials(["acceleration"], "contact_force") == [pytest.approx(-1.0 if then is lifted else 0.0)]
        k.step(time, 0.1)
        time += 0.1
        assert k.get("seated", "acceleration", "stop_force") == [*rests, pytest.approx(9.81)]
    k.set("external_force", 20.0)
    k.step(time, 0.1)
    assert k.get("displacement") == pytest.approx(10.19 * 0.1**2 / 2)
