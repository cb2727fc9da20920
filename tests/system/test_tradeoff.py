"""The trade between error and cost, on the FMUs: what is swept, judged and named."""

from __future__ import annotations

import csv
import itertools
import json

import numpy as np
import pytest
from commands import HANGS, printed

from springbeam.monolithic import event_driven
from springbeam.scene import SceneError, load_scene, with_changes
from springbeam.studies import tradeoff
from springbeam.studies.study import record_all
from springbeam.studies.tradeoff import Tradeoff
from springbeam.studies.tradeoff.configurations import ALGORITHM_1, configurations
from springbeam.studies.tradeoff.points import Errors, Point, Points, errors


@pytest.fixture(scope="module")
def found():
    scene = with_changes(load_scene("soft"), beam={"n_elements": 6}, coupling={"macro_step": 1e-3})
    study = Tradeoff.of(scene, until=0.06, repeats=1)
    with pytest.MonkeyPatch.context() as patch:  # on a busy machine, too, nothing is given up
        patch.setattr(tradeoff, "_LIMIT", HANGS)
        patch.setattr(tradeoff, "_LIMIT_FINER", HANGS)
        return study.judged(record_all(study))


def by_family(found, family):
    return [p for p in found.points if p.family == family]


@pytest.mark.parametrize(("family", "order"), [("energy 0", 4.0), ("energy 1", 4.0), ("hermite 1", 4.0)])
def test_errors_fall_with_the_order_of_the_scheme(found, family, order):
    points = [p for p in by_family(found, family) if 1e-10 < p.displacement < 1e-5]
    assert len(points) >= 2
    rates = [np.log2(a.displacement / b.displacement) for a, b in itertools.pairwise(points)]
    assert order - 0.7 < np.median(rates) < order + 0.7


def test_more_steps_cost_more_calls(found):
    for family in ("energy 0", "energy 2", "hermite 2"):
        calls = [p.do_steps for p in by_family(found, family)]
        assert calls == sorted(calls)
        assert all(p.rollbacks > 0 for p in by_family(found, family))


def test_front_and_choices_are_of_points_on_the_same_model():
    """A point judged on a finer mesh is on no front; one that nothing is quicker and better than is; 0.1 is no result.
    A choice is the cheapest that keeps the error, of this package and of scipy."""

    def point(solve, error, method="co-simulation", refined=False):
        against = Errors(error, None, None, None, 0.0, None, None)
        return Point("family", "setting", method, refined, 0, None, against, "", solve, 0.0, 0.0)

    rough, better, finer = point(1.0, 1e-3), point(2.0, 1e-5), point(0.5, 1e-9, refined=True)
    slower, wrong, scipy, paper = (
        point(3.0, 1e-4),
        point(0.1, 0.2),
        point(1.5, 1e-7, "Radau"),
        point(0.2, 5e-3, ALGORITHM_1),
    )
    found = Points([better, slower, finer, rough, wrong, scipy, paper])
    assert found.front() == [paper, rough, scipy]
    assert [choice.ours for choice in found.cheapest()] == [rough, better, None, None]
    assert [choice.scipy for choice in found.cheapest()] == [scipy, scipy, scipy, None]
    assert [choice.ratio for choice in found.cheapest()] == [1.5, 0.75, None, None]


def test_a_tradeoff_has_a_front_and_choices(found):
    assert len(found.front()) >= 3
    assert None not in (found.cheapest()[1].ours, found.cheapest()[1].scipy)


def test_modes_converge_to_the_mesh_and_not_beyond(found):
    modes = by_family(found, "modes")
    assert [p.displacement for p in modes] == sorted((p.displacement for p in modes), reverse=True)
    own = next(p for p in by_family(found, "elements of degree 1") if p.setting == "6")
    assert all(p.displacement > 0.5 * own.displacement for p in modes)


def test_the_reference_has_no_error_and_a_shifted_one_has():
    scene = with_changes(load_scene("soft"), beam={"n_elements": 4}, time={"t_end": 0.1})
    times = np.linspace(0.0, 0.1, 101)
    exact = event_driven.simulate(scene, sample_times=times)
    same = errors(exact, exact, 1e-3)
    assert (same.displacement, same.event_time, same.impulse) == (0.0, 0.0, 0.0)
    moved = event_driven.simulate(scene, sample_times=times)
    moved.columns["y"] = exact.y + 0.01 * np.abs(exact.y - exact.y[0]).max()
    assert errors(moved, exact, 1e-3).displacement == pytest.approx(0.01, rel=1e-12)
    missed = moved.events.pop()
    assert missed.kind == "stop_impact"
    assert errors(moved, exact, 1e-3).event_time == pytest.approx(0.1 - missed.time)  # to the end of the run


