"""Which call is allowed when (FMI 2.0.4, section 4.2.4), and what importers get wrong or do differently."""

from __future__ import annotations

import ctypes as ct
import math
import xml.etree.ElementTree as ET
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

OK, WARNING, DISCARD, ERROR = 0, 1, 2, 3

NONE = ct.c_void_p()


def status_call(function: str, kind: int, value: Any) -> Callable[[Any], int]:
    return lambda k: k.call(function, kind, ct.byref(value))


CALLS: dict[str, Callable[[Any], int]] = {
    "fmi2SetupExperiment": lambda k: k.setup(),
    "fmi2EnterInitializationMode": lambda k: k.call("fmi2EnterInitializationMode"),
    "fmi2ExitInitializationMode": lambda k: k.call("fmi2ExitInitializationMode"),
    "fmi2Terminate": lambda k: k.call("fmi2Terminate"),
    "fmi2Reset": lambda k: k.call("fmi2Reset"),
    "fmi2GetReal": lambda k: k.call("fmi2GetReal", None, 0, None),
    "fmi2SetReal": lambda k: k.call("fmi2SetReal", None, 0, None),
    "fmi2SetRealInputDerivatives": lambda k: k.call("fmi2SetRealInputDerivatives", None, 0, None, None),
    "fmi2GetRealOutputDerivatives": lambda k: k.call("fmi2GetRealOutputDerivatives", None, 0, None, None),
    "fmi2GetFMUstate": lambda k: k.call("fmi2GetFMUstate", ct.byref(ct.c_void_p())),
    "fmi2DoStep": lambda k: k.try_step(0.0, 1e-3),
    "fmi2CancelStep": lambda k: k.call("fmi2CancelStep"),
    "fmi2GetStatus": status_call("fmi2GetStatus", 0, ct.c_int()),
    "fmi2GetRealStatus": status_call("fmi2GetRealStatus", 2, ct.c_double()),
    "fmi2SetDebugLogging": lambda k: k.call("fmi2SetDebugLogging", 0, 0, None),
}

GETTERS = {"fmi2GetReal", "fmi2GetFMUstate", "fmi2SetDebugLogging", "fmi2Reset"}
STEPPED = {"fmi2GetRealOutputDerivatives", "fmi2GetStatus", "fmi2GetRealStatus"}
INPUTS = {"fmi2SetReal", "fmi2SetRealInputDerivatives"}
LEGAL = {
    "instantiated": GETTERS | INPUTS | {"fmi2SetupExperiment", "fmi2EnterInitializationMode"},
    "initialization": GETTERS | INPUTS | {"fmi2ExitInitializationMode"},
    "step complete": GETTERS | INPUTS | STEPPED | {"fmi2DoStep", "fmi2Terminate"},
    "step discarded": GETTERS | INPUTS | STEPPED | {"fmi2DoStep", "fmi2Terminate"},
    "terminated": GETTERS | STEPPED,
    "error": GETTERS | STEPPED,
}


def brought_to(case: Any, phase: str) -> Any:
    k = case.fmu.instance()
    k.setup()
    if phase == "step discarded" and case.name == "spring":
        k.set("linear_stiffness", 3.0)
        k.set("cubic_stiffness", -0.2)
    if phase == "instantiated":
        return k
    k.call("fmi2EnterInitializationMode")
    if phase == "initialization":
        return k
    k.call("fmi2ExitInitializationMode")
    if phase == "terminated":
        assert k.call("fmi2Terminate") == OK
    elif phase == "error":
        assert k.try_step(0.0, -1.0) == ERROR
    elif phase == "step discarded":
        # The spring is struck over the hilltop of its potential; the velocity of the beam overflows.
        k.set(case.impulse, {"spring": 1e3, "beam": 1e308}[case.name])
        assert k.try_step(0.0, 0.1) == DISCARD, k.message
        k.set(case.impulse, 0.0)
    return k


