"""Imports run downwards only, the references share nothing with what they check, one module knows FMPy."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from importlinter.cli import lint_imports

ROOT = Path(__file__).parents[2]


def test_the_contracts_of_pyproject_are_kept(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture) -> None:
    monkeypatch.chdir(ROOT)
    assert lint_imports(no_cache=True) == os.EX_OK, capsys.readouterr().out
