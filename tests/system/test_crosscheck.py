"""`crosscheck` passes where co-simulation and reference solve the same problem, and fails where they do not."""

import csv
import json

import numpy as np
import pytest
import tomli_w
from commands import command, printed
from scenes import kinds

from springbeam import load_scene, simulate, with_changes
from springbeam.monolithic import algorithm1, event_driven
from springbeam.studies.comparison import _judged, compare
from springbeam.studies.crosscheck import Crosscheck, Orders
from springbeam.studies.study import record_all

SOFT = load_scene("soft")


def write(scene, folder):
    path = folder / "scene.toml"
    path.write_text(tomli_w.dumps(scene.model_dump(exclude_none=True, exclude_unset=True)))
    return path


LOADS = [
    {"on": "base", "signal": "harmonic", "frequency": 12.0, "amplitude": 5.0},
    {"on": "beam", "shape": [1.0, -2.0, 0.5, 0.3], "signal": "half_sine", "start": 0.01, "duration": 0.033},
    {"on": "beam", "at": 0.37, "signal": "step", "start": 0.02, "amplitude": -0.5},
    {"on": "spring", "signal": "ramp", "start": 0.0, "duration": 0.05, "amplitude": -1.0},
]


@pytest.mark.parametrize(
    ("degree", "loads", "beam"),
    [
        (0, [], {"n_elements": 2, "element_degree": 6}),
        (0, [], {"n_elements": 6, "element_degree": 2, "reduced_integration": True, "tip_load_coefficient": -6.0}),
        (0, [], {"n_elements": 12, "mass_matrix": "averaged"}),
        (0, [], {"n_elements": 6, "n_modes": 2, "integrator": "midpoint"}),  # which keeps all modes
        (0, [], {"n_elements": 4, "element_degree": 3, "n_modes": 6, "mass_matrix": "averaged", "alpha_b": 1e-3}),
        (0, [], {"n_elements": 30, "element_degree": 10, "n_modes": 8, "distributed_load": -2.0, "alpha_b": 1e-3}),
        (0, LOADS, {}),
        (2, LOADS, {"n_elements": 6, "element_degree": 3, "n_modes": 8, "mass_matrix": "averaged"}),
    ],
)
def test_any_elements_and_loads_pass(degree, loads, beam):
    """The reference assembles another basis (Lagrange, by quadrature) of the same space.

    It takes loads on a mesh of its own and samples their signals.
    """
    coupling = {"macro_step": 5e-4, "degree": degree}
    report = compare(with_changes(SOFT, time={"t_end": 0.1}, coupling=coupling, beam=beam, loads=loads))
    assert report["verdict"] == "agrees", report["quantities"]
    assert report["horizon"] == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("error", "at", "passed"),
    [
        ([0.3, 0.2, 0.5], 2, True),
        ([0.5, 0.9, 1.0], 1, False),
        ([0.0, 0.0, 0.82], 2, False),
        ([0.41, 0.4, 0.8], 2, True),
    ],
)
def test_an_error_may_be_four_times_what_halving_has_changed_so_far_and_the_floor(error, at, passed):
    """Told is the largest error or, where a bound is broken, the one that is furthest out of it."""
    changed, floor = np.array([0.1, 0.0, 0.2]), np.full(3, 0.01)
    found = _judged("y", np.array([1.0, 2.0, 3.0]), np.array(error), changed, floor)
    rms, bound = np.sqrt(np.mean(np.square(error))), (0.41, 0.41, 0.81)[at]
    assert (found["at"], found["error"], found["passed"]) == (at + 1.0, error[at], passed)
    assert (found["l2"], found["bound"]) == pytest.approx((rms, bound), rel=1e-14)


def test_what_cannot_be_compared_has_not_agreed(tmp_path):
    """Tip and top touch at one velocity: the least change of it decides whether they are joined at once."""
    beam, spring = {"n_elements": 3, "fidelity": "quasi_static"}, {"initial_velocity": -1.0}
    grazing = with_changes(SOFT, beam=beam, spring=spring, time={"t_end": 0.05}, coupling={"macro_step": 1e-3})
    found = Crosscheck(scene=grazing)
    report = found.record({})
    assert (report["verdict"], report["quantities"]) == ("not comparable", [])
    assert "Nothing could be compared" in report["notes"][-1]
    assert found.findings({"comparison": report}).code == 4


def test_a_run_that_is_not_resolved_cannot_agree(tmp_path):
    """`paper-fig2` turns its slowest mode 967 rad in a macro step. Compared for 6 µs it had "passed"."""
    unresolved = with_changes(load_scene("paper-fig2"), time={"t_end": 0.6}, beam={"n_elements": 4, "n_modes": 0})
    result = command("crosscheck", write(unresolved, tmp_path), "--out", tmp_path / "out", "--json")
    found = json.loads(result.stdout)
    assert (result.exit_code, found["verdict"], found["quantities"]) == (4, "not comparable", [])
    assert found["horizon"] == unresolved.contact_time
    assert found["notes"][0].startswith("not resolved")


