"""Formulas over columns and numbers of a run, as "a_tip + load_0" or "max(abs(clamp_moment))/0.02"; asteval reads them.

They know numpy's functions by name, arithmetic, comparisons and ``g`` (standard gravity). Nothing in them reaches
outside: no attributes, no statements, no files.
"""

from __future__ import annotations

import ast
import os
import re
import sys
from collections.abc import Callable, Iterable
from pkgutil import resolve_name
from typing import Any, cast

import numpy as np
from asteval import Interpreter, get_ast_names

from ..results.trajectory import Trajectory
from ..scene import SceneError
from ..scene.messages import nearest
from ..scene.recorded import GRAVITY

#: Names of asteval that reach outside.
_OUTSIDE = ("open", "dir", "input", "print", "type", "id")
#: ``package.module:function``
_FUNCTION = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")


class Expression:
    """A formula, read once. Raises SceneError if it is none."""

    def __init__(self, text: str) -> None:
        self.text = text
        try:
            self._tree = ast.parse(text.strip(), mode="eval")
        except SyntaxError as error:
            raise SceneError(f"{text}: not a formula: {error.msg}") from error
        known = _interpreter().symtable
        #: What it takes from a run, in the order of the alphabet.
        self.names = tuple(sorted({name for name in get_ast_names(self._tree) if name not in known}))

    def check(self, allowed: Iterable[str]) -> None:
        """Raise SceneError if it takes anything that is not ``allowed``."""
        allowed = list(allowed)
        for name in self.names:
            if name not in allowed:
                raise SceneError(
                    f"{self.text}: {name} is unknown; {nearest(name, allowed)}there are {', '.join(allowed)}, "
                    "and numpy's functions"
                )

    def __call__(self, look_up: Callable[[str], Any]) -> Any:
        """Return its value, ``None`` if something that it takes is ``None``. Raises SceneError where it has none."""
        values = {name: look_up(name) for name in self.names}
        if any(value is None for value in values.values()):
            return None
        interpreter = _interpreter()
        interpreter.symtable.update(values)
        with np.errstate(all="ignore"):
            found = interpreter(self.text.strip(), show_errors=False)
        if interpreter.error:
            raise SceneError(f"{self.text}: {interpreter.error[0].msg}")
        return found


def signal(run: Trajectory, text: str) -> np.ndarray:
    """Return a column of ``run``, or what a formula makes of its columns, row by row.

    Raises SceneError for what is no formula of columns, or gives no number a row.
    """
    expression = Expression(text)
    expression.check(name for name in run.columns if name != "phase")
    found = expression(run.columns.__getitem__)
    values = np.asarray(found, dtype=float) if np.isrealobj(found) else np.empty(0)
    if values.shape != (len(run),):
        raise SceneError(
            f"{text}: gives no number for each of the {len(run)} rows; name a column, or a formula of them"
        )
    if not np.isfinite(values).all():
        raise SceneError(f"{text}: is not finite at t = {run.time[~np.isfinite(values)][0]!s} s")
    return values


def function_of(text: str) -> Callable[[Trajectory], Any] | None:
    """Return the Python function that ``module:name`` means, ``None`` if ``text`` is nothing of the kind.

    The directory of the command counts as a place of modules. Raises SceneError if there is none.
    """
    if _FUNCTION.fullmatch(text) is None:
        return None
    if (here := os.getcwd()) not in sys.path:
        sys.path.append(here)
    try:
        found: Any = resolve_name(text)
    except (ImportError, AttributeError) as error:
        raise SceneError(f"{text}: {error}") from error
    if not callable(found):
        raise SceneError(f"{text}: is a {type(found).__name__}, not a function of a run")
    return cast(Callable[[Trajectory], Any], found)


def _interpreter() -> Interpreter:
    found = Interpreter(minimal=True)
    for name in _OUTSIDE:
        found.symtable.pop(name, None)
    found.symtable["g"] = GRAVITY
    return found
