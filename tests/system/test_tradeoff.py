"""The trade between error and cost, on the FMUs: what is swept, judged and named; and scipy as its rival."""

import csv
import json

import numpy as np
import pytest
from commands import HANGS, printed
from scenes import kinds, soft

from springbeam.monolithic import event_driven
from springbeam.results.distance import motion
from springbeam.scene import load_scene, with_changes
from springbeam.studies import tradeoff
from springbeam.studies.metrics import costs
from springbeam.studies.rivals import Rival
from springbeam.studies.study import record_all, troubles
from springbeam.studies.tradeoff import Tradeoff, cheapest, pareto


def test_a_curve_between_few_points_is_judged_too(monkeypatch):
    """Between them one step of the cubic start of a scheme is worse than at them: 16 ms, 4 steps."""
    monkeypatch.setattr(tradeoff, "_LIMIT", HANGS)  # on a busy machine, too, nothing is given up
    study = Tradeoff.of(soft(), until=0.06, repeats=1)
    coarse = next(case for case in study.cases().values() if case["family"] == "energy 2")
    scene = study.at(coarse)
    run = tradeoff.simulate(scene)
    exact = event_driven.simulate(scene, sample_times=run.time)
    rows = np.searchsorted(exact.time, run.time)
    at_points = motion(run.columns, {name: exact[name][rows] for name in ("u_tip", "y")})
    assert study.record(coarse)["error_motion"] > 3.0 * at_points


def test_what_a_configuration_costs_and_where_it_errs_is_that_of_its_run():
    """The spring strikes its stop once."""
    scene = soft(time={"t_end": 0.12})
    run, exact = tradeoff.simulate(scene), event_driven.simulate(scene)
    row, summary = {**costs(run), **tradeoff._errors(run, exact)}, run.summary
    counts = {f"cost_{name}": sum(summary[f"{body}_{of}"] for body in ("beam", "spring"))
              for name, of in (("do_steps", "steps"), ("rollbacks", "rollbacks"))}  # fmt: skip
    assert {name: row[name] for name in counts} == counts
    assert row["error_energy"] == summary["max_energy_residual"]
    assert kinds(run) == kinds(exact) == ["impact", "stop_impact"]
    assert row["error_event_time"] == pytest.approx(abs(run.events[1].time - exact.events[1].time), rel=1e-9)
    impulses = np.array([[(event.impulse_contact, event.impulse_foundation) for event in found.events]
                         for found in (run, exact)]).sum(axis=1)  # fmt: skip
    off = np.abs(impulses[0] - impulses[1]).sum() / np.abs(impulses).sum(axis=1).min()
    assert row["error_impulse"] == pytest.approx(off, rel=1e-9)


@pytest.mark.parametrize(
    ("seconds", "settings", "median", "runs"),
    [((1.0, 2.9, 2.0), {}, 2.0, 3), ((3.1,), {}, 3.1, 1), ((2.0,), {"quick": True}, 2.0, 1)],
)
def test_the_median_of_the_timings_counts_and_long_runs_are_timed_once(monkeypatch, seconds, settings, median, runs):
    left = iter(seconds)
    monkeypatch.setattr(Tradeoff, "_by_us", lambda study, case: {"cost_wall_time": next(left)})
    record = Tradeoff(scene=soft(), **settings).record({"family": "energy 0"})
    assert (record["cost_wall_time"], len(record["times"])) == (median, runs)


@pytest.mark.parametrize(("quick", "seconds", "left_out"), [
    (False, 9.9, False), (False, 10.1, True), (True, 0.9, False), (True, 1.1, True),
])  # fmt: skip
def test_what_is_finer_than_one_that_took_too_long_is_left_out(quick, seconds, left_out):
    records = {"energy 0, H = 0.1": {"cost_wall_time": seconds}, "energy 1, H = 0.1": {"cost_wall_time": 99.0}}
    skipped = Tradeoff(scene=soft(), quick=quick).skipped({"family": "energy 0"}, records)
    assert (skipped is not None) is left_out
    assert not left_out or skipped["error"] == f"energy 0, H = 0.1 took more than {1 if quick else 10} s"


