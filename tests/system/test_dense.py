"""A run between its rows: every column at its place, and the extremes of the curves."""

from itertools import pairwise

import numpy as np
import pytest
import scenes
from references import reference

from springbeam import load_scene, simulate
from springbeam.results.records import impulse
from springbeam.results.records import joined as are_joined
from springbeam.studies.metrics import METRICS


@pytest.mark.parametrize("name", scenes.group("dense"))
def test_rows_are_themselves_and_between_them_every_column_holds(name):
    """Between rows energies go straight, so that their sum is kept as at rows; joined ends have one place and velocity;
    the mean force is that applied, but for what turns a mismatch round; ends have the integral of their step.
    """
    run = simulate(scenes.named(f"dense/{name}"))
    last = np.append(run.time[1:] != run.time[:-1], True)  # of rows at one time: after the events
    again = run.at(run.time[last])
    for column in run.columns:
        assert np.array_equal(again[column], run[column][last]), column

    rows = np.flatnonzero(run.steps["size"] > 0.0)
    steps = run.steps[rows]
    begin = run.steps[rows - 1]
    nodes, weights = np.polynomial.legendre.leggauss(5)
    inside = [run.at(steps["time"] - 0.5 * (1.0 - x) * steps["size"]) for x in nodes]
    middles = inside[2]
    scale = np.abs(run.e_total).max()
    assert np.abs(middles.energy_residual).max() <= 2.0 * np.abs(run.energy_residual).max() + 1e-14 * scale
    for column in {"e_contact", "e_dissipated"} & set(run.columns):
        straight = 0.5 * (run[column][rows - 1] + run[column][rows])
        assert middles[column] == pytest.approx(straight, rel=1e-12, abs=1e-12 * np.abs(run[column]).max()), column
    together = are_joined(begin) & run.scene.contact.rigid
    if together.any() and "u_tip" in run.columns and "y" in run.columns:
        assert np.abs(middles.gap[together]).max() < 1e-12
        assert np.array_equal(middles.v_tip[together], middles.z[together])

    def mean(column):
        return sum(weight * there[column] for weight, there in zip(weights, inside, strict=True)) / 2.0

    if "contact_force" in run.columns:
        applied = impulse(run.steps, "contact_force")[rows] / steps["size"]
        compared = ~together | (begin["phase"] < 3.0)
        if run.scene.contact.opens and not run.scene.contact.rigid:
            compared &= np.min([there.contact_force for there in inside], axis=0) > 0.0  # no part of it is cut off
        assert mean("contact_force")[compared] == pytest.approx(
            applied[compared], rel=1e-9, abs=1e-9 * np.abs(applied).max()
        )
    for column in {"u_tip", "y"} & set(run.columns):
        integral = steps[f"{column}_integral"] / steps["size"]
        assert mean(column)[~together] == pytest.approx(integral[~together], rel=1e-11, abs=1e-15)
    assert np.array_equal(middles.phase == "seated", begin["phase"] >= 3.0)
    for event in run.events:  # has not happened just before
        if event.energy_loss > 1e-6 and event.time > run.time[0]:
            before = run.at(event.time - 1e-6 * run.steps[np.searchsorted(run.time, event.time)]["size"])
            after = run.at(event.time)
            assert before.e_impact_loss[0] == pytest.approx(after.e_impact_loss[0] - event.energy_loss)
            assert abs(after.e_total[0] - before.e_total[0]) < 1e-8 * scale


@pytest.mark.parametrize("name", scenes.group("extremes"))
def test_extremes_are_those_of_the_curve(name):
    """Metrics and the summary beside 200 points a step: no point is beyond, and one is near."""
    run = simulate(scenes.named(f"extremes/{name}"))
    # Between events: what `at` returns there, and just before them.
    points = [np.linspace(a, b, 201)[:-1] for a, b in pairwise(np.unique(run.time))]
    fine = run.at(np.append(np.concatenate(points), run.time[-1]))
    pairs = [("u_tip_min", "u_tip", np.min), ("u_tip_max", "u_tip", np.max), ("y_min", "y", np.min)]
    pairs += [("y_max", "y", np.max), ("gap_max", "gap", np.max), ("z_max", "z", lambda z: np.abs(z).max())]
    seen = 0
    for name, column, of in pairs:
        value = METRICS[name](run)
        if column not in run.columns:
            assert value is None
            continue
        grid = of(fine[column])
        scale = np.abs(fine[column]).max()
        beyond = value - grid if of is not np.min else grid - value
        assert -1e-12 * scale <= beyond <= 1e-3 * scale, name
        seen += abs(value - of(run[column])) > 1e-6 * scale
    assert run.summary["deepest_tip"] == METRICS["u_tip_min"](run)
    assert seen  # rows alone would not do


def test_times_that_are_not_known_are_refused(tmp_path):
    run = simulate(load_scene("soft", ["time.t_end=0.05"]))
    for known, times, said in (
        (run, [0.01, 0.06], r"time 0\.06 s: the run is known from 0\.0 s to 0\.05 s"),
        (run, np.nan, "time nan s"),
        (run, [[0.01, 0.02]], r"shape \(1, 2\)"),
        (reference(run.scene), 0.01, "this run has no data between its rows"),
    ):
        with pytest.raises(ValueError, match=said):
            known.at(times)
    assert run.at([0.02, 0.01]).time.tolist() == [0.02, 0.01]
    assert len(run.at([])) == 0
