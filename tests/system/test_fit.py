"""Measured data beside a run, and keys found by them: on data made with known keys, shifts and noise."""

import json
from itertools import count

import numpy as np
import pytest
from commands import Interrupt, command, printed, refused
from scenes import scene_from_dict
from scipy.stats import t as student

from springbeam import RunStopped, SceneError, load_scene, simulate, with_changes
from springbeam.signals.measured import read_measured, residuals
from springbeam.studies import fit

TRUE = {"spring.linear_stiffness": 800.0, "spring.damping": 1.2}
OSCILLATOR = scene_from_dict(
    {
        "time": {"t_end": 0.3},
        "spring": {"mass": 0.2, "linear_stiffness": 800.0, "damping": 1.2, "initial_velocity": 0.4},
        "coupling": {"macro_step": 5e-3},
    }
)
#: Starts away from what is right, as a user would.
GUESSES = ("spring.linear_stiffness=700", "spring.damping=2")
TIMES = np.linspace(0.01, 0.29, 75)


def exact(times=TIMES):
    """y of the oscillator in closed form."""
    decay, rate = 3.0, np.sqrt(4000.0 - 9.0)
    return 0.4 / rate * np.exp(-decay * times) * np.sin(rate * times)


def written(path, header, *columns):
    lines = [header, *(",".join(repr(float(value)) for value in row) for row in zip(*columns, strict=True))]
    path.write_text("\n".join(lines))
    return path


def fitted(path, vary=GUESSES, scene=OSCILLATOR, **options):
    found = fit.fit(scene, path, vary, **options)
    return {**found.document, "runs": found.tables["fit"]}


# -- beside a run -------------------------------------------------------------------------------------------------


def test_units_and_names_of_a_file(tmp_path):
    path = written(tmp_path / "m.csv", "t [ms],CH1 [mm],CH2 [g],y", 1e3 * TIMES, exact() * 1e3, TIMES, TIMES)
    found = read_measured(path, OSCILLATOR, {"CH1": "y", "CH2": "a_y"})
    assert found.time == pytest.approx(TIMES, rel=1e-15)
    assert found.values["a_y"] == pytest.approx(9.80665 * TIMES, rel=1e-15)
    assert list(read_measured(path, OSCILLATOR).values) == ["y"]
    twice = f"{__name__}:twice"
    assert read_measured(path, OSCILLATOR, {"y": twice}).values[twice] == pytest.approx(TIMES, rel=1e-15)
    for what, why in ((twice, "a function has no unit"), ("y + z", "y \\+ z: is unknown; allowed: time, y")):
        with pytest.raises(SceneError, match=why):
            read_measured(path, OSCILLATOR, {"CH1": what})


def twice(run):
    """A curve of the user."""
    return 2.0 * run["y"]


def test_residuals_are_those_of_each_curve(tmp_path):
    """One curve is measured half as large again, by a clock that is 0.2 s late; the other one is 0."""
    run = simulate(OSCILLATOR)
    path = written(tmp_path / "m.csv", "time,y,z", TIMES + 0.2, 1.5 * exact(), np.zeros(len(TIMES)))
    of_y, of_z = residuals(run, read_measured(path, OSCILLATOR), -0.2)
    rms, at = 0.5 * np.sqrt(np.mean(exact() ** 2)), int(np.argmax(np.abs(exact())))
    expected = (len(TIMES), rms, rms / np.std(1.5 * exact()), 0.5 * abs(exact()[at]), TIMES[at])
    assert of_y[1:] == pytest.approx(expected, rel=1e-6)
    assert of_z.relative == of_z.rms
    assert of_z.largest == pytest.approx(np.abs(run.at(TIMES)["z"]).max(), rel=1e-12)
    with pytest.raises(SceneError, match="they have no times in common"):
        residuals(run, read_measured(path, OSCILLATOR), 9.0)


BAD = {
    "time,y\n0,1": "1 lines with numbers; there must be two at least",
    "0,1\n1,2": "the first line must name the columns",
    "time,y\n0,1\n0,2": "is not after that of the line before",
    "time,y\n0,1\n1,x": "line 3, column y: 'x' is not a finite number",
    "time,y\n0,1\n1,nan": 'line 3, column y: the value is missing; missing = "drop" leaves',
    "time,y\n0,1\n1,2,3": "line 3: 3 columns; there must be as many as",
    "time,w\n0,1\n1,2": "no column is called as one of the run (time, y",
    "time,y [kg]\n0,1\n1,2": "column y: [kg] is no unit of what a run has in m",
    "time,y [wurst]\n0,1\n1,2": "[wurst] is no unit",
}


@pytest.mark.parametrize("text", BAD)
def test_a_bad_file_is_refused_with_its_line_and_column(tmp_path, text):
    path = tmp_path / "m.csv"
    path.write_text(text)
    with pytest.raises(SceneError) as error:
        read_measured(path, OSCILLATOR)
    assert BAD[text] in str(error.value)


