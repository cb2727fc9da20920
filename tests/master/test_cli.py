"""The command: exit codes, what it prints and where, and what an interruption leaves."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import typer

from springbeam.cli import run
from springbeam.cli.common import interruptible
from springbeam.results.files import load_trajectory
from springbeam.scene import load_scene

# -- stopped early: exit code 3, what was computed is there -------------------------------------------------------


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


def test_an_interrupt_that_is_lost_in_a_finaliser_is_not_the_last(capsys):
    """Python reports what a finaliser raises, or a function called from C, and goes on: the command had not ended."""

    class Finalised:
        def __del__(self):
            signal.raise_signal(signal.SIGTERM)
            len("")  # Python acts on the signal here

    made = [Finalised()]

    @interruptible()
    def work():
        end = time.process_time() + 60.0  # by a clock that other programs do not advance
        made.clear()
        while time.process_time() < end:
            pass

    with pytest.raises(typer.Exit) as ended:
        work()
    assert ended.value.exit_code == 3
    assert capsys.readouterr().err == "error: interrupted\n"


# -- the cost of a run, before it begins --------------------------------------------------------------------------


@pytest.mark.parametrize(("answer", "made"), [(True, True), (False, False), (None, True)])
def test_a_run_of_years_is_made_after_a_question_on_a_terminal(monkeypatch, capsys, answer, made):
    """6e11 steps of 3 µs or more are three weeks at least; a batch job prints a note, and runs."""
    asked = []
    monkeypatch.setattr(sys.stdin, "isatty", lambda: answer is not None, raising=False)
    monkeypatch.setattr(typer, "confirm", lambda words, err: asked.append(words) or answer)
    scene = load_scene("soft", ["coupling.macro_step=1e-12"])
    if made:
        run.ask_if_long(scene)
    else:
        with pytest.raises(typer.Exit) as refused:
            run.ask_if_long(scene)
        assert refused.value.exit_code == 2
    said = asked[0] if asked else capsys.readouterr().err
    assert bool(asked) == (answer is not None)
    assert "6e+11 macro steps take about " in said
    assert any(unit in said for unit in ("days", "years"))


def test_a_run_of_seconds_is_made_without_a_question(monkeypatch):
    monkeypatch.setattr(typer, "confirm", None)
    run.ask_if_long(load_scene("soft"))
