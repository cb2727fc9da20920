"""ModelStructure says what outputs depend on, no more and no less: found out by changing one thing at a time."""

import ctypes as ct

import pytest
from scenes import table

VALUES = table("contract/values.toml")
BASES = VALUES["bases"]
COMMON = VALUES["common"]
CHANGES = VALUES["changes"]


def started(case, values):
    """Return the outputs at the start; none where these values are refused together."""
    k = case.instance().enter(**values)
    refused = k.access("GetFloat64", case.references(case.outputs[0]), 1, (ct.c_double * 1)()) != 0
    outputs = {} if refused else dict(zip(case.outputs, k.outputs(), strict=True))
    k.free()
    return outputs


def declared(case, section):
    """Return what each output depends on, derivatives of inputs apart."""
    found = {}
    for unknown in getattr(case.description, section):
        found[unknown.variable.name] = {v.name for v in unknown.dependencies if not v.name.startswith("der(")}
    assert not any(found[name] for name in found if name not in case.outputs)
    return {name: found[name] for name in found if name in case.outputs}


def knobs(case):
    """Return all that is set before the start: parameters, inputs, exact outputs."""
    exact = [name for name in case.named("output") if case.variables[name].initial == "exact"]
    return [*case.named("parameter"), *case.named("input"), *exact]


def differ(a, b):
    return abs(a - b) > 1e-9 * max(abs(a), abs(b), 1e-3)  # rounding is no dependence


def test_initial_unknowns(case):
    """Lists are exact, but for those with all that can act at the start: their outputs depend on most of it."""
    told = declared(case, "initialUnknowns")
    found = {name: set() for name in told}
    for base in BASES[case.name]:
        values = {**COMMON[case.name], **base}
        before = started(case, values)
        for name in knobs(case):
            start = values.get(name, float(case.variables[name].start or 0.0) if name not in CHANGES else 0.0)
            for value in CHANGES.get(name, [1.25 * start + 0.01]):
                after = started(case, {**values, name: value})
                for output in told.keys() & after.keys():
                    if differ(before[output], after[output]):
                        found[output].add(name)
    everything = set(knobs(case)) - {case.impulse}
    assert found.pop("seated", set()) <= told.pop("seated", set())  # a sign, which few of these changes turn
    listed = {name: names for name, names in told.items() if names != everything}
    assert {name: found[name] for name in listed} == listed
    assert all(len(found[name]) >= 10 and found[name] <= everything for name in told.keys() - listed.keys())


def test_outputs_follow_between_steps_what_is_declared(case):
    """Before the first step or after it."""
    found = {name: set() for name in case.outputs}
    for base in BASES[case.name]:
        for name in case.named("input"):
            k = case.running(**{**COMMON[case.name], **base})
            for step in (False, True):
                if step:
                    k.step(0.0, 1e-3)
                before = k.outputs()
                k.set(name, k.get(name) - 0.05)
                for output, a, b in zip(case.outputs, before, k.outputs(), strict=True):
                    if differ(a, b):
                        found[output].add(name)
            k.free()
    told = declared(case, "outputs")
    assert found.pop("seated", set()) <= told.pop("seated", set())
    assert found == told


def test_an_impulse_changes_nothing_before_its_step(case):
    for k in (case.running(), case.instance().enter()):
        assert k.partials(case.outputs, case.impulse) == [0.0] * len(case.outputs)


def compare(k, outputs, name, change, own_change=None):
    """Compare derivatives by ``name`` with differences; return how many are not 0.

    Outputs are exact to 2e-13: the held force is solved to 1e-13, inner forces are sums of larger ones. Where the FMU
    takes differences itself, ``own_change`` is its step.
    """
    value = k.get(name)
    k.set(name, value)  # what was extrapolated is now as set
    partials = k.partials(outputs, name)
    ends = []
    for sign in (1.0, -1.0):
        k.set(name, value + sign * change)
        ends.append(k.get(*outputs))
    k.set(name, value)
    one = len(outputs) == 1
    ups, downs = ([end] if one else end for end in ends)
    for output, up, down, partial in zip(outputs, ups, downs, partials, strict=True):
        difference = (up - down) / (2.0 * change)
        rounding = 2e-13 * max(abs(up), 1e-2) / (own_change or change)
        assert abs(partial - difference) <= 1e-4 * abs(difference) + rounding, (output, name)
    return sum(partial != 0.0 for partial in partials)


def real(case, names):
    return [name for name in names if case.variables[name].type in ("Real", "Float64")]


@pytest.mark.parametrize("when", ["at the start", "before the first step", "after it"])
def test_directional_derivatives_are_those_of_the_outputs(case, when):
    """At the start every pair that InitialUnknowns declares, if both are real; later every output by every input."""
    told = declared(case, "initialUnknowns")
    starts = when == "at the start"
    apart = {"kinetic_energy", "strain_energy", "tip_mass"}  # of many: those that n_modes or the mesh decide
    inputs = [name for name in case.named("input") if case.variables[name].variability == "continuous"]
    edges = {"alpha_b", "restitution", "compliance_damping", "contact_damping", "tip_response"}
    found = 0
    for base in BASES[case.name] + ([] if starts else BASES[f"{case.name} at rest"]):
        k = case.instance().enter(**{**COMMON[case.name], **base})
        if not starts:
            k.slave.exitInitializationMode()
        if when == "after it":
            k.step(0.0, 1e-3)
        # At rest the acceleration is the rounding of large inner forces.
        skipped = apart | ({"tip_acceleration"} if base.get("initial_state") == 2 else set())
        for name in real(case, sorted(set().union(*told.values()))) if starts else inputs:
            value = k.get(name)
            own_change = 1e-6 * (abs(value) or float((starts and case.variables[name].nominal) or 1.0))
            outputs = case.outputs
            change = {"beam": 1e-3, "spring": 1e-6}[case.name]
            if starts:
                outputs = [output for output in outputs if name in told.get(output, ()) and output not in skipped]
                change = 1e-4 * max(abs(value), 1e-2)
            # From 0 on `tip_response` makes the force a held one.
            at_edge = name in edges and value in (0.0, 1.0) if starts else name == "tip_response" and name not in base
            if outputs and not at_edge:
                found += compare(k, outputs, name, change, own_change)
        k.free()
    assert found >= {"beam": 30, "spring": 40}[case.name] if starts else found >= {"beam": 8, "spring": 6}[case.name]