def test_the_command_compare_takes_a_measurement(here):
    simulate(OSCILLATOR).save("run")
    written(here / "m.csv", "time [s],position [mm]", TIMES + 0.2, 1e3 * exact())
    shown = printed("compare", "run", "m.csv", "--map", "position=y")
    assert "shift" in shown
    told = json.loads(printed("compare", "run", "m.csv", "--map", "position=y", "--json", "--no-plots"))
    assert told["shift"] == pytest.approx(-0.2, abs=1e-6)
    assert told["residuals"][0]["relative"] < 1e-4
    assert json.loads(printed("compare", "run", "m.csv", "--map", "position=y", "--shift", "-0.2", "--json",
                              "--no-plots"))["residuals"][0]["relative"] < 1e-8  # fmt: skip
    assert (here / "results" / "comparison.png").stat().st_size > 10_000
    assert "m.csv: --map CH1: there are the columns position" in refused("compare", "run", "m.csv", "--map", "CH1=y")


# -- keys found ---------------------------------------------------------------------------------------------------


def test_a_contact_is_found_by_the_acceleration_of_the_tip_through_impacts(tmp_path):
    scene = load_scene("vibro-impact", ["time.t_end=0.06", "beam.n_elements=6", "beam.n_modes=3"])
    run = simulate(scene)
    times = np.linspace(1e-3, 0.059, 150)
    found = run.at(times)
    path = written(tmp_path / "m.csv", "time,u_tip,acc [g]", times, found["u_tip"], found["a_tip"] / 9.80665)
    guess = 1.2 * scene.contact.stiffness
    names = ("u_tip=u_tip", "acc=a_tip")
    (key,) = fitted(path, [f"contact.stiffness={guess!r}"], scene, names=names, shift=0.0)["keys"]
    assert key["value"] == pytest.approx(scene.contact.stiffness, rel=1e-6)


@pytest.mark.parametrize("late", [3.7e-3, 13.0])
def test_keys_and_a_clock_that_is_off_are_found_to_1e_6_without_noise(tmp_path, late):
    path = written(tmp_path / "m.csv", "time,y", TIMES + late, exact())
    found = fitted(path)
    assert found["undetermined"] == []
    for row in found["keys"]:
        assert row["value"] == pytest.approx({**TRUE, "shift": -late}[row["key"]], rel=1e-6, abs=1e-6)
        assert row["low"] <= row["value"] <= row["high"]
    assert len(found["runs"]) > 10


def test_a_clock_that_the_data_does_not_tell_is_held(tmp_path):
    """A free oscillator that begins later begins from another place with another speed: three keys for two numbers."""
    scene = with_changes(OSCILLATOR, spring={"equilibrium": 5e-3})
    path = written(tmp_path / "m.csv", "time,y", TIMES, simulate(scene).at(TIMES)["y"])
    found = fitted(path, ["spring.equilibrium=4e-3", "spring.initial_velocity=0.3"], scene)
    assert found["undetermined"] == []
    place, speed = found["keys"]
    assert place["value"] == pytest.approx(5e-3, rel=1e-6)
    assert speed["value"] == pytest.approx(0.4, rel=1e-6)


def test_a_trial_that_cannot_be_run_turns_the_search_back(tmp_path, monkeypatch):
    """The sixth run: after that of the guesses, and five for the first derivatives."""
    right, runs = fit.simulate, count()

    def stops_once(scene):
        if next(runs) == 6:
            raise RunStopped("diverges", 0.1)
        return right(scene)

    monkeypatch.setattr(fit, "simulate", stops_once)
    found = fitted(written(tmp_path / "m.csv", "time,y", TIMES, exact()), shift=0.0)
    (error,) = [row["error"] for row in found["runs"] if row["error"]]
    assert "diverges" in error
    assert {row["key"]: row["value"] for row in found["keys"]} == pytest.approx(TRUE, rel=1e-6)


def test_curves_weigh_by_what_is_left_of_them(tmp_path):
    """A second curve of noise alone hardly moves what the first one tells; weighed by its spread, by 1 %."""
    noise = np.random.default_rng(1).normal(0.0, 0.5, len(TIMES))
    path = written(tmp_path / "m.csv", "time,y,z", TIMES, exact(), noise)
    (stiffness,) = fitted(path, ["spring.linear_stiffness=790"], shift=0.0)["keys"]
    assert stiffness["value"] == pytest.approx(800.0, rel=1e-3)


