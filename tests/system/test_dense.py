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
    run = simulate(scenes.named(f"dense/{name}"))
    last = np.append(run.time[1:] != run.time[:-1], True)  # of rows at one time: after the events
    again = run.at(run.time[last])
    for name in run.columns:
        assert np.array_equal(again[name], run[name][last]), name

    steps = run.steps[run.steps["size"] > 0.0]
    nodes, weights = np.polynomial.legendre.leggauss(5)
    inside = [run.at(steps["time"] - 0.5 * (1.0 - x) * steps["size"]) for x in nodes]
    middles = inside[2]
    begin = run.steps[np.flatnonzero(run.steps["size"] > 0.0) - 1]
    assert list(middles.columns) == list(run.columns)
    kept = sum(middles[name] for name in run.columns if name.startswith("e_") and name != "e_total")
    assert np.array_equal(middles.e_total, kept)
    # Energies go straight between rows, so that their sum is kept between them as it is at them.
    scale = np.abs(run.e_total).max()
    assert np.abs(middles.energy_residual).max() <= 2.0 * np.abs(run.energy_residual).max() + 1e-14 * scale
    if "y" in run.columns and "u_tip" in run.columns:
        assert np.array_equal(middles.gap, middles.u_tip - middles.y)
        joined = (middles.phase == "tied") | (middles.phase == "touch")
        if run.scene.contact.rigid:
            assert np.abs(middles.gap[joined]).max() < 1e-12
            assert np.array_equal(middles.v_tip[joined], middles.z[joined])
    rows = np.flatnonzero(run.steps["size"] > 0.0)
    for name in {"clamp_force", "clamp_moment", "e_contact", "e_dissipated"} & set(run.columns):
        straight = 0.5 * (run[name][rows - 1] + run[name][rows])
        largest = np.abs(run[name]).max()
        assert middles[name] == pytest.approx(straight, rel=1e-12, abs=1e-12 * largest), name
    # Forces have the impulse of those applied, but for what turns a mismatch round; ends keep the integral of their
    # step, and what is seated stays so up to the next row.
    together = are_joined(begin) & run.scene.contact.rigid
    free = together & (begin["phase"] < 3.0)
    for name in {"contact_force"} & set(run.columns):
        mean = sum(weight * there[name] for weight, there in zip(weights, inside, strict=True)) / 2.0
        applied = impulse(run.steps, name)[rows] / steps["size"]
        compared = free | ~together
        if run.scene.contact.opens and not run.scene.contact.rigid:
            compared &= np.min([there[name] for there in inside], axis=0) > 0.0  # no part of it is cut off
        assert mean[compared] == pytest.approx(applied[compared], rel=1e-9, abs=1e-9 * np.abs(applied).max())
    for name in {"u_tip", "y"} & set(run.columns):
        mean = sum(weight * there[name] for weight, there in zip(weights, inside, strict=True)) / 2.0
        own = ~together
        assert mean[own] == pytest.approx((steps[f"{name}_integral"] / steps["size"])[own], rel=1e-11, abs=1e-15)
        remaining = (0.25 * w * (1.0 - x) * there[name] for w, x, there in zip(weights, nodes, inside, strict=True))
        twice = steps[f"{name}_integral_2"] / steps["size"] ** 2  # ∫∫, of ∫ (1 − s) w ds
        assert sum(remaining)[own] == pytest.approx(twice[own], rel=1e-10, abs=1e-15)
    assert np.array_equal(middles.phase == "seated", begin["phase"] >= 3.0)
    # Just before an event it has not happened yet.
    for event in run.events:
        if event.energy_loss > 1e-6 and event.time > run.time[0]:
            step = run.steps[np.searchsorted(run.time, event.time)]
            before = run.at(event.time - 1e-6 * step["size"])
            if event.kind.collision and run.scene.spring is not None:
                gained = 0.5 * run.scene.spring.mass * (step["z_after"] ** 2 - step["z"] ** 2)
                after = run.e_spring[np.searchsorted(run.time, event.time)]
                assert after - before.e_spring[0] == pytest.approx(gained, rel=1e-4, abs=1e-5 * scale)
            assert before.e_impact_loss[0] == pytest.approx(run.at(event.time).e_impact_loss[0] - event.energy_loss)
            assert abs(run.at(event.time).e_total[0] - before.e_total[0]) < 1e-8 * scale


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
