"""Agreement of two codes is evidence only if they share nothing: `monolithic` may use `scene` and `trajectory`."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import springbeam.monolithic

FOLDER = Path(springbeam.monolithic.__file__).parent
MODULES = sorted(FOLDER.glob("*.py"))
ALLOWED_OUTSIDE = {"scene", "trajectory"}
ALLOWED_PACKAGES = {
    "__future__",
    "abc",
    "collections",
    "dataclasses",
    "functools",
    "itertools",
    "numpy",
    "scipy",
    "time",
    "typing",
}


def test_there_is_something_to_check() -> None:
    assert {"semi_discrete", "event_driven", "algorithm1"} <= {path.stem for path in MODULES}


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.stem)
def test_imports(path: Path) -> None:
    own = {module.stem for module in MODULES}
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            for alias in node.names:
                assert alias.name.split(".")[0] in ALLOWED_PACKAGES
        elif isinstance(node, ast.ImportFrom):
            module = (node.module or "").split(".")[0]
            if node.level == 0:
                assert module in ALLOWED_PACKAGES
            elif node.level == 1:
                assert module in own
            else:
                assert node.level == 2
                assert module in ALLOWED_OUTSIDE
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            assert node.func.id not in {"__import__", "exec", "eval"}