WRONG = {
    "mass": {"spring": {"mass": 1.01}},
    "sign of the cubic term": {"spring": {"cubic_stiffness": 0.2}},
    "beam": {"beam": {"density": 1.001}},
    "degree": {"beam": {"element_degree": 2}},
    "law": {"contact": {"law": "compliance", "stiffness": 1e6}},
    "restitution": {"stop": {"restitution": 0.9}},
    "load": {"spring": {"external_force": 1e-3}},
    "load that varies": {"loads": [{"on": "tip", "signal": "harmonic", "frequency": 12.0, "amplitude": 1e-3}]},
}


@pytest.mark.parametrize("what", WRONG)
def test_a_wrong_reference_fails(monkeypatch, what):
    """The reference is given another problem than the co-simulation: nothing in the bounds may hide that."""
    right = event_driven.simulate
    monkeypatch.setattr(
        event_driven, "simulate", lambda scene, **options: right(with_changes(scene, **WRONG[what]), **options)
    )
    scheme, degree = ("energy", 0) if what == "law" else ("hermite", 2)
    coupling = {"macro_step": 1e-3, "scheme": scheme, "degree": degree}
    assert compare(with_changes(SOFT, time={"t_end": 0.1}, coupling=coupling))["verdict"] == "differs"


@pytest.mark.parametrize(
    ("t_end", "steps", "impact"),
    [
        (0.5035, 1, "inelastic"),
        (0.7, 50, "inelastic"),
        (0.7013, 51, "inelastic"),
        (0.7 + 1e-10, 50, "inelastic"),
        (1.0, 125, "rest"),
    ],
)
def test_the_paper_law_agrees_with_algorithm_1_up_to_t_end(t_end, steps, impact):
    """First contact is at 0.5 s, h_t = 4 ms: off the grid the last step is shorter, by itself it was left out.

    A remainder that would drown in rounding joins the step before it.
    """
    changes = {"beam": {"n_elements": 50, "n_modes": 0}, "time": {"t_end": t_end}}
    law = {"law": "paper", "impact": impact}
    report = compare(with_changes(load_scene("paper-fig2"), contact=law, **changes))
    for run in report["runs"].values():
        assert (len(run["columns"]["time"]) - 1, run["columns"]["time"][-1]) == (steps, t_end)
    assert report["horizon"] == t_end
    assert report["verdict"] == "agrees"


def test_quick_compares_the_first_quarter_and_leaves_the_last_halving_out(here, unpainted):
    changes = ("time.t_end=0.2", "beam.n_elements=6", "coupling.macro_step=1e-3")
    settings = [*(f"--set={change}" for change in changes), "--quick", "--json"]
    found = json.loads(printed("crosscheck", "soft", *settings))
    assert (found["verdict"], found["scene"]["time"]["t_end"]) == ("agrees", 0.05)
    rows = list(csv.DictReader((here / found["files"][0]).open()))
    assert [float(row["error"]) for row in rows] == [row["error"] for row in found["quantities"]]
    found = json.loads(printed("crosscheck", "soft", *settings, "--orders"))
    assert "error_H/4" in found["orders"][0]
    assert "error_H/8" not in found["orders"][0]
    rows = list(csv.DictReader((here / found["files"][0]).open()))
    assert [float(row["order_H"]) for row in rows] == [row["order_H"] for row in found["orders"]]
    late = with_changes(SOFT, beam={"initial_deflection_slope": 0.1})  # the tip arrives at 0.1 s
    (case,) = Crosscheck(scene=late, quick=True).cases().values()
    assert case["time.t_end"] == pytest.approx(0.1 + 0.25 * (SOFT.time.t_end - 0.1), rel=1e-14)


def test_the_command_tells_by_its_exit_code(monkeypatch, tmp_path):
    """It shows again what it has found, until it is to begin anew."""
    out = tmp_path / "both"
    arguments = ["crosscheck", "duffing", "--set", "time.t_end=1", "--out", out]
    right = event_driven.simulate
    for options, mass, code in (([], 1.0, 0), ([], 1.01, 0), (["--force"], 1.01, 1)):
        wrong = {"spring": {"mass": mass}}
        monkeypatch.setattr(event_driven, "simulate", lambda scene, **more: right(with_changes(scene, **wrong), **more))  # noqa: B023
        assert command(*arguments, *options).exit_code == code
    assert (out / "crosscheck.png").stat().st_size > 10_000


