"""The command, in this process, and one that is interrupted: what tests of several folders call."""

from __future__ import annotations

from functools import cache

import typer
from typer import testing
from typer.testing import CliRunner, Result

from springbeam.cli import app

# Made once: for a command that does little this is most of its time.
testing._get_command = cache(typer.main.get_command)
COMMAND = testing._get_command(app)

#: What a terminal or a CI service may have set.
PLAIN = {"COLUMNS": "80", "TERMINAL_WIDTH": None, "FORCE_COLOR": None, "PY_COLORS": None, "GITHUB_ACTIONS": None}


def command(*arguments: object) -> Result:
    """Return what ``springbeam ARGUMENTS`` printed and its exit code."""
    return CliRunner(env=PLAIN).invoke(app, [str(argument) for argument in arguments], prog_name="springbeam")


class Interrupt:
    """Ctrl-C at the call of this number."""

    def __init__(self, number: int) -> None:
        self.left = number

    def __call__(self, *_: object) -> None:
        self.left -= 1
        if self.left == 0:
            raise KeyboardInterrupt
