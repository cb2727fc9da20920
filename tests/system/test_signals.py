"""Numbers and spectra of runs: beside closed forms of linear oscillators, and by the command."""

import json
from math import pi, sqrt

import numpy as np
import pytest
from commands import printed
from scenes import scene_from_dict

from springbeam import load_scene, simulate, with_changes
from springbeam.scene import as_scene
from springbeam.signals.driven import responses, settled
from springbeam.signals.shock import base_velocity, shock_spectrum
from springbeam.signals.spectra import power_spectrum, spectra
from springbeam.studies.metrics import METRICS
from springbeam.studies.spectrum import Shocks, spectrum
from springbeam.studies.sweep import Sweep

MASS = 0.2
STIFFNESS = 800.0
DAMPING = 1.2
FORCE = 3.0
DRIVE = 7.0
START = 0.05


def oscillator(t_end=8.0, **load):
    """A linear oscillator, driven at 7 Hz, that swings at 10.07 Hz by itself."""
    return scene_from_dict(
        {
            "time": {"t_end": t_end},
            "spring": {"mass": MASS, "linear_stiffness": STIFFNESS, "damping": DAMPING, "initial_velocity": 0.4},
            "coupling": {"macro_step": 2e-3},
            "loads": [{"on": "spring", "amplitude": FORCE, "signal": "harmonic", "frequency": DRIVE} | load],
        }
    )


@pytest.fixture(scope="module")
def driven():
    return simulate(with_changes(oscillator(start=START), spring={"initial_velocity": 4.0}))


def test_the_settled_amplitude_is_that_of_the_frequency_response(driven):
    rate = 2.0 * pi * DRIVE
    exact = FORCE / sqrt((STIFFNESS - MASS * rate**2) ** 2 + (DAMPING * rate) ** 2)
    found = settled(driven)
    assert found.multiple == 1
    assert found.period == pytest.approx(1.0 / DRIVE, rel=1e-12)
    # The transient e^{−DAMPING t/2 MASS} has fallen to 1 % of the range of the motion; whole periods of the drive.
    assert 2.0 < found.since < 2.5
    assert (found.since - START) * DRIVE == pytest.approx(round((found.since - START) * DRIVE), abs=1e-9)
    assert METRICS["settled_y"](driven) == pytest.approx(exact, rel=1e-3)
    assert METRICS["settled_a_y"](driven) == pytest.approx(exact * rate**2, rel=1e-3)
    assert METRICS["max_y"](driven) > 1.05 * exact
    # Of the curve: in five rows a period it was 5 % lower.
    coarse = simulate(with_changes(driven.scene, coupling={"macro_step": 0.2 / DRIVE}))
    assert METRICS["settled_y"](coarse) == pytest.approx(exact, rel=2e-3)


def test_an_oscillator_driven_at_its_resonance_without_damping_never_settles():
    """Its amplitude grows linearly, F t/2mω."""
    t_end = 100.0
    rate = sqrt(STIFFNESS / MASS)
    scene = with_changes(oscillator(t_end, frequency=rate / (2.0 * pi)), spring={"damping": 0.0})
    run = simulate(with_changes(scene, coupling={"macro_step": 0.02}))
    assert np.abs(run.y[-100:]).max() == pytest.approx(FORCE * t_end / (2.0 * MASS * rate), rel=0.02)
    assert settled(run) is None


@pytest.mark.parametrize(("multiple", "amplitude"), [(1, 1.3), (2, 2.25)])
def test_a_motion_whose_impacts_fall_on_the_strobe_has_its_period(multiple, amplitude):
    """A ball on a shaking table, e = 1/2; points equal to 1e-13 had the velocity before or after an impact.

    It flies for n periods T, so leaves with g n T/2 as it returns, and the table's velocity is then a third of that:
    with an acceleration of ``amplitude`` g the phase φ of the drive has cos φ = n π/(3 amplitude). Stable (P. J.
    Holmes, J. Sound Vib. 84, 1982) for amplitudes from n π/3 to the root of (n π/3)² + 1.235.
    """
    gravity = 9.81
    scene = as_scene(
        {
            "time": {"t_end": 60.0 * multiple},
            "spring": {"element": "point_mass", "mass": 1.0, "velocity": gravity * multiple / 3.0},
            "stop": {"position": 0.0, "restitution": 0.5},
            "loads": [
                {
                    "on": "base",
                    "signal": "harmonic",
                    "amplitude": -gravity * amplitude,
                    "frequency": 1.0,
                    "phase": float(np.arccos(multiple * pi / 3.0 / amplitude)),
                },
                {"on": "base", "amplitude": gravity},
            ],
            "coupling": {"macro_step": 0.05},
        }
    )
    found = settled(simulate(scene))
    assert found is not None
    assert found.multiple == multiple


