"""Imports run downwards only, references share nothing with what they check, and what is slow is loaded late."""

import logging.config
import os
import sys
from pathlib import Path

import grimp
import numpy as np
import pytest
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
SLOW = ("numpy", "scipy", "matplotlib", "plotly", "fmpy", "pyarrow", "distributed", "pandas", "pint")


@pytest.mark.parametrize(
    ("line", "loaded"),
    [
        ("", ""),
        ("--help", ""),
        ("scenes", ""),
        ("keys", ""),
        ("keys --schema", ""),
        ("keys beam --json", ""),
        ("new mine", ""),
        ("doctor --help", ""),
        ("run --help", ""),
        ("crosscheck --help", ""),
        ("doctor", "numpy fmpy"),
        ("run soft --no-plots --set time.t_end=0.01", "numpy fmpy"),
        ("report results/soft", "numpy plotly"),
        ("export results/soft", "numpy"),
    ],
)
def test_a_command_loads_what_it_uses_and_nothing_else(line, loaded, tmp_path):
    if "results" in line:
        short = ("run", "soft", "--no-plots", "--set", "time.t_end=0.01")
        ran(sys.executable, "-m", "springbeam", *short, cwd=tmp_path)
    script = f"""
import sys
from springbeam.cli import app
try:
    app({line.split()})
except SystemExit as end:
    print("\\nLOADED", end.code, *(name for name in {SLOW} if name in sys.modules))
"""
    last = ran(sys.executable, "-c", script, cwd=tmp_path).splitlines()[-1]
    assert last.split() == ["LOADED", "0", *loaded.split()]