def test_intervals_are_those_of_linear_least_squares(tmp_path):
    """y is linear in where the oscillator begins and how fast; an interval of a logarithm is as wide over the key."""
    rate, scene = np.sqrt(4000.0 - 9.0), with_changes(OSCILLATOR, spring={"equilibrium": 5e-3})
    sines, cosines = (np.exp(-3.0 * TIMES) * wave(rate * TIMES) for wave in (np.sin, np.cos))
    of_keys = np.transpose([cosines + 3.0 / rate * sines, sines / rate])
    data = of_keys @ [5e-3, 0.4] + 2e-4 * np.random.default_rng(0).normal(size=len(TIMES))
    values, (left,), *_ = np.linalg.lstsq(of_keys, data)
    freedom = len(TIMES) - 2
    deviations = np.sqrt(left / freedom * np.diag(np.linalg.inv(of_keys.T @ of_keys)))
    half = student.ppf(0.975, freedom) * deviations / values
    path = written(tmp_path / "m.csv", "time,y", TIMES, data)
    keys = fitted(path, ["spring.equilibrium=4e-3", "spring.initial_velocity=0.3"], scene, shift=0.0)["keys"]
    found = [[row[name] for row in keys] for name in ("low", "value", "high")]
    assert found == pytest.approx(values * np.exp(np.outer([-1.0, 0.0, 1.0], half)), rel=1e-4)


@pytest.mark.parametrize(
    ("vary", "why"),
    [
        (["spring.linear_stiffness=700", "spring.mass=0.19", "spring.damping=1.1"], "in the same way: fix one of them"),
        (["spring.damping=1.2", "spring.cubic_stiffness=1e-9"], "does not change the curves"),
    ],
)
def test_keys_that_the_data_does_not_determine_are_named(tmp_path, vary, why):
    """With an initial velocity as given, y depends on k/m and c/m alone."""
    path = written(tmp_path / "m.csv", "time,y", TIMES, exact())
    assert any(why in words for words in fitted(path, vary, shift=0.0)["undetermined"])


@pytest.mark.filterwarnings("error::RuntimeWarning")  # of means of nothing, where the clock has left the run
def test_the_command_ends_with_1_where_the_data_does_not_tell(here):
    written(here / "m.csv", "time,y", TIMES, exact())
    line = ["fit", "duffing", "m.csv", "--set", "time.t_end=0.6", "--vary"]
    told = command(*line, "spring.cubic_stiffness=-1e-12", "--out", "f")
    assert told.exit_code == 1
    assert isinstance(told.exception, SystemExit)
    assert "not determined: spring.cubic_stiffness does not change the curves" in " ".join(told.stdout.split())
    for vary, why in {
        "spring.mass": "TABLE.KEY=VALUES",
        "mass=1": "TABLE.KEY=VALUES",
        "spring.mass=1:2:3": "a guess is one value",
        "spring.mass=0": "0 has none",
        "beam.n_elements=4": "takes no real numbers",
    }.items():
        assert why in refused(*line, vary)
    assert "must be a finite number greater than 0" in refused(*line, "spring.mass=-1")
    written(here / "few.csv", "time,y", TIMES[:2], exact()[:2])
    few = command("fit", "duffing", "few.csv", "--vary", "spring.mass=1", "--out", "few")
    assert few.exit_code == 2
    assert "fewer of its points lie in the run" in few.stderr
    away = command(*line, "spring.mass=1", "--shift", "9", "--out", "few")
    assert away.exit_code == 2
    assert "fewer of its points lie in the run than are needed to find spring.mass; make" in away.stderr


def test_an_interrupted_fit_keeps_its_runs(here, monkeypatch):
    """A search of minutes had left nothing."""
    written(here / "m.csv", "time,y", TIMES, simulate(load_scene("duffing")).at(TIMES)["y"])
    interrupt, right = Interrupt(6), fit.simulate
    monkeypatch.setattr(fit, "simulate", lambda scene: interrupt() or right(scene))
    line = ["fit", "duffing", "m.csv", "--vary", "spring.linear_stiffness=3.2", "--set", "time.t_end=0.6"]
    cut = command(*line, "--shift", "0", "--out", "f")
    assert cut.exit_code == 3
    assert "error: interrupted after 4 runs" in cut.stderr  # of five calls the first is the run with the guesses
    assert (here / "f" / "fit.csv").read_text().count("\n") == 5


def test_results_of_a_fit_are_not_overwritten_unasked(here):
    written(here / "m.csv", "time,y", TIMES, simulate(load_scene("duffing")).at(TIMES)["y"])
    line = ["fit", "duffing", "m.csv", "--vary", "spring.linear_stiffness=3.2", "--set", "time.t_end=0.6"]
    first = json.loads(printed(*line, "--out", "f", "--json"))
    assert first["keys"][0]["value"] == pytest.approx(3.0, rel=1e-6)
    assert "f: is not empty" in refused(*line, "--out", "f")
    assert json.loads(printed(*line, "--out", "f", "--force", "--json"))["keys"] == first["keys"]
    assert (here / "f" / "fit.csv").read_text().count("\n") > 5
