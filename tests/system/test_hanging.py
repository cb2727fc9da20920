"""An FMU call that never returns: Ctrl-C ends the command all the same, by name, and nothing computed is lost."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from commands import HANGS, printed, written
from test_faults import PATH, SCENE

from springbeam.results.reading import load_trajectory

pytestmark = [
    pytest.mark.skipif(os.name == "nt", reason="POSIX signals"),
    pytest.mark.usefixtures("fmu_folder"),
]

#: The command with a shorter wait, and the FMU, the function and the place that are its first arguments.
HANGING = """
import sys
import pytest
from faulty import Fault, installed
from springbeam import cli
from springbeam.cli import watchdog

fmu, function, where, skip, *arguments = sys.argv[1:]
watchdog.PATIENCE = 0.5
installed(pytest.MonkeyPatch(), Fault(fmu, function, where, "hang", skip=int(skip)))
sys.argv = ["springbeam", *arguments]
cli.main()
"""


def interrupted(number, fmu, function, where, skip, *arguments):
    """What the command says when it is sent a signal while the FMU hangs."""
    process = subprocess.Popen(
        [sys.executable, "-c", HANGING, fmu, function, where, str(skip), *map(str, arguments), "--no-plots", "-q"],
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
    assert process.returncode == 3
    assert output == ""
    assert "Traceback" not in errors
    return errors


def check_interrupted(directory, whole, said, named):
    """One line names the call and the time; the rows are the first ones of the run that did not hang."""
    trajectory = load_trajectory(directory)
    summary = trajectory.summary
    assert summary["status"] == "interrupted"
    assert summary["cause"].startswith(f"{named} at t = ")
    assert summary["cause"].endswith(" s has not returned within 0.5 s")
    assert summary["time"] == trajectory.time[-1]
    begun = float(summary["cause"].split(" at t = ")[1].split()[0])
    macro_step = SCENE["coupling"]["macro_step"]
    # What is read may belong to the row just recorded, whose step began a macro step before.
    earlier = macro_step if "GetReal" in named else 0.0
    assert summary["time"] - earlier - 1e-8 <= begun <= summary["time"] + macro_step
    assert said.startswith(
        f"error: interrupted: {summary['cause']} (reached t = {summary['time']:.9g} s of 0.6 s); "
        f"what was computed is in {directory}; "
    )
    assert said.count("\n") == 1
    for name, content in written(directory).items():
        assert whole[name].startswith(content)
    assert 10 < len(trajectory) < whole["trajectory.csv"].count(b"\n") - 1


@pytest.mark.parametrize(
    ("number", "fmu", "where"),
    [(signal.SIGINT, "spring", "tied"), (signal.SIGTERM, "beam", "location")],
    ids=["tied", "location"],
)
def test_a_call_that_never_returns_can_be_interrupted(tmp_path, number, fmu, where):
    directory = tmp_path / "run"
    printed("run", PATH, "--out", tmp_path / "whole", "--no-plots", "-q")
    whole = written(tmp_path / "whole")
    run = ("run", PATH, "--out", directory, "--checkpoint", 0.02)
    said = interrupted(number, fmu, "fmi2DoStep", where, 3, *run)
    check_interrupted(directory, whole, said, f"setting inputs or fmi2DoStep of {fmu}.fmu")
    said = interrupted(number, fmu, "fmi2GetReal", "tied", 50, "resume", directory)
    check_interrupted(directory, whole, said, f"fmi2GetReal of {fmu}.fmu")
    printed("resume", directory, "--no-plots", "-q")
    assert written(directory) == whole


def test_a_call_that_never_returns_before_the_first_row_leaves_nothing(tmp_path):
    run = ("run", PATH, "--out", tmp_path / "run")
    said = interrupted(signal.SIGINT, "beam", "fmi2ExitInitializationMode", "start", 0, *run)
    assert said == "error: interrupted: initialisation of beam.fmu at t = 0 s has not returned within 0.5 s\n"
    assert not (tmp_path / "run").exists()