@pytest.mark.parametrize("phase", LEGAL)
@pytest.mark.parametrize("function", CALLS)
def test_call_table(case: Any, phase: str, function: str) -> None:
    k = brought_to(case, phase)
    status = CALLS[function](k)
    assert status == (OK if function in LEGAL[phase] else ERROR)
    if status == ERROR:
        assert k.message.startswith(f"{function}: not allowed")


@pytest.mark.parametrize("function", CALLS)
def test_null_component_is_an_error(case: Any, function: str) -> None:
    k = case.fmu.instance()
    kept, k.component = k.component, ct.c_void_p()
    try:
        assert CALLS[function](k) == ERROR
    finally:
        k.component = kept


@pytest.mark.parametrize(
    ("options", "why"),
    [
        ({"guid": b"{00000000-0000-0000-0000-000000000000}"}, "is not that of this FMU"),
        ({"name": None}, "instanceName is empty"),
        ({"name": b""}, "instanceName is empty"),
        ({"kind": 0}, "only co-simulation"),
    ],
)
def test_instantiation_is_refused_with_a_reason(case: Any, options: dict[str, Any], why: str) -> None:
    k = case.fmu.instance(**options)
    assert not k.component
    assert why in k.message


@pytest.mark.parametrize(
    "resources", [None, b"", b"file:///x/resources", b"file:////x", b"file:/x/with space/", b"nonsense"]
)
def test_resource_location_does_not_matter(case: Any, resources: bytes | None) -> None:
    k = case.fmu.instance(resources=resources)
    assert k.component
    k.setup()
    k.initialize()
    k.step(0.0, 1e-3)


def test_callbacks_may_be_null(case: Any) -> None:
    k = case.fmu.instance(callbacks=False)
    assert k.component
    assert k.try_step(0.0, 1e-3) == ERROR  # has a message, and nobody to tell it to
    assert k.call("fmi2Reset") == OK
    k.setup()
    k.initialize()
    k.step(0.0, 1e-3)


def test_message_survives_a_logger_that_formats_and_one_that_does_not(case: Any) -> None:
    k = case.fmu.instance(guid=b"%s%n%d")
    # Doubled: printf prints one, a logger without formatting shows two.
    assert "%%s%%n%%d" in k.message


def test_debug_messages_only_when_asked_for(case: Any) -> None:
    silent, chatty = case.fmu.instance(), case.fmu.instance(logging=True)
    for k in (silent, chatty):
        k.setup()
        k.initialize()
    assert silent.messages == []
    assert [(s, c) for s, c, _ in chatty.messages] == [(OK, "logEvents")] * len(chatty.messages)
    assert len(chatty.messages) == 3
    names = (ct.c_char_p * 1)(b"logStatusError")
    assert chatty.call("fmi2SetDebugLogging", 1, 1, names) == OK
    chatty.call("fmi2Terminate")
    assert len(chatty.messages) == 3


def test_unknown_log_category_is_a_warning(case: Any) -> None:
    k = case.fmu.instance()
    assert k.call("fmi2SetDebugLogging", 1, 1, (ct.c_char_p * 1)(b"logEverything")) == WARNING
    assert "logEverything" in k.message


def test_declared_log_categories_are_accepted(case: Any) -> None:
    k = case.fmu.instance()
    root = ET.parse(case.fmu.folder / "modelDescription.xml").getroot()
    names = [c.get("name", "").encode() for c in root.iter("Category")]
    assert len(names) == 5
    assert k.call("fmi2SetDebugLogging", 1, len(names), (ct.c_char_p * len(names))(*names)) == OK


def test_types_platform_and_version(case: Any) -> None:
    library = case.fmu.library
    for function, expected in (("fmi2GetTypesPlatform", b"default"), ("fmi2GetVersion", b"2.0")):
        getattr(library, function).restype = ct.c_char_p
        assert getattr(library, function)() == expected


