"""Which call is allowed when (FMI 2.0.4, section 4.2.4), what importers get wrong, and flat memory."""

import ctypes as ct
import gc
import re
import shutil

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from scenes import table

# -- which call is allowed when (FMI 2.0.4, section 4.2.4), and what importers get wrong or do differently ------------


OK = 0
DISCARD = 2
ERROR = 3
#: Parameters of the law that looks ahead.
CALLS = table("bad_inputs.toml")["calls"]


@pytest.mark.parametrize(
    ("options", "why"),
    [
        ({"guid": b"{00000000-0000-0000-0000-000000000000}"}, "is not that of this FMU"),
        ({"name": None}, "instanceName is empty"),
        ({"name": b""}, "instanceName is empty"),
    ],
)
def test_instantiation_is_refused_with_a_reason(case, options, why):
    k = case.instance(**options)
    assert not k.slave.component
    assert why in k.message


def test_debug_messages_only_when_asked_for(case):
    silent = case.instance()
    chatty = case.instance(logging=True)
    for k in (silent, chatty):
        k.start()
    assert silent.messages == []
    assert [(s, c) for s, c, _ in chatty.messages] == [(OK, "logEvents")] * len(chatty.messages)
    assert len(chatty.messages) == 3
    assert chatty.call("SetDebugLogging", 1, 1, (ct.c_char_p * 1)(b"logStatusError")) == OK
    chatty.call("Terminate")
    assert len(chatty.messages) == 3


#: What a word of the table of bad inputs stands for in a call.
STANDS_FOR = {
    "NULL": lambda k: None,
    "a reference": lambda k: (ct.c_uint * 1)(0),
    "no reference": lambda k: (ct.c_uint * 1)(4711),
    "a number": lambda k: (ct.c_double * 1)(),
    "an order": lambda k: (ct.c_int * 1)(1),
    "a text": lambda k: (ct.c_char_p * 1)(),
    "a pointer": lambda k: ct.byref(ct.c_void_p()),
    "a state": lambda k: k.state(),
    "16 bytes": lambda k: bytes(16) if k.fmu.version == "2.0" else (ct.c_uint8 * 16)(),
    "a parameter": lambda k: k.fmu.named("parameter")[0],
    "a share": lambda k: {"beam": "point_force_position[1]", "spring": "restitution"}[k.fmu.name],
    **{word: lambda k, word=word: getattr(k.fmu, word) for word in ("force", "impulse", "velocity")},
}


def given(k, argument):
    """Return an argument of a call as it is, or what its word stands for."""
    if isinstance(argument, list):
        return [given(k, one) for one in argument]
    return STANDS_FOR[argument](k) if argument in STANDS_FOR else argument


@pytest.mark.parametrize(
    ("version", "call"),
    [(version, name) for name, row in CALLS.items() for version in row.get("only", ["2.0", "3.0"])],
)
def test_a_wrong_argument_is_an_error_with_a_message(case, call):
    """Which call is allowed when, and that each error has a message, is for tests/fuzz, a part of the C++ tests."""
    row = CALLS[call]
    k = case.instance() if row.get("before the start") else case.running()
    method, *arguments = row["call"]
    function = getattr(k, method, None) or getattr(k.slave, method)
    try:
        status = function(*given(k, arguments))
    except FMICallException as failed:
        status = failed.status
    expected = (DISCARD, "logStatusDiscard") if row.get("discarded") else (ERROR, "logStatusError")
    assert (status, k.messages[-1][1]) == expected
    place, why = k.message.split(": ", 1)
    assert place in {case.spelt(name) for name in row["place"].split("|")}
    assert re.match(row["said"], why)


@pytest.mark.parametrize(
    ("name", "values", "said"),
    [
        ("beam", {"n_modes": 101}, "n_modes"),
        ("spring", {"linear_stiffness": 0.0, "cubic_stiffness": -1.0}, "cubic_stiffness"),
    ],
)
def test_parameters_that_are_impossible_together_are_refused_by_name(loaded, name, values, said):
    k = loaded[name].instance().enter(**values)
    assert k.call("ExitInitializationMode") == ERROR
    assert re.search(said, k.message)


@pytest.mark.parametrize("version", ["2.0"])
def test_limits_of_the_description_are_the_true_ones(case, fmus):
    """At a limit that the XML gives the instance comes up; beyond it the value is refused when it is set."""
    # Limits of numbers that go together are reached only beside others that allow them.
    beside = {
        "element_degree": {"n_elements": 1},
        "compliance_exponent": {"contact_law": 2},
    }
    tried = 0
    for v in case.description.modelVariables:
        if v.causality != "parameter" or v.type == "Boolean":
            continue
        in_fmi3 = fmus["3.0"][case.name].variables[v.name]
        assert (in_fmi3.min, in_fmi3.max) == (v.min, v.max)
        for limit, away in ((v.min, -1.0), (v.max, 1.0)):
            if limit is None:
                continue
            tried += 1
            positive = 0.0 < float(limit) < 1e-300  # itself no beam, beside numbers of ordinary size
            at_limit = {v.name: 1e-3 if positive else float(limit)}
            if float(limit) < 1000.0 or v.type == "Real":  # as many modes or elements take their time
                case.running(**(beside.get(v.name, {}) if float(limit) else {}), **at_limit).free()
            outside = float(limit) + away if v.type == "Integer" else np.nextafter(float(limit), away * np.inf)
            k = case.instance()
            assert k.try_set(v.name, 0.0 if positive else outside) == DISCARD, v.name
            assert v.name in k.message
            k.start()
    assert tried >= 14


