"""Loads: their values, their projections, and runs under them beside the reference, with bodies exact to rounding."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from references import integrated_anew
from scenes import load_of, table

from springbeam import simulate
from springbeam.bodies import force
from springbeam.run.loads import Signal
from springbeam.scene import load_scene, with_changes

RECORD = np.column_stack([np.linspace(0.0, 0.05, 26), 3.0 * np.sin(200.0 * np.linspace(0.0, 0.05, 26))])
SIGNALS = table("master/cases.toml")["signals"]
NODES, WEIGHTS = np.polynomial.legendre.leggauss(20)


@pytest.fixture(autouse=True)
def _record(tmp_path, monkeypatch):
    np.savetxt(tmp_path / "record.csv", RECORD, delimiter=",", header="time, force")
    monkeypatch.chdir(tmp_path)


def soft(*loads, t_end=0.07, **coupling):
    """The soft scene with 6 elements; `_tied` until 0.07 s."""
    return with_changes(
        load_scene("soft"),
        beam={"n_elements": 6},
        time={"t_end": t_end},
        coupling=coupling,
        loads=[SIGNALS[name] for name in loads],
    )


@pytest.mark.parametrize("name", SIGNALS)
@pytest.mark.parametrize(("start", "size"), [(0.013, 1e-3), (0.0, 0.06), (0.0499, 4e-3)])
def test_the_projection_is_that_of_the_signal(name, start, size):
    """The moments against 1, s, s² are those of the signal, by quadrature between all points where it is not smooth."""
    load = load_of(**SIGNALS[name])
    f = Signal(load).over(start, size)
    edges = np.unique(
        np.clip([*RECORD[:, 0] + load.since, *Signal(load).kinks, start, start + size], start, start + size)
    )
    for power in range(3):
        exact = 0.0
        for a, b in pairwise(edges):
            t = a + 0.5 * (b - a) * (NODES + 1.0)
            exact += 0.5 * (b - a) * WEIGHTS @ (load.value(t) * ((t - start) / size) ** power)
        tau = 0.5 * size * (NODES + 1.0)
        mine = 0.5 * size * WEIGHTS @ (np.array([force.value(f, x) for x in tau]) * (tau / size) ** power)
        assert mine == pytest.approx(exact, abs=2e-14 * size * abs(load.amplitude) * 3.0)


def test_pulses_have_the_shapes_and_the_velocity_changes_of_their_names():
    """Peak, where it is, and ∫ a dt: 2/π, 1/2 and 1 − rise/duration of peak times duration."""
    common = {"on": "base", "amplitude": 100.0, "start": 0.002, "duration": 0.01}
    times = 0.002 + np.linspace(0.0, 0.01, 100_001)[:-1]
    for signal, more, peak, share in (
        ("half_sine", {}, 0.007, 2.0 / np.pi),
        ("sawtooth", {}, 0.012, 0.5),
        ("trapezoid", {"rise": 0.001}, None, 0.9),
        ("trapezoid", {"rise": 0.005}, 0.007, 0.5),
    ):
        load = load_of(signal=signal, **more, **common)
        values = load.value(times)
        assert values.max() == pytest.approx(100.0, rel=1e-4)
        assert peak is None or times[values.argmax()] == pytest.approx(peak, abs=2e-7)
        assert 1e-7 * values.sum() == pytest.approx(100.0 * 0.01 * share, rel=1e-4)
        assert load.value([0.001999, 0.0120001]) == pytest.approx([0.0, 0.0])


def test_a_chirp_turns_from_one_frequency_to_the_other():
    load = load_of(**SIGNALS["chirp"])
    turns = np.array([0.25, 0.5, 0.75, 1.0, 1.5])
    # 70 τ − (70 − 20)/(2 · 0.04) τ² turns have been made after τ.
    tau = (70.0 - np.sqrt(70.0**2 - 4.0 * 625.0 * turns)) / 1250.0
    assert load.value(0.01 + tau) == pytest.approx([1.0, 0.0, -1.0, 0.0, 0.0], abs=1e-12)
    assert load.value([0.0099, 0.0501]) == pytest.approx([0.0, 0.0])


def test_steps_end_where_a_load_jumps_or_bends_and_none_is_a_sliver():
    """Kinks that differ by rounding give one row, all others theirs to the last bit; no step is shorter than H/4."""
    scene = with_changes(soft("step", "linear", "burst", t_end=0.06, macro_step=1e-3), stop=None)
    scene = with_changes(scene, beam={"approach": "elastic"}, spring={"equilibrium": -1.0})
    run = simulate(scene)
    kinks = [kink for load in scene.loads for kink in Signal(load).kinks if kink < 0.06]
    assert len(kinks) == 30
    assert all(np.abs(run.time - kink).min() <= 4e-18 for kink in kinks)
    assert not run.events
    early = with_changes(scene, time={"t_end": kinks[-1] - 1e-4})  # a kink soon after the end does not put it off
    assert simulate(early).time[-1] == early.time.t_end
    gaps = np.diff(sorted(kinks))
    assert np.diff(run.time).min() >= min(gaps[gaps > 1e-12].min(), 0.25e-3)


def test_the_reference_integrates_loads_as_scipy_does(monkeypatch):
    run = integrated_anew(soft(*SIGNALS, t_end=0.06), monkeypatch, 0.06)
    assert np.abs(run.energy_residual).max() < 1e-11 * run.e_beam.max()


def test_a_table_ends_with_its_last_line_and_a_ramp_stays():
    Path("record.csv").write_text("time [ms],acceleration [g]\n0,1\n10,-2\n")
    table = load_of(on="base", signal="table", file="record.csv")
    assert table.value([-1e-9, 0.0, 0.01, 0.010001]) == pytest.approx([0.0, 9.80665, -2.0 * 9.80665, 0.0])
    assert table.peak == pytest.approx(2.0 * 9.80665)
    ramp = load_of(on="tip", signal="ramp", duration=0.01, amplitude=3.0)
    assert ramp.value([-1e-9, 0.005, 0.01, 7.0]) == pytest.approx([0.0, 1.5, 3.0, 3.0])