@pytest.mark.parametrize(
    ("function", "arguments", "why"),
    [
        ("fmi2GetReal", (None, 1, (ct.c_double * 1)()), "vr is NULL"),
        ("fmi2GetReal", ((ct.c_uint * 1)(0), 1, None), "value is NULL"),
        ("fmi2SetReal", ((ct.c_uint * 1)(0), 1, None), "value is NULL"),
        ("fmi2GetReal", ((ct.c_uint * 1)(4711), 1, (ct.c_double * 1)()), "value reference 4711 does not exist"),
        ("fmi2GetBoolean", ((ct.c_uint * 1)(0), 1, (ct.c_int * 1)()), "as Boolean: it is Real"),
        ("fmi2GetString", ((ct.c_uint * 1)(0), 1, (ct.c_char_p * 1)()), "not a String"),
        ("fmi2SetString", ((ct.c_uint * 1)(0), 1, (ct.c_char_p * 1)()), "not a String"),
        ("fmi2GetFMUstate", (None,), "FMUstate is NULL"),
        ("fmi2SetFMUstate", (None,), "FMUstate is NULL"),
        ("fmi2SerializedFMUstateSize", (None, None), "size is NULL"),
        ("fmi2DeSerializeFMUstate", (None, ct.c_size_t(0), ct.byref(ct.c_void_p())), "serializedState is NULL"),
        ("fmi2GetStatus", (0, None), "value is NULL"),
        ("fmi2GetRealOutputDerivatives", ((ct.c_uint * 1)(0), 1, None, (ct.c_double * 1)()), "order is NULL"),
        ("fmi2SetRealInputDerivatives", ((ct.c_uint * 1)(0), 1, (ct.c_int * 1)(1), None), "value is NULL"),
        (
            "fmi2GetDirectionalDerivative",
            ((ct.c_uint * 1)(0), ct.c_size_t(1), None, ct.c_size_t(0), None, None),
            "dvUnknown is NULL",
        ),
    ],
)
def test_bad_argument_is_an_error_with_a_message(
    case: Any, function: str, arguments: tuple[Any, ...], why: str
) -> None:
    k = case.running()
    assert k.call(function, *arguments) == ERROR
    assert k.message.startswith(function + ": ")
    assert why in k.message


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_input_that_is_not_finite_is_refused(case: Any, value: float) -> None:
    k = case.running()
    assert k.try_set(case.force, value) == ERROR
    assert f"'{case.force}' = " in k.message
    assert "not finite" in k.message


def test_parameter_out_of_range_is_refused_by_name(case: Any) -> None:
    k = case.fmu.instance()
    name = {"beam": "rho_inf", "spring": "restitution"}[case.name]
    assert k.try_set(name, 1.5) == ERROR
    assert f"'{name}' = 1.5 is not in [0, 1]" in k.message


def test_impossible_parameter_is_refused_at_initialization_by_name(case: Any) -> None:
    k = case.fmu.instance()
    name = {"beam": "n_modes", "spring": "cubic_stiffness"}[case.name]  # only beside the others impossible
    k.setup()
    if case.name == "spring":
        k.set("linear_stiffness", 0.0)
    k.set(name, {"beam": 101, "spring": -1.0}[case.name])
    assert k.call("fmi2EnterInitializationMode") == OK
    assert k.call("fmi2ExitInitializationMode") == ERROR
    assert name in k.message


def test_limits_of_the_description_are_the_true_ones(case: Any) -> None:
    """At a limit that the XML gives the instance comes up; beyond it the value is refused when it is set."""
    # Limits of numbers that go together are reached only beside others that allow them.
    beside: dict[str, dict[str, float]] = {
        "n_elements": {"n_modes": 8},
        "element_degree": {"n_elements": 1},
        "compliance_exponent": {"contact_law": 2},
    }
    tried = 0
    for v in case.fmu.description.modelVariables:
        if v.causality != "parameter" or v.type == "Boolean":
            continue
        for limit, away in ((v.min, -1.0), (v.max, 1.0)):
            if limit is None or float(limit) == 1e6:  # a million elements take their time
                continue
            tried += 1
            k = case.fmu.instance()
            k.setup()
            positive = 0.0 < float(limit) < 1e-300  # itself no beam, beside numbers of ordinary size
            if v.name == "n_modes":
                beside["n_modes"] = {"n_elements": 0 if float(limit) > 0.0 else 500}
            for name, value in {**beside.get(v.name, {}), v.name: 1e-3 if positive else float(limit)}.items():
                k.set(name, value)
            assert k.call("fmi2EnterInitializationMode") == OK
            assert k.call("fmi2ExitInitializationMode") == OK, (v.name, k.message)
            k.free()
            k = case.fmu.instance()
            outside = float(limit) + away if v.type == "Integer" else np.nextafter(float(limit), away * np.inf)
            assert k.try_set(v.name, 0.0 if positive else outside) == ERROR, v.name
            assert v.name in k.message
            k.free()
    assert tried >= 15


