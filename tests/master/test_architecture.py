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
    """By strings neither: only the package itself names modules that it imports when asked."""
    graph = grimp.build_graph("springbeam")
    number = {name: i for i, name in enumerate(sorted(graph.modules))}
    imports = [(number[of], number[it]) for of in number for it in graph.find_modules_directly_imported_by(of)]
    links = coo_array((np.ones(len(imports)), tuple(zip(*imports, strict=True))), shape=(len(number),) * 2)
    _, circle = connected_components(links, connection="strong")
    assert len(set(circle)) == len(number)
    by_string = {path for path in PACKAGE.rglob("*.py") if 'import_module(f"' in path.read_text(encoding="utf-8")}
    assert by_string == {PACKAGE / "__init__.py"}


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
