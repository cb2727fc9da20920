"""Runs that are ended from outside, as processes: what was written until then can be loaded."""

import os
import signal
import subprocess
import sys
import time

import pytest
from commands import HANGS, printed, written

from springbeam.results.files import load_trajectory
from springbeam.results.records import STEP

#: Some 6,000 steps, of which a thousand reach the disk together.
LONG = ["run", "soft", "--set", "beam.n_elements=10", "--set", "time.t_end=12", "--set", "coupling.macro_step=2e-3"]
LONG += ["--no-plots", "-q"]


@pytest.fixture(scope="module")
def long(tmp_path_factory):
    directory = tmp_path_factory.mktemp("long") / "run"
    printed(*LONG, "--out", directory)
    return directory


def started(directory):
    """The command, once a thousand records are on the disk: a kill may cut the block that is being written."""
    program = [sys.executable, "-m", "springbeam", *LONG, "--out", str(directory)]
    run = subprocess.Popen(program, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + HANGS
    steps = directory / "steps.bin"
    while not steps.exists() or steps.stat().st_size <= 1000 * STEP.itemsize:
        assert time.monotonic() < deadline
        time.sleep(1e-3)
    return run


@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
@pytest.mark.parametrize(
    ("number", "code", "status"),
    [
        (signal.SIGTERM, 3, "interrupted"),
        (signal.SIGHUP, 3, "interrupted"),
        (signal.SIGKILL, -signal.SIGKILL, "running"),
    ],
)
def test_a_run_that_is_ended_from_outside_leaves_what_it_has_computed(tmp_path, long, number, code, status):
    """Each file is, to the last byte, the beginning of that of the whole run."""
    directory = tmp_path / "run"
    whole = written(long)
    run = started(directory)
    run.send_signal(number)
    _, errors = run.communicate(timeout=HANGS)
    assert run.returncode == code
    assert ("interrupted (reached t = " in errors) == (status == "interrupted")
    assert "Traceback" not in errors
    left = load_trajectory(directory)
    assert left.summary["status"] == status
    assert 1000 < len(left.steps) < len(load_trajectory(long).steps)
    assert all(whole[name].startswith(content) for name, content in written(directory).items())


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="limits of another process")
def test_a_run_without_room_ends_with_3_and_leaves_what_there_was_room_for(tmp_path, long):
    """The limit of a file's size stands for the disk's: no root needed."""
    import resource

    directory = tmp_path / "run"
    run = started(directory)
    limit = (directory / "steps.bin").stat().st_size + 50_000
    resource.prlimit(run.pid, resource.RLIMIT_FSIZE, (limit, limit))
    _, errors = run.communicate(timeout=HANGS)
    assert run.returncode == 3
    assert "the run stopped early: " in errors
    assert "File too large" in errors
    # Afterwards a measurement of coverage that has no room either may complain.
    assert "Traceback" not in errors.partition("the results so far are in")[0]
    trajectory = load_trajectory(directory)
    assert trajectory.summary["status"] == "stopped"
    assert "File too large" in trajectory.summary["cause"]
    cut = {name: (directory / name).read_bytes() for name in ("steps.bin", "shapes.bin")}
    assert max(map(len, cut.values())) == limit  # of whichever grows faster
    assert all((long / name).read_bytes().startswith(content) for name, content in cut.items())
