"""FMUs that fail in every phase: the run goes on as designed or stops by name, and nothing computed is lost."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from commands import HANGS, command, written
from faulty import Fault, installed
from scenes import table

from springbeam.results.files import load_trajectory

PATH = Path(__file__).with_name("faults.toml")
SCENE = table("system/faults.toml")
TABLE = table("system/faults_of_fmus.toml")
LAWS = TABLE["laws"]


@pytest.fixture
def run(tmp_path, monkeypatch):
    def started(law, *faults, name="faulty"):
        scene = SCENE | {table: {**SCENE[table], **change} for table, change in LAWS[law]["change"].items()}
        (tmp_path / "scene.toml").write_text(tomli_w.dumps(scene))
        with monkeypatch.context() as patch:
            script = installed(patch, *faults)
            result = command("run", tmp_path / "scene.toml", "--out", tmp_path / name, "--no-plots", "-q")
        print(result.exit_code, result.output)  # what pytest shows of a run in which the fault did not happen
        assert "Traceback" not in result.output
        assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
        return result.exit_code, tmp_path / name, script

    return started


FMUS = ("beam", "spring")
_WHOLE = {}


def whole(run, law):
    """The files of a run without a fault."""
    if law not in _WHOLE:
        code, directory, script = run(law, name="whole")
        assert code == 0
        script.check()
        trajectory = load_trajectory(directory)
        assert {where for where in LAWS[law]["places"] if where != "location"} <= set(trajectory.phase)
        _WHOLE[law] = written(directory)
    return _WHOLE[law]


def check_stopped(code, directory, expected, cause):
    """Exit code 3; the summary says why and when; the rows are the first ones of the run without a fault."""
    assert code == 3
    summary = json.loads((directory / "summary.json").read_text())
    assert summary["status"] == "stopped"
    assert cause in summary["cause"]
    assert summary["residual"] is None or np.isfinite(summary["residual"])
    for name, content in written(directory).items():
        assert expected[name].startswith(content), name
    assert summary["time"] >= max(load_trajectory(directory).time, default=0.0)
    assert np.isfinite(summary["max_energy_residual"])


EVERYWHERE = [(law, where) for law, about in LAWS.items() for where in about["places"]]


@pytest.mark.parametrize(("fmu", "law", "where", "function", "kind", "cause"), TABLE["faults"]["lasting"])
def test_a_lasting_fault_stops_the_run(run, fmu, law, where, function, kind, cause):
    expected = whole(run, law)
    fault = Fault(fmu, function, where, kind)
    code, directory, script = run(law, fault)
    assert fault.happened
    script.check()
    check_stopped(code, directory, expected, cause)


@pytest.mark.parametrize("function", ["fmi2DoStep", "fmi2GetReal"])
def test_a_warning_is_no_fault(run, function):
    warning = Fault("spring", function, "tied", "Warning")
    code, directory, _ = run("energy 2", warning)
    assert (code, written(directory), warning.happened > 0) == (0, whole(run, "energy 2"), True)


PASSING = [("fmi2DoStep", "Discard"), ("fmi2GetReal", "nan")]


@pytest.mark.parametrize(
    ("fmu", "place", "fault"),
    # One FMU or the other in turn, and one fault or the other in every second place.
    [(FMUS[k % 2], place, PASSING[k // 2 % 2]) for k, place in enumerate(EVERYWHERE)],
)
def test_a_fault_that_passes_is_stepped_over(run, fmu, place, fault):
    (law, where), (function, kind) = place, fault
    fault = Fault(fmu, function, where, kind, once=True)
    code, directory, script = run(law, fault)
    assert fault.happened == 1
    script.check()
    assert code == 0
    trajectory = load_trajectory(directory)
    undisturbed = whole(run, law)
    assert trajectory.summary["halved_steps"] == 1
    assert trajectory.time[-1] == SCENE["time"]["t_end"]
    last = [float(cell) for cell in undisturbed["trajectory.csv"].split()[-1].split(b",")[1:4:2]]
    assert [trajectory.u_tip[-1], trajectory.y[-1]] == pytest.approx(last, abs=LAWS[law]["halved"])
    if law != "jacobi":
        assert trajectory.summary["max_energy_residual"] < 1e-10


@pytest.mark.parametrize(
    ("fmu", "law", "kind"),
    [("beam", "energy", "Discard"), ("spring", "energy 2", "raise"), ("beam", "compliance", "Fatal")],
)
def test_a_rollback_that_fails_stops_the_run(run, fmu, law, kind):
    expected = whole(run, law)
    discard = Fault(fmu, "fmi2DoStep", "touch", "Discard", once=True)
    code, directory, script = run(law, discard, Fault(fmu, "fmi2SetFMUstate", "rollback", kind, skip=0))
    script.check()
    check_stopped(code, directory, expected, "nobody expected" if kind == "raise" else "cannot restore the state")


@pytest.mark.parametrize(("fmu", "law"), [("beam", "energy"), ("spring", "energy 2"), ("beam", "compliance")])
def test_wild_numbers_stop_the_run(run, fmu, law):
    """1e300 m is a finite number: it is recorded, as it came, and ends the run by its energy or by its events."""
    code, directory, script = run(law, Fault(fmu, "fmi2GetReal", "touch", "1e300", skip=2))
    script.check()
    assert code == 3
    trajectory = load_trajectory(directory)
    assert trajectory.summary["status"] == "stopped"
    assert any(cause in trajectory.summary["cause"] for cause in ("has changed the energy", "the contact chatters"))


@pytest.mark.parametrize(
    ("fmu", "function", "kind"),
    [
        ("beam", "fmi2SetupExperiment", "Discard"),
        ("spring", "fmi2SetupExperiment", "Fatal"),
        ("beam", "fmi2GetReal", "Error"),
        ("spring", "fmi2GetReal", "nan"),
    ],
)
def test_an_fmu_that_does_not_start_is_refused(run, fmu, function, kind):
    code, directory, script = run("energy", Fault(fmu, function, "start", kind, skip=0))
    script.check()
    assert code == 2
    assert not directory.exists()


def test_after_fmi2_fatal_the_next_run_is_as_ever(run):
    expected = whole(run, "energy")
    code, *_ = run("energy", Fault("spring", "fmi2DoStep", "tied", "Fatal"))
    assert code == 3
    code, directory, script = run("energy", name="next")
    assert code == 0
    script.check()
    assert written(directory) == expected


# -- an FMU call that never returns: Ctrl-C ends the command all the same -------------------------------------------

#: The command with a shorter wait, and the FMU, the function and the place that are its first arguments.
HANGING = """
import sys
import pytest
from faulty import Fault, installed
from springbeam import cli

fmu, function, where, skip, *arguments = sys.argv[1:]
cli.common.PATIENCE = 0.5
installed(pytest.MonkeyPatch(), Fault(fmu, function, where, "hang", skip=int(skip)))
sys.argv = ["springbeam", *arguments]
cli.main()
"""


@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
@pytest.mark.parametrize(
    ("number", "fmu", "where"),
    [(signal.SIGINT, "spring", "tied"), (signal.SIGTERM, "beam", "location")],
    ids=["tied", "location"],
)
def test_a_call_that_never_returns_can_be_interrupted(tmp_path, number, fmu, where):
    directory = tmp_path / "run"
    run = ("run", PATH, "--no-plots", "-q", "--out")
    process = subprocess.Popen(
        [sys.executable, "-c", HANGING, fmu, "fmi2DoStep", where, "3", *map(str, run), directory],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path])},
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == "hanging\n"
        with pytest.raises(subprocess.TimeoutExpired):  # it does hang
            process.wait(0.2)
        process.send_signal(number)
        output, errors = process.communicate(timeout=HANGS)
    finally:
        process.kill()
    assert (process.returncode, output) == (3, "")
    assert errors == "error: interrupted: a call into an FMU has not returned within 0.5 s\n"
