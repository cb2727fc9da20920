"""What a scene lacks costs nothing: no FMU, no call into one, no event function. Counts, not times."""

import sys
from collections import Counter
from pathlib import Path as File

import numpy as np
import pytest
import scenes
from faulty import installed

from springbeam import Simulation, load_scene, simulate, with_changes
from springbeam.bodies.fmu import release
from springbeam.contact.phases import Joint
from springbeam.motion.paths import Path
from springbeam.results import dense
from springbeam.results.records import joined
from springbeam.run.errors.ends import Ends

SET_SLOPES = "fmi2SetRealInputDerivatives"


@pytest.fixture
def counted(monkeypatch):
    """Runs a scene and counts ``(FMU, FMI function)``."""
    script = installed(monkeypatch)

    def run(scene):
        release()
        script.calls.clear()
        return simulate(scene), Counter((fmu, function) for fmu, function, _ in script.calls)

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
        # Values are set with the parameters, then with each force; no load and no impulse by itself, but those loads
        # that act on the beam at the start. The state is saved for a later run, then before each step.
        made = [calls[body, f"fmi2{function}"] for function in ("DoStep", "GetFMUstate", "SetFMUstate", "SetReal")]
        assert made == [n, n + 1, 0, n + 1 + (name == "loads" and body == "beam")]
        assert calls[body, SET_SLOPES] == (10 if (name, body) == ("loads", "beam") else 0)


@pytest.mark.parametrize(("H", "degree"), [(2.5e-4, 0), (1e-3, 0), (1e-3, 2)])
def test_a_tied_step_costs_two_steps_of_each_body(counted, H, degree):
    """One to see what is left of the gap, one to close it; what a unit of each coefficient does is measured once for
    each size of step: H/8 after the impact, what is left of H, and H."""
    coupling = {"macro_step": H, "degree": degree}
    run, calls = counted(with_changes(load_scene("soft"), coupling=coupling, time={"t_end": 0.071}))
    summary = run.summary
    of_impact = 1  # a trial step for the force after it
    for body in ("beam", "spring"):
        assert [summary[f"{body}_{what}"] for what in ("steps", "rollbacks")] == [
            calls[body, f"fmi2{function}"] for function in ("DoStep", "SetFMUstate")
        ]
        assert (
            summary[f"{body}_steps"] <= 2 * summary["macro_steps"] + 3 * (degree + 1) + 1
        )  # a trial step after the impact
    # Each correction of the force is a step of the spring; to measure its response takes d + 2.
    assert 0 <= summary["spring_steps"] - summary["macro_steps"] - summary["iterations"] <= degree + 2 + of_impact


def test_a_flight_over_a_soft_body_looks_for_contact_inside_a_step_only_where_there_is_time_for_it(monkeypatch):
    """In 410 of 1202 steps the ends are apart; in 32 they are so near, or so fast, that they could meet and part."""
    looked = []
    lowest_inside = Path.lowest_inside
    monkeypatch.setattr(Path, "lowest_inside", lambda path: looked.append(path) or lowest_inside(path))
    contact = {"law": "compliance", "stiffness": 1e4}
    run = simulate(with_changes(load_scene("soft"), contact=contact, time={"t_end": 0.3}))
    assert 0 < len(looked) < 0.2 * np.count_nonzero(run.phase == "free")


def test_a_tied_step_passes_at_most_49_functions_in_12_files():
    """The loop of docs/architecture.md. What happens now and then is not in a usual step: a shape that is kept, or a
    search for a dip in the first steps after an impact."""
    passed: list[set[tuple[str, str, int]]] = []

    def note(frame, event, _):
        if event == "call" and "springbeam" in File(frame.f_code.co_filename).parts:
            passed[-1].add((frame.f_code.co_filename, frame.f_code.co_name, frame.f_code.co_firstlineno))

    with Simulation(load_scene("soft")) as simulation:
        master = simulation._master
        while master.state.phase.joint is not Joint.TIED or master.state.shapes_left:
            master.step()
        for _ in range(200):
            passed.append(set())
            sys.setprofile(note)
            try:
                master.step()
            finally:
                sys.setprofile(None)
        assert master.state.phase.joint is Joint.TIED
    usual = sorted(passed, key=len)[len(passed) // 2]
    assert 20 < len(usual) <= 49, sorted(usual)
    assert len({file for file, *_ in usual}) <= 12


def test_the_judge_passes_the_curves_of_a_run_once_and_a_flight_at_once(monkeypatch):
    """The judge moves a flight, 4 in 7 steps of `soft`, at once, and other steps one by one, in up to 4 parts."""
    calls = Counter()

    def counted(owner, name):
        function = getattr(owner, name)

        def count(*arguments):
            calls[name] += 1
            return function(*arguments)

        monkeypatch.setattr(owner, name, count)

    counted(dense, "motion")
    counted(Ends, "drift")
    run = simulate(load_scene("soft"))
    together = int(joined(run.steps[:-1])[run.steps["size"][1:] > 0.0].sum())
    assert calls["motion"] == 1
    assert together <= calls["drift"] <= together + 4 * len(run.events) < 0.5 * run.summary["macro_steps"]
