"""ModelStructure says what outputs depend on, no more and no less: found out by changing one thing at a time."""

from __future__ import annotations

import ctypes as ct
import xml.etree.ElementTree as ET
from typing import Any

AHEAD = {"contact_law": 2, "communication_step": 1e-3}
# Base points: between them every declared dependency shows.
BASES: dict[str, list[dict[str, float]]] = {
    "beam": [
        {},
        {"n_modes": 3},
        {"n_modes": 3, "tip_load_coefficient": 0.0, "initial_deflection_slope": 0.0, "initial_velocity_slope": 0.0},
        {"mass_matrix": 2},
        {"integrator": 2},
        {"integrator": 2, "reduced_integration": True},
        {"communication_step": 1e-3},
        {"communication_step": 0.1, "integrator": 2, "alpha_b": 1e-3},
        {"n_elements": 0, "n_modes": 20, "tip_load_coefficient": 0.0},
    ],
    "spring": [
        {},
        {"contact_law": 2},
        {"contact_law": 2, "compliance_damping": 0.2},
        {**AHEAD, "compliance_damping": 0.2},
        {"contact_law": 2, "displacement": 0.0, "equilibrium": 0.3},
        AHEAD,
        {**AHEAD, "stop_enabled": False},
        {**AHEAD, "stop_position": 0.2995},  # met within the step
        {**AHEAD, "displacement": 0.0, "equilibrium": 0.3},
    ],
}
COMMON: dict[str, dict[str, float]] = {
    "beam": {
        "young_modulus": 100.0,
        "shear_modulus": 70.0,
        "n_elements": 10,
        "initial_deflection_slope": 0.3,
        "initial_velocity_slope": -1.0,
        "distributed_load": 0.5,
        **{f"point_force[{i}]": 0.1 * i for i in range(1, 5)},
        "tip_load_coefficient": 0.2,
        "tip_force": 0.1,
    },
    "spring": {
        "mass": 1.2,
        "damping": 0.1,
        "linear_stiffness": 3.0,
        "cubic_stiffness": -0.2,
        "displacement": 0.3,
        "velocity": -1.0,
        "tip_displacement": 0.1,
        "tip_velocity": 0.2,
        "tip_velocity_forecast": 0.2,
        "contact_force": 0.3,
        "stop_enabled": True,
        "tip_response": 1e-4,
    },
}
# Values that are not a factor of the base's.
CHANGES: dict[str, list[float]] = {
    "n_elements": [12],
    "element_degree": [3],
    "n_modes": [0, 4, 19],
    "reduced_integration": [True, False],
    "integrator": [1, 2],
    "mass_matrix": [1, 2],
    "contact_law": [1, 2],
    "stop_enabled": [True, False],
    "rho_inf": [0.5],
    "restitution": [0.5],
    "stop_position": [-0.5],
    "relative_tolerance": [1e-8],
    "absolute_tolerance": [1e-9],
}


def started(case: Any, values: dict[str, float]) -> dict[str, float]:
    """Return the outputs at the start; none where these values are refused together."""
    k = case.instance().enter(**values)
    refused = k.call("fmi2GetReal", case.references(case.outputs[0]), 1, (ct.c_double * 1)()) != 0
    outputs = {} if refused else dict(zip(case.outputs, k.outputs(), strict=True))
    k.free()
    return outputs


def declared(case: Any, section: str) -> dict[str, set[str]]:
    root = ET.parse(case.folder / "modelDescription.xml").getroot()
    names = [v.get("name", "") for v in root.iter("ScalarVariable")]
    return {
        names[int(u.get("index", "")) - 1]: {names[int(i) - 1] for i in u.get("dependencies", "").split()}
        for u in root.iterfind(f"ModelStructure/{section}/Unknown")
    }


def differ(a: float, b: float) -> bool:
    return abs(a - b) > 1e-9 * max(abs(a), abs(b), 1e-3)  # rounding is no dependence


