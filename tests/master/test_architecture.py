"""Imports run downwards only, references share nothing with what they check, and what is slow is loaded late."""

import logging.config
import os
import sys
from pathlib import Path

from commands import ran
from importlinter.cli import lint_imports

ROOT = Path(__file__).parents[2]


def test_the_contracts_of_pyproject_are_kept(monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(logging.config, "dictConfig", lambda _: None)  # it turns off the loggers that there are
    assert lint_imports(no_cache=True) == os.EX_OK, capsys.readouterr().out


def test_a_command_loads_what_is_slow_only_where_it_is_needed():
    """`springbeam scenes` loads every scene, and none of what takes longer to load than all else of the command."""
    script = """
import sys
from springbeam.cli import app
try:
    app(["scenes"])
except SystemExit:
    print("SLOW", *sorted({"scipy", "fmpy", "matplotlib", "plotly", "distributed", "pandas"} & set(sys.modules)))
"""
    assert ran(sys.executable, "-c", script).splitlines()[-1].split() == ["SLOW"]