def test_front_and_choices_are_of_what_is_a_result():
    """One that nothing is quicker and better than is on the front; 0.1 is no result.

    A choice is the cheapest that keeps the error, as all finer ones of its family do: of this package and of scipy.
    """

    def row(seconds, error, family="ours", **rival):
        found = {"family": family, "setting": "", "status": "done", "error_motion": error}
        return found | {"cost_wall_time": seconds, "times": [seconds, 2.0 * seconds], **rival}

    rough, better = row(1.0, 1e-3), row(2.0, 1e-5)
    lucky, wrong, scipy = row(0.7, 1e-6, "luck"), row(0.1, 0.2, "luck"), row(1.5, 1e-7, "Radau", rtol=1e-4)
    found = [rough, better, lucky, wrong, scipy]
    assert pareto(found) == [lucky, scipy]
    assert [choice["co_simulation"] for choice in cheapest(found)] == [rough, better, None, None]
    assert [choice["scipy"] for choice in cheapest(found)] == [scipy, scipy, scipy, None]
    assert [choice["ratio"] for choice in cheapest(found)] == [1.5, 0.75, None, None]
    over_time, over_steps = Tradeoff(scene=load_scene("soft"))._picture(found, pareto(found)).args[0]
    drawn = {"ours": [(1.0, 1e-3), (2.0, 1e-5)], "luck": [(0.7, 1e-6), (0.1, 0.2)], "Radau": [(1.5, 1e-7)]}
    assert over_time.curves == drawn | {"Pareto front": [(0.7, 1e-6), (1.5, 1e-7)]}
    assert over_steps.curves == {name: [] for name in drawn}  # which none of them has counted


ENERGY = {"energy 0", "energy 1", "energy 2", "energy 2, IDA 1e-04"}
OTHERS = {"DOP853", "LSODA", "Radau"}


@pytest.mark.parametrize(
    ("law", "there", "absent"),
    [
        ("transmission", {"hermite 1", "hermite 2, IDA 1e-04", "hermite 2 adaptive"}, "jacobi 0"),
        ("compliance", {"jacobi 0", "jacobi 1", "gauss_seidel 0", "gauss_seidel 1"}, "hermite 2"),
        ("tie", {"hermite 2"}, "jacobi 0"),
        ("link", {"jacobi 1"}, "hermite 2"),
    ],
)
def test_every_axis_is_swept_that_the_law_has(law, there, absent):
    study = Tradeoff(scene=soft(contact={"law": law}, time={"t_end": 0.05}))
    families = {case["family"] for case in study.cases().values()}
    assert ENERGY | OTHERS | {"energy 2 adaptive"} | there <= families
    assert absent not in families


def test_command(tmp_path):
    arguments = ["tradeoff", "duffing", "--until", "0.2", "--repeats", "2", "--json", "--out", str(tmp_path / "out")]
    table = json.loads(printed(*arguments))
    assert [row["error"] for row in table["cheapest"]] == [1e-2, 1e-4, 1e-6, 1e-8]
    assert table["cheapest"][3]["co_simulation"]["error_motion"] <= 1e-8
    rows = list(csv.DictReader((tmp_path / "out" / "tradeoff.csv").open()))
    assert {row["family"] for row in rows} >= {"energy 0", "DOP853"}
    assert all(float(row["error_motion"]) >= 0.0 for row in rows if row["status"] == "done")
    assert all(len(json.loads(row["times"])) == 2 for row in rows if row["status"] == "done")
    assert (tmp_path / "out" / "tradeoff.png").stat().st_size > 10_000


