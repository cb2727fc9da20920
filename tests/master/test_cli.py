"""The command: exit codes, what it prints and where, and what an interruption leaves."""

import errno
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import typer
from bodies import simulate
from commands import command
from runs import block

import springbeam.run.runner
from springbeam import Event, RunStopped, load_scene, with_changes
from springbeam.cli.common import interruptible
from springbeam.results.directory import PICTURES
from springbeam.results.files import load_trajectory
from springbeam.results.totals import peak_force
from springbeam.studies.beside import results_of


def fake_steps(scene, recorder, progress=None):
    """Steps, as the real runner reports them."""
    steps, _, shapes = block(31, scene, scene.time.t_end)
    steps["events"] = 1.0
    recorder.keep(steps, [Event(0.1, "impact", 0.5, -1.0, 0.5, -1.0, 0.25, 0.0, 0.125)], shapes)
    for i in range(31) if progress is not None else ():
        progress(steps["time"][i], "free", i)


# -- stopped early: exit code 3, what was computed is there -------------------------------------------------------


@pytest.mark.parametrize(
    ("error", "fragments"),
    [
        (RunStopped("not converged", 0.6, 1e-3), ["stopped", "not converged", "0.6"]),
        (KeyboardInterrupt(), ["interrupted (reached t = 0.6 s of 0.6 s)"]),
        (OSError(errno.ENOSPC, "No space left on device"), ["No space left on device"]),
    ],
    ids=["stopped", "interrupted", "disk full"],
)
def test_a_run_that_stops_early(here, unpainted, monkeypatch, error, fragments):
    def run(scene, recorder, *progress):
        fake_steps(scene, recorder, *progress)
        recorder.finish({"status": "stopped"})
        raise error

    monkeypatch.setattr(springbeam.run.runner, "run", run)
    result = command("run", "soft")
    assert result.exit_code == 3
    for fragment in [*fragments, "the results so far are in results/soft"]:
        assert fragment in result.stderr
    assert "Traceback" not in result.output
    assert len(load_trajectory(here / "results" / "soft")) == 31
    assert (here / "results" / "soft" / PICTURES["overview"]).exists()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device that is always full")
@pytest.mark.parametrize(
    ("arguments", "unbuffered"), [(["scenes"], "1"), (["run", "duffing", "--no-plots", "--set=time.t_end=0.1"], "")]
)
def test_an_output_without_room_is_one_error(here, fmu_folder, arguments, unbuffered):
    process = [sys.executable, "-m", "springbeam", *arguments]
    environment = {**os.environ, "PYTHONUNBUFFERED": unbuffered}
    with open("/dev/full", "w") as full:
        done = subprocess.run(process, cwd=here, env=environment, stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 3
    assert done.stderr == "error: standard output: No space left on device\n"
    if arguments[0] == "run":
        assert load_trajectory(here / "results" / "duffing").summary["status"] == "done"


# -- the other commands -------------------------------------------------------------------------------------------


def test_peaks_are_compared_over_one_window():
    """One motion with its force averaged over 1 ms and over 4 ms."""
    soft = load_scene("soft")
    runs = []
    for window in (1e-3, 4e-3):
        run = simulate(
            with_changes(
                soft,
                beam={"n_elements": 4},
                stop=None,
                time={"t_end": 0.05},
                contact={"force_window": window},
                coupling={"macro_step": 1e-3},
            )
        )
        peak, _ = peak_force(run.steps, run.events, window)
        run.summary |= {"contact_force_max": peak, "contact_force_window": window}
        runs.append(run)
    own = [run.summary["contact_force_max"] for run in runs]
    assert own[0] > 1.1 * own[1]
    found = results_of(runs)
    assert found["contact_force_window [s]"] == [4e-3, 4e-3]
    assert found["contact_force_max [N]"] == [pytest.approx(own[1], rel=1e-14)] * 2
    runs[0].steps = None
    assert results_of(runs)["contact_force_max [N]"] == [None, own[1]]


def test_an_interrupt_that_is_lost_in_a_finaliser_is_not_the_last(capsys):
    """Python reports what a finaliser raises, or a function called from C, and goes on: the command had not ended."""

    class Finalised:
        def __del__(self):
            signal.raise_signal(signal.SIGTERM)
            len("")  # Python acts on the signal here

    made = [Finalised()]

    @interruptible()
    def work():
        end = time.monotonic() + 60.0
        made.clear()
        while time.monotonic() < end:
            time.sleep(0.01)

    with pytest.raises(typer.Exit) as ended:
        work()
    assert ended.value.exit_code == 3
    assert capsys.readouterr().err == "error: interrupted\n"


# -- waiting ------------------------------------------------------------------------------------------------------
