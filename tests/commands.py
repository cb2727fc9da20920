"""The command in this process, one that is interrupted, what it has written; other programs. For several folders."""

import os
import subprocess
from functools import cache
from pathlib import Path

import pyarrow.parquet as parquet
import typer
from typer import testing
from typer.testing import CliRunner

from springbeam.cli import app

# Made once: for a command that does little this is most of its time.
testing._get_command = cache(typer.main.get_command)
COMMAND = testing._get_command(app)

#: What takes longer hangs, however busy the machine [s].
HANGS = 3600.0
#: What a terminal or a CI service may have set.
PLAIN = {"COLUMNS": "80", "TERMINAL_WIDTH": None, "FORCE_COLOR": None, "PY_COLORS": None, "GITHUB_ACTIONS": None}


def command(*arguments):
    """Return what ``springbeam ARGUMENTS`` printed and its exit code."""
    return CliRunner(env=PLAIN).invoke(app, [str(argument) for argument in arguments], prog_name="springbeam")


def printed(*arguments):
    """Return what ``springbeam ARGUMENTS`` prints; it must end well and complain of nothing."""
    result = command(*arguments)
    assert (result.exit_code, result.stderr) == (0, ""), f"{result.output}\n{result.exception!r}"
    return result.stdout


def refused(*arguments):
    """Return the error of ``springbeam ARGUMENTS``, which must be bad input: exit code 2 and nothing printed."""
    result = command(*arguments)
    assert (result.exit_code, result.stdout) == (2, ""), result.output
    assert "Traceback" not in result.stderr
    return result.stderr


def ran(*words, env=None, **options):
    """Return what another program printed, which must succeed; ``env`` is added to the environment."""
    environment = {**os.environ, **(env or {})}
    process = [str(word) for word in words]
    done = subprocess.run(process, env=environment, capture_output=True, text=True, timeout=HANGS, **options)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return done.stdout


def written(directory):
    """Return the files to which a run appends, and tables of these: they begin as those of the whole run.

    A contact in which a run ends goes on in the whole one.
    """
    return {
        path.name: path.read_bytes()
        for path in directory.iterdir()
        if path.suffix in (".csv", ".bin") and path.stem != "contacts"
    }


class Interrupt:
    """Ctrl-C at the call of this number."""

    def __init__(self, number):
        self.left = number

    def __call__(self, *_):
        self.left -= 1
        if self.left == 0:
            raise KeyboardInterrupt


def swept(directory):
    """The columns of a finished sweep."""
    return parquet.read_table(Path(directory, "sweep.parquet")).to_pydict()
