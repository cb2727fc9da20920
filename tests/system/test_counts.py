"""What a scene lacks costs nothing: no FMU, no call into one, no event function. Counts, not times."""

from collections import Counter

import pytest
import scenes
from faulty import installed

from springbeam import simulate
from springbeam.bodies.fmu import release

SET_SLOPES = "fmi2SetRealInputDerivatives"


@pytest.fixture
def counted(monkeypatch):
    """Runs a scene and counts ``(FMU, FMI function)``."""
    script = installed(monkeypatch)

    def run(scene):
        release()
        script.calls.clear()
        return simulate(scene, check=False), Counter((fmu, function) for fmu, function, _ in script.calls)

    yield run
    release()  # what is kept would go on counting


FLIGHTS = scenes.group("flights")
#: The FMUs of those that do not need both.
FMUS = {"spring alone": {"spring"}, "beam alone": {"beam"}, "quasi-static": {"spring"}}


@pytest.mark.parametrize("name", FLIGHTS)
def test_flight_costs_one_step_of_each_fmu(counted, name):
    """Nothing is iterated, nothing taken back; no slope of an input is set, but of a load in the 10 steps it varies."""
    scene = FLIGHTS[name]
    n = round(scene.duration / scene.coupling.H)
    fmus = FMUS.get(name, {"beam", "spring"})
    run, calls = counted(scene)
    assert set(run.phase) == {"free"}
    assert (run.summary["macro_steps"], run.summary["iterations"]) == (n, 0)
    assert {body for body, _ in calls} == fmus
    for body in fmus:
        made = [calls[body, f"fmi2{function}"] for function in ("DoStep", "SetFMUstate")]
        assert made == [n, 0]
        assert calls[body, SET_SLOPES] == (10 if (name, body) == ("loads", "beam") else 0)