@pytest.mark.parametrize("duration", [5e-4, 1e-6])
def test_a_base_is_integrated_however_short_its_pulse_is(duration):
    """The change of its velocity, 2 A D/π, counts at every time after it; sampled, a pulse was seen or missed."""
    load = {"on": "base", "signal": "half_sine", "start": 0.0101, "duration": duration, "frequency": None}
    scene = oscillator(t_end=1.0, amplitude=1.0 / duration, **load)
    found = base_velocity(scene, np.linspace(0.0, 1.0, 200))
    assert found[:3] == pytest.approx([0.0] * 3, abs=0.0)
    assert found[3:] == pytest.approx([2.0 / pi] * 197, rel=1e-12)


# -- metrics ------------------------------------------------------------------------------------------------------


def test_what_is_not_driven_or_too_short_has_not_settled():
    assert settled(simulate(oscillator(t_end=0.9))) is None
    assert METRICS["settled_y"](simulate(load_scene("duffing", ["time.t_end=1"]))) is None


def test_contacts_are_counted_and_bouncing_ends_with_the_last_closing():
    """A tip on a soft stop under a load that holds it there: told by the sign of the gap on the dense curve."""
    scene = load_scene(
        "vibro-impact", ["time.t_end=0.3", "beam.alpha_b=2e-3", "loads.0.amplitude=8", "loads.0.frequency=0.5"]
    )
    run = simulate(with_changes(scene, **{"loads.0": {"signal": "constant", "frequency": None}}))
    times = np.linspace(run.time[0], run.time[-1], 100_001)
    touching = run.at(times)["gap"] < 0.0
    closings = times[1:][touching[1:] & ~touching[:-1]]
    assert touching[-1]
    assert run.summary["number_of_contacts"] == len(closings)
    assert len(closings) > 2
    assert run.summary["bounce_time"] == pytest.approx(closings[-1] - closings[0], abs=2e-5)
    assert run.summary["last_impact_time"] == pytest.approx(closings[-1], abs=2e-5)


# Functions of the user.


def twice(run):
    return 2.0 * run.y


@pytest.fixture
def importable(monkeypatch):
    monkeypatch.syspath_prepend(__file__.rpartition("/")[0])


def pulsed(**more):
    """The oscillator without damping, on a base that a pulse accelerates."""
    pulse = {"on": "base", "amplitude": 100.0, "duration": 0.01, "frequency": None, **more}
    return with_changes(oscillator(t_end=0.3, **pulse), spring={"damping": 0.0, "initial_velocity": 0.0})


def highest_in_space(run):
    return np.abs(run["a_y"] + run["load_0"]).max()


@pytest.mark.parametrize(("signal", "more"), [("half_sine", {}), ("trapezoid", {"rise": 1e-3})])
def test_a_sweep_over_pulses_gives_the_shock_spectrum_of_each(signal, more, importable):
    """The largest acceleration is that of the spectrum; of a short pulse, ω times its change of velocity."""
    durations = (0.004, 0.03, 0.1)
    vary = ("loads.0.amplitude=50,2000", f"loads.0.duration={','.join(map(str, durations))}")
    study = Sweep(scene=pulsed(signal=signal, **more), vary=vary, metric=("a=test_signals:highest_in_space",))
    rate = sqrt(STIFFNESS / MASS)
    for row in study.rows(study.computed()):
        peak = row["loads.0.amplitude"]
        pulse = {"duration": row["loads.0.duration"], "amplitude": peak}
        load = study.scene.loads[0].model_copy(update=pulse)
        step = pulse["duration"] / 4000.0
        base = np.concatenate([[0.0], step * np.cumsum(load.value((np.arange(8000) + 0.5) * step))])
        assert row["a"] == pytest.approx(shock_spectrum(base, step, rate / (2.0 * pi), 1e9).maximax[0], rel=3e-3)
        if pulse["duration"] == durations[0]:
            assert row["a"] == pytest.approx(rate * base[-1], rel=0.01)


# -- spectra ------------------------------------------------------------------------------------------------------


def test_the_power_of_a_settled_oscillator_is_at_its_drive(driven):
    tail = settled(driven)
    begin = driven.time[-1] - 35.0 / DRIVE  # whole periods: the line lies on one of the spectrum
    found = power_spectrum(driven, "y", since=begin)
    line = int(np.argmin(np.abs(found.frequency - DRIVE)))
    assert found.highest == pytest.approx(DRIVE, abs=found.frequency[1])
    assert found.amplitude[line] == pytest.approx(METRICS["settled_y"](driven), rel=2e-3)
    # Parseval, with the window's share of what is not constant in time.
    late = driven.at(np.linspace(begin, driven.time[-1], 5000))["y"]
    assert found.density.sum() * found.frequency[1] == pytest.approx(np.var(late), rel=0.02)
    assert tail.since < begin


def test_a_rigid_impact_has_no_peak_acceleration_and_a_soft_one_has():
    run = simulate(load_scene("soft", ["time.t_end=0.1"]))
    rigid = spectra(run)
    assert rigid.jumps["tip"] > 0.1
    assert any("there is no peak acceleration" in words for _, words in rigid.in_words())
    soft = spectra(simulate(load_scene("pulse", ["time.t_end=0.02"])))
    assert soft.jumps == {"tip": 0.0, "spring": 0.0}
    assert not any("no peak acceleration" in words for _, words in soft.in_words())


