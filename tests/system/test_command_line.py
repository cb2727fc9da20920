"""The command as people and programs meet it: tables, JSON, completion, help, and the likeliest mistakes."""

import ast
import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from commands import COMMAND, printed, ran, refused
from typer.testing import CliRunner

from springbeam import simulate
from springbeam.cli import app
from springbeam.scene import load_scene

pytestmark = pytest.mark.usefixtures("unpainted")

#: Arguments of each command that make it print its tables within a second or two.
TABLES = {
    "scenes": "",
    "keys": "",
    "new": "my_scene",
    "run": "soft --no-plots --set time.t_end=0.1",
    "paper": "2 --no-plots --set beam.n_elements=10 --set beam.n_modes=0 --set time.t_end=0.55",
    "sweep": "duffing --vary spring.mass=0.5,1 --set time.t_end=1 --scheduler {scheduler} --out varied",
    "compare": "done done --out compared.png",
    "spectrum": "done --out spectra",
    "fit": "duffing curve.csv --vary spring.linear_stiffness=3.1 --set time.t_end=1 --out fitted",
    "report": "done --out page.html",
    "plot": "done --picture positions",
    "animate": "done --seconds 0.2 --fps 10 --out moving.gif",
    "export": "done",
    "predict": "soft --set beam.n_elements=10",
    "converge": "soft --levels 3 --set beam.n_elements=4 --set time.t_end=0.05",
    "tradeoff": "duffing --until 0.5 --quick --out traded",
    "crosscheck": "soft --set time.t_end=0.1 --set beam.n_elements=6",
    "doctor": "",
}

#: Those that print a name of a file alone, or whose documents are read in the tests of their own.
WITHOUT_JSON = ("new", "compare", "spectrum", "fit", "report", "plot", "animate", "export")


#: Keys of the documents of commands, of those that write no table of their name.
DOCUMENTS = {
    "run": {"status", "directory", "macro_steps"},
    "paper": {"status", "directory", "iterations_per_solve"},
    "sweep": {"runs", "files"},
    "crosscheck": {"verdict", "quantities", "events"},
    "doctor": {"fmus"},
    "predict": {"estimates", "exchange", "notes"},
}


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder with a run that is done."""
    with pytest.MonkeyPatch.context() as there:
        there.chdir(tmp_path_factory.mktemp("place"))
        printed("run", "soft", "--no-plots", "--set", "time.t_end=0.1", "--out", "done")
        curve = simulate(load_scene("duffing", ["time.t_end=1"])).y[:101:8]
        noisy = curve + 0.01 * np.random.default_rng(1).standard_normal(len(curve))
        rows = "".join(f"{0.08 * k:.2f},{value}\n" for k, value in enumerate(noisy))
        Path("curve.csv").write_text(f"time,y\n{rows}", encoding="utf-8")
        yield Path.cwd()


@pytest.fixture(scope="module")
def arguments():
    """The words of a line; sweeps run on a cluster in this process."""
    from distributed import LocalCluster

    with LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address="127.0.0.1:0") as local:
        yield lambda line: line.format(scheduler=local.scheduler_address).split()


# -- tables and help ------------------------------------------------------------------------------------------------


def test_every_command_is_looked_at():
    assert set(TABLES) == set(COMMAND.commands)


@pytest.mark.parametrize("name", TABLES)
def test_a_command_prints_what_it_has_found_and_its_json_is_one_document(place, arguments, name):
    """Studies show what they have found once more."""
    line = [name, *arguments(TABLES[name])]
    assert "…" not in printed(*line)  # nothing cut off
    if name in WITHOUT_JSON:
        return
    document = json.loads(printed(*line, "--json"))
    if name in DOCUMENTS:
        assert DOCUMENTS[name] <= document.keys()
    elif isinstance(document, dict):
        assert Path(document["directory"], f"{name}.csv").exists()


@pytest.mark.parametrize("name", COMMAND.commands)
def test_the_help_of_a_command_has_an_example_that_it_understands(name):
    shown = printed(name, "--help")
    described = COMMAND.get_command(None, name)
    example = re.search(r"Example: (springbeam .*)", described.help)[1]
    assert example in " ".join(shown.split())
    program, first, *arguments = shlex.split(example)
    assert (program, first) == ("springbeam", name)
    described.make_context(name, arguments)  # raises if an option or a value is wrong


# -- completion -----------------------------------------------------------------------------------------------------


def asked_by_a_shell(what, **environment):
    """What the command prints for the shell that asks it for ``what``; typer names the variable after the program."""
    environment = {**environment, "_SPRINGBEAM_COMPLETE": what}
    return CliRunner(env=environment).invoke(app, prog_name="springbeam").stdout


@pytest.mark.parametrize(
    ("line", "completed"),
    [
        ("springbeam cr", ["crosscheck"]),
        ("springbeam run so", ["soft"]),
        ("springbeam run soft --set coupling.sch", ["coupling.scheme="]),
        ("springbeam sweep soft --vary stop.", ["stop.position=", "stop.restitution="]),
        ("springbeam keys sto", ["stop"]),
        ("springbeam run my_scene", []),  # the shell goes on with files
    ],
)
def test_commands_scenes_and_keys_are_completed(line, completed):
    asked = asked_by_a_shell("complete_bash", COMP_WORDS=line, COMP_CWORD=str(len(line.split()) - 1))
    assert asked.split() == completed


# -- without FMUs -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("line", ["run soft", "crosscheck soft"])
def test_without_fmus_the_error_says_what_builds_them(here, monkeypatch, line):
    monkeypatch.setenv("SPRINGBEAM_FMUS", str(here))
    said = refused(*line.split())
    assert str(here) in said
    assert "./build.sh fmus builds it" in said
    assert not any(path.is_file() for path in here.rglob("*"))


def test_an_output_that_is_closed_is_no_success():
    """A reader that stops, as `head` does, ends the command with 3; 1 would be a check that failed."""
    receiver, sender = os.pipe()
    os.close(receiver)
    done = subprocess.run([sys.executable, "-m", "springbeam", "keys"], stdout=sender, stderr=subprocess.PIPE)
    os.close(sender)
    assert done.returncode == 3
    assert done.stderr.decode() == "error: standard output: closed before all was written\n"


#: A sweep of one case in a process that has loaded no more than a worker has.
WORKER = """
from springbeam.scene import load_scene
from springbeam.studies.sweep import Sweep
study = Sweep(scene=load_scene("duffing", ["time.t_end=0.2"]), vary=("spring.mass=1",), metric=("high=mine:height",))
print(study.record({"spring.mass": 1.0}))
"""


def test_a_function_of_the_callers_gets_a_run_with_its_methods(tmp_path):
    """In a process of its own: here the tests have loaded all there is."""
    (tmp_path / "mine.py").write_text("def height(run):\n    return float(run.at([0.1])['y'][0])\n")
    record = ast.literal_eval(ran(sys.executable, "-c", WORKER, cwd=tmp_path))
    assert (record["status"], record["high"] > 0.0) == ("done", True)