def test_parameters_are_fixed_after_initialization(case: Any) -> None:
    k = case.running()
    name = next(v.name for v in case.fmu.description.modelVariables if v.causality == "parameter")
    assert k.try_set(name, 2.0) == ERROR
    assert "can only be set before fmi2ExitInitializationMode" in k.message


def test_calculated_outputs_cannot_be_set(case: Any) -> None:
    k = case.fmu.instance()
    assert k.try_set("kinetic_energy", 1.0) == ERROR
    assert "cannot be set" in k.message


def test_outputs_are_known_in_initialization_mode_and_follow_parameters_set_there(case: Any) -> None:
    k = case.fmu.instance()
    k.setup()
    for name, value in case.parameters.items():
        k.set(name, value)
    k.call("fmi2EnterInitializationMode")
    # The modal beam's start is projected onto its modes: rounding.
    assert k.get(case.velocity) == pytest.approx(-1.0, rel=1e-13)
    k.set({"beam": "initial_velocity_slope", "spring": "velocity"}[case.name], -2.0)
    assert k.get(case.velocity) == pytest.approx(-2.0, rel=1e-13)
    k.call("fmi2ExitInitializationMode")
    assert k.get(case.velocity) == pytest.approx(-2.0, rel=1e-13)


def test_reset_starts_all_over(case: Any) -> None:
    fresh = case.fmu.running()
    used = case.running()
    used.set(case.force, 0.3)
    used.step(0.0, 0.01)
    assert used.call("fmi2Terminate") == OK
    assert used.call("fmi2Reset") == OK
    used.setup()
    used.initialize()
    for k in (fresh, used):
        k.step(0.0, 0.02)
    assert used.outputs() == fresh.outputs()


def test_instances_do_not_know_of_each_other(case: Any) -> None:
    alone = case.running()
    for i in range(5):
        alone.step(i * 0.01, 0.01)
    expected = alone.outputs()
    one, other = case.running(), case.running()
    for i in range(5):
        one.step(i * 0.01, 0.01)
        other.set(case.force, 1.0 + i)
        other.step(i * 0.01, 0.01)
    assert one.outputs() == expected
    assert other.outputs() != expected
    other.free()
    one.step(0.05, 0.01)


def test_an_error_can_be_left_by_restoring_a_state(case: Any) -> None:
    k = case.running()
    token = k.state()
    assert k.try_step(0.0, math.nan) == ERROR
    assert k.try_step(0.0, 0.01) == ERROR
    k.restore(token)
    k.step(0.0, 0.01)


def test_status_functions(case: Any) -> None:
    k = case.running()
    k.step(0.0, 0.25)
    status, time, flag, text, number = ct.c_int(-1), ct.c_double(), ct.c_int(-1), ct.c_char_p(), ct.c_int()
    assert k.call("fmi2GetStatus", 0, ct.byref(status)) == OK
    assert status.value == OK
    assert k.call("fmi2GetRealStatus", 2, ct.byref(time)) == OK
    assert time.value == 0.25
    assert k.call("fmi2GetBooleanStatus", 3, ct.byref(flag)) == OK
    assert flag.value == 0
    assert k.call("fmi2GetStringStatus", 1, ct.byref(text)) == OK
    assert text.value == b"no step is pending"
    assert k.call("fmi2GetIntegerStatus", 0, ct.byref(number)) == DISCARD
    k.step(0.25, 0.25)  # asking for what there is not does no harm
