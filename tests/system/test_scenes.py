"""Scenes beside what they are compared with: a case of tests/scenes.toml each."""

import numpy as np
import pytest
import scenes
from judge import Reference, judge
from references import integrated_anew

from springbeam import RunStopped, simulate, with_changes
from springbeam.monolithic.event_driven import integrate as reference
from springbeam.results.contact_changes import contact_changes
from springbeam.studies.comparison import compare
from springbeam.studies.metrics import METRICS

CASES = scenes.TABLE["cases"]


#: What of events is compared within bounds.
OF_EVENTS = {"times": ("time",), "velocities": ("z", "v_tip"), "losses": ("energy_loss",)}


def beside_reference(scene, bounds, _):
    """Compare events, motion and energy with those of the event-driven reference."""
    run = simulate(scene)
    rows = np.searchsorted(run.time, np.unique(run.time)[:: len(run) // 100 + 1], side="right") - 1
    rows = rows[run.time[rows] <= bounds.get("until", np.inf)]
    exact = reference(scene, sample_times=run.time[rows])
    starts = bounds.get("starts", [])
    found, right = (scenes.kinds(each) for each in (run, exact))
    first = bounds.get("first") if "times" in bounds else len(starts)
    assert found[:first] == right[:first]
    assert found[: len(starts)] == starts
    if "kinds" in bounds:
        assert [kind for kind in found if kind != "stop_impact"] == bounds["kinds"]
    for bound, names in OF_EVENTS.items():
        if bound in bounds:
            ours, theirs = (
                [[getattr(event, name) for name in names] for event in of.events[:first]] for of in (run, exact)
            )
            np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=bounds[bound])
    if "contacts" in bounds:
        ours, theirs = (contact_changes(each, 1e-3) for each in (run, exact))
        assert [change.kind for change in ours] == [change.kind for change in theirs]
        times = [change.time for change in theirs]
        assert [change.time for change in ours] == pytest.approx(times, abs=bounds["contacts"])
        assert run.e_impact_loss[-1] == pytest.approx(exact.e_impact_loss[-1], abs=bounds["lost"])
        for name in ("e_beam", "e_load"):  # also what no place of the tip says
            assert run[name][0] == pytest.approx(exact[name][0], rel=1e-12, abs=1e-15)
    for column in {"u_tip", "y"} & set(run.columns):
        there = exact[column][np.searchsorted(exact.time, run.time[rows])]
        scale = min(np.ptp(exact[column]), np.abs(exact[column]).max())
        assert np.abs(run[column][rows] - there).max() <= bounds.get("motion", np.inf) * scale, column
    assert run.summary["max_energy_residual"] < bounds.get("energy", np.inf)
    assert exact.summary["largest_relative_energy_residual"] < 1e-11


def value_of(run, name):
    """Return a metric, a number of the summary, a column at the end, or what the first contact has."""
    if name.startswith("contact."):
        return getattr(run.contacts[0], name.removeprefix("contact."))
    if name in METRICS:
        return METRICS[name](run)
    return run.summary[name] if name in run.summary else run[name][-1]


def beside_formula(scene, values, _):
    run = simulate(scene)
    assert {name: value_of(run, name) for name in values} == {
        name: pytest.approx(right, abs=error, rel=0.0) for name, (right, error) in values.items()
    }


def beside_twin(scene, bounds, _):
    run = simulate(scene, check=False)
    twin = simulate(scenes.named(bounds["twin"]), check=False)
    assert run.time[0] == bounds["begins"]
    for column in run.columns:
        np.testing.assert_array_equal(run[column], twin[column])


def crosschecked(scene, bounds, _):
    report = compare(scene)
    assert (report["verdict"], report["horizon"]) == (bounds["verdict"], pytest.approx(scene.time.t_end))


def within_limits(scene, _, __):
    """Bodies neither overlap nor part, by 1e-9 of the motion; energy is kept, to 1e-8."""
    found = judge(scene)
    assert found["kind"] in ("conserved", "dissipative"), found["reason"]


def judged(scene, bounds, _):
    found = judge(scene, Reference(scene))
    for name, allowed in bounds.items():
        value = found[name]
        inside = any(word in value for word in allowed) if isinstance(value, str) else allowed[0] <= value <= allowed[1]
        assert inside, (name, value)


def beside_scipy(scene, bounds, monkeypatch):
    """The first and the longest step of each phase of the reference are what scipy makes of them."""
    run = integrated_anew(scene, monkeypatch, bounds.get("until", 0.3))
    assert run.summary["largest_relative_energy_residual"] < 1e-11
    assert run.summary["counts"]["steps"] < 1000


ORACLES = {
    "formula": beside_formula,
    "reference": beside_reference,
    "limits": within_limits,
    "judge": judged,
    "twin": beside_twin,
    "crosscheck": crosschecked,
    "scipy": beside_scipy,
}


@pytest.mark.parametrize("name", CASES)
def test_a_scene_is_that_of_its_oracle(name, monkeypatch):
    case = CASES[name]
    left_out = dict.fromkeys(case.get("without", []))
    scene = with_changes(scenes.named(case["of"]), **case.get("change", {}), **left_out)
    bounds = {**scenes.TABLE["bounds"].get(case.get("within"), {}), **case.get("bounds", case.get("values", {}))}
    ORACLES[case["oracle"]](scene, bounds, monkeypatch)


# -- what a run does where nothing is to be compared with -------------------------------------------------------------


@pytest.mark.parametrize("size", [0.1, 1e-3])
def test_bouncing_without_end_stops_by_name(monkeypatch, size):
    """A damped beam on a lossless stop: its rebounds shrink, but never by enough to be the last.

    Also where three of them lie within a macro step: runs like that have gone on for hours.
    """
    monkeypatch.setattr("springbeam.run.stepping._MOST_IN_A_ROW", 300)
    beam = {"density": 672.6, "area": 0.07, "shear_modulus": 53.6, "alpha_b": 1.0, "n_elements": 6}
    tables = {
        "time": {"t_end": 1.5},
        "beam": {**beam, "initial_velocity_slope": -1.0},
        "stop": {"position": 0.0},
        "coupling": {"macro_step": size},
    }
    with pytest.raises(RunStopped, match=f"chatters: 300 events, each within a macro step of {size:g} s"):
        simulate(scenes.scene_from_dict(tables))
