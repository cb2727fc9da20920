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


def test_what_is_slow_is_loaded_only_where_it_is_needed():
    """`springbeam scenes` loads every scene, and a run its bodies: none of what takes longer to load than all else."""
    script = """
import sys
slow = {"scipy", "matplotlib", "plotly", "distributed", "pandas"}
from springbeam.cli import app
try:
    app(["scenes"])
except SystemExit:
    print("SLOW", *sorted((slow | {"fmpy"}) & set(sys.modules)))
import springbeam
springbeam.simulate(springbeam.load_scene("soft", ["time.t_end=0.01"]))
print("SLOW", *sorted(slow & set(sys.modules)))
"""
    assert ran(sys.executable, "-c", script).splitlines()[-2:] == ["SLOW", "SLOW"]