def swept(first, last, seconds, size):
    """The oscillator under a chirp up and one down, which goes on in phase."""
    common = {"on": "spring", "amplitude": 0.3, "signal": "chirp", "duration": seconds}
    turned = np.pi * (first + last) * seconds  # by the first
    loads = [
        {**common, "frequency": first, "frequency_end": last},
        {**common, "frequency": last, "frequency_end": first, "start": seconds, "phase": float(turned % (2.0 * pi))},
    ]
    changes = {"spring": {"initial_velocity": 0.0}, "coupling": {"macro_step": size}}
    return simulate(with_changes(oscillator(t_end=2.0 * seconds), loads=loads, **changes))


def test_a_slow_sweep_of_a_linear_oscillator_is_its_frequency_response():
    run = swept(6.0, 8.5, 25.0, 5e-3)
    for found in responses(run, "y"):
        assert len(found.frequency) == 90  # pairs of its 181.25 turns
        rate = 2.0 * pi * found.frequency
        exact = 0.3 / np.sqrt((STIFFNESS - MASS * rate**2) ** 2 + (DAMPING * rate) ** 2)
        late = slice(20, None)  # the second begins as the first has ended; the first from rest
        assert found.amplitude[late] == pytest.approx(exact[late], rel=0.02)
    assert responses(run, "y")[1].frequency[0] > responses(run, "y")[1].frequency[-1]


# -- records ------------------------------------------------------------------------------------------------------


def write_record(path, step=1e-4):
    """A pulse of 50 g in 11 ms in g, and a channel of 100 mV/g that sees twice as much, in mV."""
    times = step * np.arange(400)
    pulse = np.where((times > 0.01) & (times < 0.021), 50.0 * np.sin(pi * (times - 0.01) / 0.011), 0.0)
    np.savetxt(path, np.column_stack([1e3 * times, pulse, 200.0 * pulse]), header="time [ms] table [g] dut [mV]")
    return path


def test_the_shock_spectrum_of_a_record_is_in_its_unit_and_over_that_of_the_input(tmp_path):
    """The spectrum of a half sine at Q = 10 has its maximum, 1.65 times the peak, at 0.82 over its length."""
    path = write_record(tmp_path / "record.dat")
    line = ["spectrum", str(path), "--of", "table", "--of", "dut", "--scale", "dut=10 g/V", "--over", "table", "--json"]
    found = json.loads(printed(*line, "--no-plots"))
    assert found["unit"] == "g"
    table = found["shock"]["table"]
    assert max(table["maximax"]) == pytest.approx(1.65 * 50.0, rel=2e-3)
    assert table["frequency"][int(np.argmax(table["maximax"]))] * 0.011 == pytest.approx(0.82, abs=0.03)
    assert found["shock"]["dut"]["maximax"] == pytest.approx(2.0 * np.array(table["maximax"]), rel=1e-12)
    in_si = json.loads(printed(*line, "--no-plots", "--unit", "m/s²", "--out", str(tmp_path / "si")))
    assert in_si["shock"]["table"]["maximax"] == pytest.approx(9.80665 * np.array(table["maximax"]), rel=1e-12)


def test_a_record_is_judged_by_the_spectrum_that_is_required_and_says_where_it_is_uncertain(tmp_path):
    path = write_record(tmp_path / "record.dat")
    required = tmp_path / "required.csv"
    required.write_text("frequency [Hz],level [g]\n70,82.5\n80,82.5\n")
    line = ["spectrum", str(path), "--of", "table", "--required", str(required), "--low", "10", "--high", "1100"]
    words = " ".join(printed(*line, "--tolerance=-0.5:0.5").split())
    assert "table: within -0.5 to +0.5 dB of --required at 100%" in words
    assert "uncertain from 1000 Hz on" in words
    assert "at 0%" in " ".join(printed(*line, "--tolerance", "1:6").split())


def test_the_shock_of_a_run_is_shown_over_that_of_its_base(tmp_path):
    """A mount much stiffer than the pulse is short moves with its base: the ratio is 1."""
    stiff = {"mass": 1e-3, "linear_stiffness": 1e-3 * (2.0 * pi * 8000.0) ** 2, "damping": 2.0, "initial_velocity": 0.0}
    pulse = {"on": "base", "signal": "half_sine", "frequency": None, "amplitude": 500.0, "duration": 0.011}
    run = simulate(with_changes(oscillator(t_end=0.03, **pulse), spring=stiff, coupling={"macro_step": 2e-5}))
    found = spectrum(run, ["y"], 40.0, 300.0, 10.0, None, 1, "", Shocks("g", "base"))
    assert [row["over_base"] for row in found.tables["shock-spring"]] == pytest.approx([1.0] * 36, rel=5e-3)
