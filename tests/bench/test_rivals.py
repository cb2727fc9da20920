"""scipy, as the benchmarks and docs/accuracy.py use it, solves what the reference solves."""

import importlib
from pathlib import Path

import numpy as np
import pytest

from springbeam.monolithic import event_driven
from springbeam.results.distance import motion
from springbeam.scene import load_scene, with_changes


@pytest.fixture
def rivals(monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).parent)
    return importlib.import_module("rivals")


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
def test_scipy_solves_what_the_reference_solves(rivals, scene, changes, until):
    """The motion is right to its tolerance; what it evaluates is no more than the equations of motion."""
    beam = {} if scene == "duffing" else {"n_elements": 6, **changes.get("beam", {})}
    what = with_changes(load_scene(scene), **{**changes, "time": {"t_end": until}} | ({"beam": beam} if beam else {}))
    times = np.linspace(what.contact_time or 0.0, until, 101)
    solved = rivals.Rival(what).solve(**TIGHT, times=times)
    exact = event_driven.simulate(what, sample_times=times)
    rows = np.searchsorted(exact.time, times)
    for name, values in solved.columns.items():
        scale = np.abs(exact[name] - exact[name][0]).max()
        assert np.abs(values - exact[name][rows]).max() <= 1e-6 * scale


@pytest.mark.parametrize("method", ["LSODA", "Radau"])
def test_the_implicit_methods_get_the_jacobian(rivals, method):
    """By differences it would take as many evaluations as there are unknowns."""
    what = with_changes(load_scene("soft"), beam={"n_elements": 20}, time={"t_end": 0.02})
    times = np.linspace(0.0, 0.02, 21)
    rival = rivals.Rival(what)
    solved = rival.solve(method, 1e-5, 1e-9, times)
    assert motion(solved.columns, event_driven.simulate(what, sample_times=times).columns) < 1e-4
    (phase,) = rival._phases.values()
    X = np.random.default_rng(0).normal(size=82)
    for k in (0, 45, 80):
        step = 1e-6 * np.eye(82)[k]
        column = (phase.rhs(0.0, X + step) - phase.rhs(0.0, X - step)) / 2e-6
        assert phase.jacobian(0.0, X)[:, k] == pytest.approx(column, rel=1e-6, abs=1e-4 * np.abs(column).max())


def test_rows_have_error_and_time_of_each_tolerance_and_none_of_a_beam_without_inertia(rivals, monkeypatch):
    monkeypatch.setattr(rivals, "TOLERANCES", {"DOP853": (1e-2, 1e-6)})
    what = with_changes(load_scene("duffing"), time={"t_end": 20.0})
    times = np.linspace(0.0, 20.0, 81)
    coarse, fine = rivals.rows(what, event_driven.simulate(what, sample_times=times), times, repeats=1)
    assert fine["error_motion"] < 0.01 * coarse["error_motion"] < 1e-3
    assert fine["cost_wall_time"] > 0.0
    massless = with_changes(load_scene("soft"), beam={"fidelity": "quasi_static"})
    assert list(rivals.rows(massless, event_driven.simulate(what, sample_times=times), times)) == []