def test_initial_unknowns(case: Any) -> None:
    found: dict[str, set[str]] = {name: set() for name in case.outputs}
    knobs = [v.name for v in case.description.modelVariables if v.initial != "calculated"]
    for base in BASES[case.name]:
        values = {**COMMON[case.name], **base}
        before = started(case, values)
        for name in knobs:
            start = values.get(name, float(case.variables[name].start or 0.0) if name not in CHANGES else 0.0)
            for value in CHANGES.get(name, [1.25 * start + 0.01]):
                after = started(case, {**values, name: value})
                for output, reached in after.items():
                    if differ(before[output], reached):
                        found[output].add(name)
    exact = {v.name for v in case.description.modelVariables if v.causality == "output" and v.initial == "exact"}
    assert {name: found[name] for name in found if name not in exact} == declared(case, "InitialUnknowns")


def test_outputs_follow_between_steps_what_is_declared(case: Any) -> None:
    found: dict[str, set[str]] = {name: set() for name in case.outputs}
    for base in BASES[case.name]:
        for name in case.named("input"):
            k = case.running(**{**COMMON[case.name], **base})
            k.step(0.0, 1e-3)
            before = k.outputs()
            k.set(name, k.get(name) - 0.05)
            for output, a, b in zip(case.outputs, before, k.outputs(), strict=True):
                if differ(a, b):
                    found[output].add(name)
            k.free()
    assert found == declared(case, "Outputs")


def test_directional_derivatives_are_those_of_the_outputs(case: Any) -> None:
    """Derivatives of every output by every continuous input, against the difference over a small change of it."""
    inputs = [name for name in case.named("input") if case.variables[name].variability == "continuous"]
    outputs = case.outputs
    known, unknown = case.references(*inputs), case.references(*outputs)
    found = 0
    for base in BASES[case.name]:
        k = case.running(**{**COMMON[case.name], **base})
        k.step(0.0, 1e-3)
        for i, name in enumerate(inputs):
            value, change = k.get(name), 1e-6
            k.set(name, value)
            direction = (ct.c_double * len(inputs))(*[float(i == j) for j in range(len(inputs))])
            derivatives = (ct.c_double * len(outputs))(*[float("nan")] * len(outputs))
            arguments = (unknown, ct.c_size_t(len(outputs)), known, ct.c_size_t(len(inputs)), direction, derivatives)
            assert k.call("fmi2GetDirectionalDerivative", *arguments) == 0, k.message
            ends = []
            for sign in (1.0, -1.0):
                k.set(name, value + sign * change)
                ends.append(k.outputs())
            k.set(name, value)
            for output, up, down, derivative in zip(outputs, *ends, derivatives, strict=True):
                difference = (up - down) / (2.0 * change)
                scale = max(abs(difference), 1e-9 * abs(up) / change, 1e-9)
                assert abs(derivative - difference) <= 1e-5 * scale, (base, output, name)
                found += derivative != 0.0
        k.free()
    assert found >= {"beam": 8, "spring": 2}[case.name]


def by_one(fmu: Any, output: str, name: str) -> tuple[Any, ...]:
    """Return the arguments that ask for the derivative of an output by one variable."""
    one = ct.c_size_t(1)
    return fmu.references(output), one, fmu.references(name), one, (ct.c_double * 1)(1.0), (ct.c_double * 1)()


def test_a_directional_derivative_that_is_not_known_is_discarded(spring: Any) -> None:
    """The held force before its first step follows the tip by a search with trial steps."""
    k = spring.running(**{**COMMON["spring"], **AHEAD})
    assert k.call("fmi2GetDirectionalDerivative", *by_one(spring, "reaction", "tip_displacement")) == 2
    assert "reaction" in k.message
    k.step(0.0, 1e-3)


def test_a_directional_derivative_by_a_parameter_is_discarded_in_initialization_mode(case: Any) -> None:
    """There parameters are knowns, so asking is right; later it is an error."""
    k = case.instance().enter()
    name = next(iter(case.parameters))
    ask = by_one(case, case.velocity, name)
    assert k.call("fmi2GetDirectionalDerivative", *ask) == 2
    assert name in k.message
    assert k.call("fmi2ExitInitializationMode") == 0
    assert k.call("fmi2GetDirectionalDerivative", *ask) == 3
