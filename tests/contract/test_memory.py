"""Memory stays flat over many instances, also over those that failed."""

from __future__ import annotations

import ctypes as ct
from collections.abc import Callable
from typing import Any

import pytest

pytestmark = pytest.mark.skipif(not hasattr(ct.CDLL(None), "mallinfo2"), reason="mallinfo2 came with glibc 2.33")

OK, ERROR, CO_SIMULATION = 0, 3, 1
CYCLES = 10_000
#: Growth allowed [bytes]: 7 bytes a cycle.
FLAT = 64 * 1024
#: Cheap ones that use what can be allocated.
PARAMETERS: dict[str, dict[str, float]] = {
    "beam": {"n_elements": 2, "n_modes": 0},
    "spring": {"stop_enabled": 1, "contact_law": 2},
}


class MallocInfo(ct.Structure):
    """glibc's struct mallinfo2."""

    _fields_ = [
        *((name, ct.c_size_t) for name in ("arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks")),
        *((name, ct.c_size_t) for name in ("uordblks", "fordblks", "keepcost")),
    ]


def growth(cycle: Callable[[int], None], cycles: int) -> int:
    """Return what malloc gave out and did not get back [bytes] over `cycles`, after those that fill caches."""
    information = ct.CDLL(None).mallinfo2
    information.restype = MallocInfo

    def in_use() -> int:
        found = information()
        return int(found.uordblks + found.hblkhd)

    for i in range(1000):
        cycle(i)
    before = in_use()
    for i in range(cycles):
        cycle(i)
    return in_use() - before


def run(instance: Any, parameters: dict[str, float], i: int) -> None:
    """A step, states saved, restored and serialised; some left to the instance to free, some runs ended by an error."""
    instance.start(**parameters)
    state = instance.state()
    instance.step(0.0, 1e-4)
    copy = instance.deserialized(instance.serialized())
    instance.restore(copy)
    instance.restore(state)
    if i % 3:
        assert instance.call("fmi2FreeFMUstate", ct.byref(state)) == OK
        assert instance.call("fmi2FreeFMUstate", ct.byref(copy)) == OK
    if i % 7 == 0:
        assert instance.try_step(1.0, -1.0) == ERROR


@pytest.fixture
def life(case: Any) -> Any:
    """life(i) instantiates and runs, every tenth time once more after a reset; the instance is not freed.

    One Python object serves all: only the FMU's memory is of interest.
    """
    instance = case.instance()
    instance.free()
    identity = case.description.guid.encode()

    def one(i: int) -> Any:
        made = case.library.fmi2Instantiate(b"test", CO_SIMULATION, identity, None, None, 0, 0)
        instance.component = ct.c_void_p(made)
        run(instance, PARAMETERS[case.name], i)
        if i % 10 == 0:
            assert instance.call("fmi2Reset") == OK
            run(instance, PARAMETERS[case.name], 1)
        return instance

    return one


def test_memory_is_flat_over_many_instances(life: Callable[[int], Any]) -> None:
    assert growth(lambda i: life(i).free(), CYCLES) < FLAT


def test_instances_that_are_not_freed_would_be_seen(life: Callable[[int], Any]) -> None:
    kept: list[ct.c_void_p] = []

    def cycle(i: int) -> None:
        instance = life(i)
        if i % 20 == 0:
            kept.append(instance.component)
        else:
            instance.free()

    try:
        assert growth(cycle, 1000) > FLAT
    finally:
        instance = life(1)
        instance.free()
        for component in kept:
            instance.component = component
            instance.free()