def test_reset_starts_all_over(case):
    fresh = case.running()
    used = case.moving()
    used.set(case.force, 0.3)
    used.step(0.0, 0.01)
    token = used.state()
    assert used.call("Terminate") == OK
    assert used.call("Reset") == OK
    for _ in range(2):  # in the memory of states that had more to keep
        assert used.call("GetFMUState", ct.byref(token)) == OK
    used.start()
    fresh.step(0.0, 0.02)
    for again in (False, True):
        if again:
            used.restore(token)
            used.start()
        used.step(0.0, 0.02)
        assert used.outputs() == fresh.outputs()


def test_an_output_that_inputs_drive_out_of_range_is_an_error(beam):
    k = beam.running()
    k.set("tip_load", 1e308)
    assert k.status(k.get, "tip_acceleration") == ERROR
    assert "'tip_acceleration' = inf is not finite: the inputs are too large" in k.message


# -- memory stays flat over many instances, also over those that failed -----------------------------------------------


without_mallinfo = pytest.mark.skipif(not hasattr(ct.CDLL(None), "mallinfo2"), reason="mallinfo2 came with glibc 2.33")

#: Cheap ones that use what can be allocated.
PARAMETERS = {"beam": {"n_elements": 2, "n_modes": 0}, "spring": {"stop_enabled": 1, "contact_law": 2}}


class MallocInfo(ct.Structure):
    """glibc's struct mallinfo2."""

    _fields_ = [
        (name, ct.c_size_t)
        for name in ["arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks", "in_use", "f", "k"]
    ]


def run(instance, parameters, i):
    """A step, states saved, restored and serialised; some left to the instance to free, some runs ended by an error."""
    instance.start(**parameters)
    state = instance.state()
    instance.step(0.0, 1e-4)
    copy = instance.deserialized(instance.serialized())
    for one in (copy, state):
        instance.restore(one)
        assert i % 3 == 0 or instance.call("FreeFMUState", ct.byref(one)) == OK
    assert i % 7 or instance.try_step(1.0, -1.0) == ERROR


def growth(work, cycles):
    """Return what malloc gave out and did not get back over so many calls of ``work`` [bytes]."""
    information = ct.CDLL(None).mallinfo2
    information.restype = MallocInfo
    held = []
    for calls in (0, cycles):
        for i in range(1, calls + 1):
            work(i)
        gc.collect()
        now = information()
        held.append(now.in_use + now.hblkhd)
    return held[1] - held[0]


@without_mallinfo
def test_memory_is_flat_over_many_instances(case):
    """Over 100 of them, in the best of five rounds; a lost pointer takes 32 bytes.

    What else the process allocates at times is not in every round. One Python object serves all.
    """
    instance = case.instance()
    instance.free()

    def work(i):
        instance.make(callbacks=False)
        run(instance, PARAMETERS[case.name], i)
        if i % 10 == 0:
            assert instance.call("Reset") == OK
            run(instance, PARAMETERS[case.name], 1)
        instance.free()

    growth(work, 200)
    assert min(growth(work, 100) for _ in range(5)) < 16 * 100


@without_mallinfo
def test_a_library_that_is_unloaded_leaves_no_memory_behind(case):
    """It had left libstdc++'s room for exceptions, 72,704 bytes each time: FMPy unloads it with every instance."""
    load, unload = (getattr(ct.CDLL(None), name) for name in ("dlopen", "dlclose"))
    load.restype = ct.c_void_p
    copy = case.folder / "alone.so"  # which no other test has loaded
    shutil.copy(case.binary, copy)

    def work(_):
        assert unload(ct.c_void_p(load(str(copy).encode(), 2))) == 0

    growth(work, 10)
    assert min(growth(work, 20) for _ in range(3)) < 20 * 1000


def test_every_output_is_real(case):
    """Tools that read all outputs by one call for reals could not load them otherwise."""
    assert {case.variables[name].type for name in case.named("output")} <= {"Real", "Float64"}


def test_a_value_before_initialization_is_that_of_the_start(spring):
    """Some importers read all outputs there: k y²/2 of what is set so far; what is not known ends no instance."""
    k = spring.instance()
    k.set("displacement", 0.25)
    assert k.get("displacement") == 0.25
    k.set("linear_stiffness", 8.0)
    assert k.get("potential_energy") == 0.25
    k.set("cubic_stiffness", -1e3)
    assert k.status(k.get, "potential_energy") == DISCARD
    assert "must be within the hilltop" in k.message
    k.set("cubic_stiffness", 0.0)
    k.start()
    assert k.get("potential_energy") == 0.25


def test_importers_write_again_what_cannot_change(case):
    k = case.moving()
    words = {"true": 1.0, "false": 0.0}
    names = [*case.named("parameter"), *(["displacement"] if case.name == "spring" else [])]
    for name in names:
        value = case.parameters.get(name, case.variables[name].start)
        assert k.try_set(name, float(words.get(value, value))) == OK, name
    k.step(0.0, 0.01)