def test_what_takes_too_long_is_given_up_and_named(monkeypatch):
    """With no time at all every run is given up: one of each family is begun, and none is judged."""
    monkeypatch.setattr(tradeoff, "_LIMIT", 0.0)
    study = Tradeoff.of(with_changes(load_scene("soft"), beam={"n_elements": 4}), until=0.02, repeats=2)
    rows = study.rows(record_all(study))
    begun = [row for row in rows if row["status"] == "stopped"]
    assert len(begun) == len({row["family"] for row in rows}) < len(rows)
    assert all("takes more than 0 s" in row["error"] or "diverges" in row["error"] for row in begun)
    assert troubles(record_all(study)) == [
        f"error     in {len(rows)} cases, first in energy 0, H = 0.004: stopped at t = 0.0005 s: takes more than 0 s"
    ]
    assert {row["status"] for row in rows} == {"stopped", "skipped"}


def test_a_beam_without_inertia_is_no_problem_for_scipy():
    """It has no equation of motion."""
    study = Tradeoff.of(with_changes(load_scene("soft"), beam={"fidelity": "quasi_static"}), until=0.02)
    assert study.cases()
    assert not any("method" in case for case in study.cases().values())
    assert study.remarks[0].startswith("scipy's solvers are left out")


# -- scipy ----------------------------------------------------------------------------------------------------------

TIGHT = {"method": "DOP853", "rtol": 1e-9, "atol": 1e-13}
LOADS = [
    {"on": "tip", "signal": "harmonic", "frequency": 12.0, "amplitude": 0.5},
    {"on": "spring", "signal": "step", "start": 0.02, "amplitude": -0.5},
]


@pytest.mark.parametrize(
    ("scene", "changes", "until"),
    [
        ("soft", {}, 0.4),  # tied, struck, free, touching
        ("soft", {"beam": {"alpha_b": 1e-3}, "loads": LOADS}, 0.1),
        ("soft", {"contact": {"law": "compliance", "damping": 1.0}}, 0.1),
        ("soft", {"contact": {"law": "link", "damping": 0.5}}, 0.1),
        ("soft", {"contact": {"law": "tie"}}, 0.1),
        ("beam-on-stop", {}, 0.1),  # seated, and free again
        ("duffing", {}, 2.0),
    ],
)
def test_scipy_solves_what_the_reference_solves(scene, changes, until):
    """The motion is right to its tolerance; what it evaluates is no more than the equations of motion."""
    beam = {} if scene == "duffing" else {"n_elements": 6, **changes.get("beam", {})}
    what = with_changes(load_scene(scene), **{**changes, "time": {"t_end": until}} | ({"beam": beam} if beam else {}))
    times = np.linspace(what.contact_time or 0.0, until, 101)
    solved = Rival(what).solve(**TIGHT, times=times)
    exact = event_driven.simulate(what, sample_times=times)
    rows = np.searchsorted(exact.time, times)
    for name, values in solved.columns.items():
        scale = np.abs(exact[name] - exact[name][0]).max()
        assert np.abs(values - exact[name][rows]).max() <= 1e-6 * scale


@pytest.mark.parametrize("method", ["LSODA", "Radau"])
def test_the_implicit_methods_get_the_jacobian(method):
    """By differences it would take as many evaluations as there are unknowns."""
    what = with_changes(load_scene("soft"), beam={"n_elements": 20}, time={"t_end": 0.02})
    times = np.linspace(0.0, 0.02, 21)
    rival = Rival(what)
    solved = rival.solve(method, 1e-5, 1e-9, times)
    assert motion(solved.columns, event_driven.simulate(what, sample_times=times).columns) < 1e-4
    (phase,) = rival._phases.values()
    X = np.random.default_rng(0).normal(size=82)
    for k in (0, 45, 80):
        step = 1e-6 * np.eye(82)[k]
        column = (phase.rhs(0.0, X + step) - phase.rhs(0.0, X - step)) / 2e-6
        assert phase.jacobian(0.0, X)[:, k] == pytest.approx(column, rel=1e-6, abs=1e-4 * np.abs(column).max())


def test_bounces_that_die_out_end_no_comparison():
    """The last of them are microseconds apart: another one comes first if the initial velocity changes a little."""
    scene = with_changes(load_scene("beam-on-stop"), beam={"n_elements": 8})
    assert Tradeoff.of(scene).scene.time.t_end == 1.0