def resolved(**tables):
    """A heavy spring on a stiff foundation under a beam that comes down on it, in steps that resolve both."""
    beam = {"young_modulus": 1e3, "shear_modulus": 1e3, "n_elements": 4, "approach": "elastic"}
    spring = {"mass": 100.0, "linear_stiffness": 7e3, "cubic_stiffness": 4e8, "damping": 100.0, "external_force": -9.0}
    given = {"contact": {"law": "paper", "stiffness": 500.0}, "coupling": {"macro_step": 1e-3}}
    moving = {"initial_velocity_slope": -0.1, "alpha_b": 1e-3}
    return with_changes(with_changes(SOFT, beam={**beam, **moving}, spring=spring, **given), **tables)


def test_algorithm_1_begins_in_contact_where_an_elastic_approach_begins_at_the_spring():
    """Its reference let the beam move freely for a step first."""
    scene = resolved(time={"t_end": 5e-3})
    assert algorithm1.simulate(scene).phase[0] == "tied"
    assert compare(scene)["verdict"] == "agrees"


@pytest.mark.parametrize(
    ("impact", "slope", "speed", "stop", "stiffness", "phases"),
    [
        ("tip", 0.0, -0.1, -0.015, 500.0, {"tied", "seated"}),
        ("tip", 0.0, -0.1, -1e-4, 1e5, {"tied", "seated", "free"}),
        ("rest", 0.0, 0.1, -0.015, 1e5, {"tied", "free"}),
        ("rest", 2e-4, -0.1, -0.015, 1e5, {"free", "tied"}),
    ],
)
def test_algorithm_1_decides_as_its_reference_does(impact, slope, speed, stop, stiffness, phases):
    """In all its columns, up to a last step of 0.3 h; a spring sinks before the tip has come and after it has left.

    The midpoint rule and the exact flow differ by (ωh)²/12 ≤ 9e-5 of a step's motion, over 6 steps; 3e-4 is allowed,
    and more of energies, which grow tenfold in a step, and of which a dashpot takes that of the mean velocity.
    """
    contact = {"exponent": 1.0, "impact": impact, "stiffness": stiffness}
    beam = {"initial_deflection_slope": slope, "initial_velocity_slope": speed}
    spring = {"initial_velocity": -0.02 if slope else 0.0}
    scene = resolved(time={"t_end": 5.3e-3}, contact=contact, beam=beam, spring=spring, stop={"position": stop})
    run, reference = simulate(scene), algorithm1.simulate(scene)
    assert (list(run.phase), run.summary["macro_steps"]) == (list(reference.phase), 6)
    assert set(run.phase) == phases
    assert kinds(run) == kinds(reference)
    impulses = [[event.impulse_foundation for event in found.events] for found in (run, reference)]
    assert impulses[0] == pytest.approx(impulses[1], abs=3e-4 * max(impulses[1]))
    shares = dict.fromkeys(("u_tip", "v_tip", "y", "z", "contact_force", "compliance_force", "foundation_force"), 3e-4)
    for name, share in (shares | {"e_beam": 3e-4, "energy_residual": 1e-3}).items():
        largest = np.abs(reference[name]).max()
        assert run[name] == pytest.approx(reference[name], abs=share * largest, rel=0.0), name
    assert np.array_equal(run.contact_force_smoothed, run.contact_force)
    for body, share in {"beam": 3e-4, "spring": 1e-3}.items():
        injected = reference[f"e_injected_{body}"][-1]
        assert run.summary[f"injected_into_{body}"] == pytest.approx(injected, rel=share, abs=1e-9)


def test_a_reference_that_fails_is_one_error(tmp_path):
    changes = ["contact.law=paper", "beam.n_elements=4", "coupling.macro_step=1e-3", "time.t_end=0.05"]
    result = command("crosscheck", "soft", *(f"--set={change}" for change in changes), "--out", tmp_path / "out")
    assert result.exit_code == 3
    assert result.stderr.startswith("error: Newton's method for the predicted position does not converge at t = 0.0")


def test_orders_are_those_of_the_scheme():
    """hermite of degree 2: displacement 6, velocity 6, and the force 4, if the means of its limits are compared."""
    coupling = {"macro_step": 2e-3, "scheme": "hermite", "degree": 2}
    study = Orders(scene=with_changes(SOFT, time={"t_end": 0.07}, coupling=coupling), quick=True)
    orders = {row["quantity"]: row["order_H/2"] for row in study.findings(record_all(study)).tables["orders"]}
    assert orders["y"] == pytest.approx(6.0, abs=0.5)
    assert orders["z"] == pytest.approx(6.0, abs=0.4)
    assert orders["contact_force"] == pytest.approx(4.0, abs=0.4)
