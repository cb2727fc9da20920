"""Runs that are ended from outside, as processes: what was written until then can be loaded."""

import os
import signal
import subprocess
import sys
from time import sleep

import pytest
from commands import HANGS, printed, written

from springbeam.results.files import load_trajectory
from springbeam.results.records import STEP

#: A thousand records reach the disk together.
SOFT = ["run", "soft", "--set", "beam.n_elements=10", "--set", "coupling.macro_step=2e-3", "--no-plots", "-q"]

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="signals, and limits of another process")


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    """The files of a run of some 2,000 steps, with which any longer one begins but for where the last step ends."""
    directory = tmp_path_factory.mktemp("first") / "run"
    printed(*SOFT, "--set", "time.t_end=4", "--out", directory)
    return {name: content[: len(content) // 2] for name, content in written(directory).items()}


def begins(directory, first):
    """Whether each file of a run is the beginning of that of `first`, or begins with it."""
    files = written(directory)
    assert set(files) <= set(first)
    return all(a.startswith(b[: len(a)]) for a, b in ((files[name], first[name]) for name in files))


def paused(directory):
    """The command, which would go on for hours, stopped once a thousand records are on the disk."""
    program = [sys.executable, "-m", "springbeam", *SOFT, "--set", "time.t_end=1e5", "--out", str(directory)]
    run = subprocess.Popen(program, stderr=subprocess.PIPE, text=True)
    steps = directory / "steps.bin"
    while not steps.exists() or steps.stat().st_size <= 1000 * STEP.itemsize:
        assert run.poll() is None
        sleep(1e-2)
    run.send_signal(signal.SIGSTOP)
    os.waitpid(run.pid, os.WUNTRACED)
    return run


@pytest.mark.parametrize(
    ("number", "code", "status"),
    [
        (signal.SIGTERM, 3, "interrupted"),
        (signal.SIGHUP, 3, "interrupted"),
        (signal.SIGKILL, -signal.SIGKILL, "running"),
    ],
)
def test_a_run_that_is_ended_from_outside_leaves_what_it_has_computed(tmp_path, first, number, code, status):
    directory = tmp_path / "run"
    run = paused(directory)
    run.send_signal(number)
    run.send_signal(signal.SIGCONT)
    _, errors = run.communicate(timeout=HANGS)
    assert run.returncode == code
    assert ("interrupted (reached t = " in errors) == (status == "interrupted")
    assert "Traceback" not in errors
    left = load_trajectory(directory)
    assert left.summary["status"] == status
    assert len(left.steps) > 1000
    assert begins(directory, first)


def test_a_run_without_room_ends_with_3_and_leaves_what_there_was_room_for(tmp_path, first):
    """The limit of a file's size stands for the disk's: no root needed."""
    import resource

    directory = tmp_path / "run"
    run = paused(directory)
    limit = max(path.stat().st_size for path in directory.glob("*.bin")) + 50_000
    resource.prlimit(run.pid, resource.RLIMIT_FSIZE, (limit, limit))
    run.send_signal(signal.SIGCONT)
    _, errors = run.communicate(timeout=HANGS)
    assert run.returncode == 3
    assert "the run stopped early: " in errors
    assert "File too large" in errors
    # Afterwards a measurement of coverage that has no room either may complain.
    assert "Traceback" not in errors.partition("the results so far are in")[0]
    trajectory = load_trajectory(directory)
    assert trajectory.summary["status"] == "stopped"
    assert "File too large" in trajectory.summary["cause"]
    assert max(path.stat().st_size for path in directory.glob("*.bin")) == limit  # of whichever grows faster
    assert begins(directory, first)
