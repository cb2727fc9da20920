"""Adaptive macro steps with the FMUs: the errors of a run follow its tolerance, and the rest of what they promise."""

from functools import cache

import numpy as np
import pytest
import scenes

from springbeam import RunStopped, load_scene, simulate, with_changes


def soft(tolerance, scheme="energy", degree=0, t_end=0.28, **tables):
    coupling = {"scheme": scheme, "degree": degree, "relative_tolerance": tolerance}
    return with_changes(load_scene("soft"), time={"t_end": t_end}, coupling=coupling, **tables)


@cache
def exact():
    """In fixed steps so short that the event-driven solver is 3e-14 m and 1e-15 s off: until the second meeting."""
    return simulate(with_changes(soft(None), coupling={"degree": 2, "macro_step": 2e-4}))


def errors(run):
    """Return the errors of y before the foundation, over the way there, and of the three event times, relative."""
    rows = np.flatnonzero((run.time > 0.0) & (run.time < 0.0712))
    rows = rows[:: len(rows) // 100 + 1]
    y = np.abs(run.y[rows] - exact().at(run.time[rows]).y).max() / 0.015
    assert [e.kind for e in run.events[:4]] == ["impact", "stop_impact", "release", "impact"]
    found, right = (np.array([event.time for event in of.events[1:4]]) for of in (run, exact()))
    return float(y), float(np.max(np.abs(found / right - 1.0)))


@pytest.mark.parametrize(
    ("scheme", "degree", "tolerances", "least", "orders"),
    [
        ("energy", 0, (1e-3, 1e-4, 1e-5), 1e-6, (1.0, 2.0)),
        ("energy", 1, (1e-3, 1e-5, 1e-7), 1e-6, (1.0, 2.0)),
        ("energy", 2, (1e-3, 1e-4, 1e-5), 1e-6, (1.0, 2.0)),
    ],
)
def test_the_error_follows_the_tolerance(scheme, degree, tolerances, least, orders):
    """y and the event times are within the tolerance, and not by orders of magnitude for nothing; y falls with it."""
    found = []
    for tolerance in tolerances:
        y, late = errors(simulate(soft(tolerance, scheme, degree)))
        assert least * tolerance < y < tolerance
        assert late < tolerance
        found.append(y)
    slope = np.log(found[0] / found[-1]) / np.log(tolerances[0] / tolerances[-1])
    assert orders[0] < slope < orders[1]


def test_a_tolerance_below_rounding_stops_by_name():
    with pytest.raises(RunStopped, match=r"above the tolerance, down to a macro step of .* where it is"):
        simulate(soft(1e-17, "energy", 2))


def test_fine_data_ends_no_steps(tmp_path):
    """A record of 1201 lines, as of a shaken base: steps are as long as the error allows, and the rows keep it."""
    times = np.linspace(0.0, 0.3, 1201)
    record = sum(np.sin(2.0 * np.pi * f * times + f) / f for f in (3.0, 7.0, 13.0, 23.0))
    np.savetxt(tmp_path / "record.csv", np.column_stack([times, record]), delimiter=",")
    load = {"on": "base", "signal": "table", "file": str(tmp_path / "record.csv"), "amplitude": 20.0}
    scene = with_changes(scenes.named("shaken"), loads=[load])
    every_line = simulate(with_changes(scene, coupling={"degree": 2, "macro_step": 2.5e-4}))
    assert every_line.summary["macro_steps"] >= 1400
    for tolerance, most in ((1e-4, 46), (1e-6, 140)):
        sizes = {"macro_step": None, "relative_tolerance": tolerance, "absolute_tolerance": 1e-2 * tolerance}
        run = simulate(with_changes(scene, coupling={"degree": 2, **sizes}))
        assert run.summary["macro_steps"] < most
        assert 0.3 in run.time  # where it ends, the load jumps
        at_rows = every_line.at(run.time)
        for name in ("u_tip", "y"):
            assert np.abs(run[name] - at_rows[name]).max() < tolerance * np.ptp(every_line[name])