@pytest.mark.parametrize(
    ("tables", "word"),
    [({"contact": {"law": "paper"}}, "Algorithm 1"), ({"contact": {"impact": "rest"}}, "no reference has it")],
)
def test_a_scene_without_a_reference_is_refused(tables, word):
    with pytest.raises(SceneError, match=word):
        Tradeoff.of(with_changes(load_scene("soft"), **tables))


ENERGY = {"energy 0", "energy 1", "energy 2", "energy 2, IDA 1e-04"}
OTHERS = {"DOP853", "LSODA", "Radau", "modes", "elements of degree 1", "elements of degree 4"}


@pytest.mark.parametrize(
    ("law", "there", "absent"),
    [
        ("transmission", {"hermite 1", "hermite 2, IDA 1e-04", "hermite 2 adaptive", "Algorithm 1"}, "jacobi 0"),
        ("compliance", {"jacobi 0", "jacobi 1", "gauss_seidel 0", "gauss_seidel 1", "Algorithm 1"}, "hermite 2"),
        ("tie", {"hermite 2"}, "Algorithm 1"),  # which lets go
        ("link", {"jacobi 1"}, "Algorithm 1"),
    ],
)
def test_every_axis_is_swept_that_the_law_has(law, there, absent):
    scene = with_changes(load_scene("soft"), contact={"law": law}, beam={"n_elements": 6}, time={"t_end": 0.05})
    families = {c.family for c in configurations(scene)}
    assert ENERGY | OTHERS | {"energy 2 adaptive"} | there <= families
    assert absent not in families


def test_of_scipy_a_beam_without_inertia_has_the_method_that_its_reference_has():
    """The others ended the study in a traceback."""
    scene = with_changes(load_scene("soft"), beam={"n_elements": 3, "fidelity": "quasi_static"})
    assert {c.method for c in configurations(scene)} == {"co-simulation", "DOP853"}


def test_command(tmp_path):
    arguments = ["tradeoff", "duffing", "--until", "0.5", "--repeats", "2", "--json", "--out", str(tmp_path / "out")]
    table = json.loads(printed(*arguments))
    assert [row["error"] for row in table["cheapest"]] == [1e-2, 1e-4, 1e-6, 1e-8]
    assert table["cheapest"][3]["co_simulation"]["error"] <= 1e-8
    rows = list(csv.DictReader((tmp_path / "out" / "tradeoff.csv").open()))
    assert {row["family"] for row in rows} >= {"energy 0", "DOP853"}
    assert all(row["u_tip_max"] == "" for row in rows)
    assert any(float(row["solve_spread"]) > 0.0 for row in rows)  # of both times
    assert (tmp_path / "out" / "tradeoff.png").stat().st_size > 10_000


def test_explicit_solvers_are_not_sent_after_a_mode_that_is_too_fast_for_them():
    """3.5e6 rad/s for 3 s are a million steps of DOP853; on `soft` to its first impact they are 40."""

    def left_out(name, until):
        every = configurations(with_changes(load_scene(name), time={"t_end": until}))
        return {c.method for c in every if tradeoff._hopeless(c)}

    assert left_out("bar-impact", 3.0) == {"DOP853", "LSODA"}
    assert left_out("soft", 0.0712) == set()


def test_what_takes_too_long_is_given_up_and_named(monkeypatch):
    """With no time at all every run is given up: one of each family is begun, and none is judged."""
    monkeypatch.setattr(tradeoff, "_LIMIT", 0.0)
    monkeypatch.setattr(tradeoff, "_LIMIT_FINER", 0.0)
    late = Tradeoff.of(with_changes(load_scene("soft"), beam={"n_elements": 4}), until=0.02)
    cases = late.cases()
    records = {name: late.record(cases[name]) for name in cases if name != "Algorithm 1"}
    models = records.pop("modes and elements")
    assert models["points"] == [] or all(point.cause for point in models["points"])
    for name, record in records.items():
        (point,) = record["points"]
        assert (point.family, point.errors) == (name, None)
        assert "takes more than 0 s" in point.cause or "diverges" in point.cause
        assert record["notes"] == [f"given up after 0 s, finer ones of their kind not run: {name}, {point.setting}"]


def test_models_are_left_out_if_their_reference_takes_too_long(monkeypatch):
    monkeypatch.setattr(tradeoff, "_LIMIT_FINER", 0.0)
    late = Tradeoff.of(with_changes(load_scene("soft"), beam={"n_elements": 4}), until=0.02, repeats=1)
    record = late.record(late.cases()["modes and elements"])
    assert record["points"] == []
    assert "the reference takes more than 0 s" in record["notes"][-1]


def test_quick_takes_every_third_of_a_family():
    scene = with_changes(load_scene("soft"), beam={"n_elements": 6}, coupling={"macro_step": 1e-3})
    whole, quick = (Tradeoff.of(scene, until=0.06, quick=quick).cases() for quick in (False, True))
    assert quick["energy 0"] == whole["energy 0"][::3]
    assert quick.keys() == whole.keys()
