"""A run between its rows: every column at its place, and the extremes of the curves."""

from itertools import pairwise

import numpy as np
import pytest
import scenes

from springbeam import load_scene, simulate
from springbeam.monolithic.event_driven import integrate as reference
from springbeam.results.records import impulse
from springbeam.results.records import joined as are_joined
from springbeam.studies.metrics import METRICS

NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)


@pytest.mark.parametrize("name", scenes.group("dense"))
def test_rows_are_themselves_and_between_them_every_column_holds(name):
    """Between rows the energy is kept as at rows; joined ends have one place and velocity; the mean force is that
    applied, but for what turns a mismatch round; ends that are apart have the integral of their step.
    """
    run = simulate(scenes.named(f"dense/{name}"))
    last = np.append(run.time[1:] != run.time[:-1], True)  # of rows at one time: after the events
    again = run.at(run.time[last])
    for column in run.columns:
        assert np.array_equal(again[column], run[column][last]), column

    rows = np.flatnonzero(run.steps["size"] > 0.0)
    steps = run.steps[rows]
    begin = run.steps[rows - 1]
    inside = [run.at(steps["time"] - 0.5 * (1.0 - x) * steps["size"]) for x in NODES]
    middles = inside[2]
    scale = np.abs(run.e_total).max()
    assert np.abs(middles.energy_residual).max() <= 2.0 * np.abs(run.energy_residual).max() + 1e-14 * scale
    contact = run.scene.contact
    together = are_joined(begin) & contact.rigid & ({"u_tip", "y"} <= run.columns.keys())
    if together.any():
        assert np.abs(middles.gap[together]).max() < 1e-12
        assert np.array_equal(middles.v_tip[together], middles.z[together])

    def mean(column):
        return 0.5 * sum(weight * there[column] for weight, there in zip(WEIGHTS, inside, strict=True))

    apart = ~(are_joined(begin) & contact.rigid)
    if "contact_force" in run.columns:
        applied = impulse(run.steps, "contact_force")[rows] / steps["size"]
        least = np.min([there.contact_force for there in inside], axis=0)
        whole = (apart | (begin["phase"] < 3.0)) & (contact.rigid | (not contact.opens) | (least > 0.0))
        off = np.abs(mean("contact_force") - applied)[whole]
        assert np.max(off, initial=0.0) <= 1e-9 * np.abs(applied).max()
    for column in {"u_tip", "y"} & run.columns.keys():
        integral = steps[f"{column}_integral"] / steps["size"]
        assert mean(column)[apart] == pytest.approx(integral[apart], rel=1e-11, abs=1e-15)
    assert np.array_equal(middles.phase == "seated", begin["phase"] >= 3.0)
    if "foundation_force" in run.columns:
        assert not any(there.foundation_force[begin["phase"] < 3.0].any() for there in inside)
    for event in run.events:  # has not happened just before
        if event.energy_loss > 1e-6 and event.time > run.time[0]:
            size = run.steps[np.searchsorted(run.time, event.time)]["size"]
            both = run.at([event.time - 1e-6 * size, event.time])
            assert np.ptp(both.e_impact_loss) == pytest.approx(event.energy_loss)
            if event.kind == "impact" and run.scene.spring is not None:
                assert np.ptp(both.e_spring - 0.5 * run.scene.spring.mass * both.z**2) < 1e-5 * scale


@pytest.mark.parametrize("name", scenes.group("extremes"))
def test_extremes_are_those_of_the_curve(name):
    """Metrics beside 200 points a step: no point is beyond, and one is near; rows alone would not do."""
    run = simulate(scenes.named(f"extremes/{name}"))
    # Between events: what `at` returns there, and just before them.
    points = [np.linspace(a, b, 201)[:-1] for a, b in pairwise(np.unique(run.time))]
    fine = run.at(np.append(np.concatenate(points), run.time[-1]))
    missed = 0.0
    for end in {"u_tip", "y", "z", "gap"} & run.columns.keys():
        for side, sign in (("max", 1.0), ("min", -1.0)):
            if (metric := METRICS.get(f"{end}_{side}")) is None:
                continue
            curve, at_rows = (sign * (np.abs(of[end]) if end == "z" else of[end]) for of in (fine, run))
            scale = np.abs(curve).max()
            assert -1e-12 * scale <= sign * metric(run) - curve.max() <= 1e-3 * scale, end
            missed = max(missed, (curve.max() - at_rows.max()) / scale)
    assert run.summary["deepest_tip"] == METRICS["u_tip_min"](run)
    assert missed > 1e-6


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
