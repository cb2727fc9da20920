"""Imports run downwards only, references share nothing with what they check, and what is slow is loaded late."""

import logging.config
import os
import sys
from pathlib import Path

import grimp
import numpy as np
from commands import ran
from importlinter.cli import lint_imports
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "master" / "springbeam"


def test_the_contracts_of_pyproject_are_kept(monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(logging.config, "dictConfig", lambda _: None)  # it turns off the loggers that there are
    assert lint_imports(no_cache=True) == os.EX_OK, capsys.readouterr().out


def test_no_files_import_each_other_in_a_circle():
    """By strings neither: only packages name modules that they import when asked."""
    graph = grimp.build_graph("springbeam")
    number = {name: i for i, name in enumerate(sorted(graph.modules))}
    imports = [(number[of], number[it]) for of in number for it in graph.find_modules_directly_imported_by(of)]
    links = coo_array((np.ones(len(imports)), tuple(zip(*imports, strict=True))), shape=(len(number),) * 2)
    _, circle = connected_components(links, connection="strong")
    assert len(set(circle)) == len(number)
    by_string = {path for path in PACKAGE.rglob("*.py") if 'import_module(f"' in path.read_text(encoding="utf-8")}
    assert by_string == {PACKAGE / "lazily.py", PACKAGE / "cli" / "__init__.py"}


#: What takes long to load.
SLOW = (
    *("numpy", "scipy", "matplotlib", "plotly", "fmpy", "pyarrow", "distributed", "pandas", "pint"),
    *("numpy.ma", "multiprocessing.connection", "rich.progress", "pydantic"),
)


#: Commands that load none of it.
LIGHT = ("", "--help", "scenes", "run --help", "crosscheck --help")


def test_help_loads_nothing_that_is_slow(tmp_path):
    """Each in a process of its own, forked from one that has imported the command alone."""
    script = f"""
import os, sys
from springbeam.cli import app
for line in {LIGHT}:
    if (child := os.fork()) == 0:
        try:
            app(line.split())
        except SystemExit as end:
            print("\\nLOADED", end.code, *(name for name in {SLOW} if name in sys.modules), flush=True)
        os._exit(0)
    os.waitpid(child, 0)
"""
    lines = ran(sys.executable, "-c", script, cwd=tmp_path).splitlines()
    found = [line for line in lines if line.startswith("LOADED")]
    assert found == ["LOADED 0"] * len(LIGHT)
