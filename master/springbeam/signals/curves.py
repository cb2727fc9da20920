"""Curves and numbers of a run by name: a column, or ``module:function``, a Python function of the run."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Iterable, Mapping
from functools import wraps
from pkgutil import resolve_name
from typing import Any

import numpy as np

from ..results.dense import rows_at
from ..results.trajectory import Trajectory
from ..scene import SceneError
from ..scene.messages import nearest

#: Largest number of samples of a run.
MOST = 4_000_000
#: ``package.module:function``
_FUNCTION = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")


def check(text: str, columns: Iterable[str]) -> None:
    """Raise SceneError if ``text`` is neither one of ``columns`` nor a function."""
    names = [name for name in columns if name != "phase"]
    if text not in names and function_of(text) is None:
        raise SceneError(
            f"{text}: is unknown; {nearest(text, names)}allowed: {', '.join(names)}, or your own, module:function"
        )


def unit_of(text: str, units: Mapping[str, str]) -> str:
    """Return the unit of a column, or that which a function states as its attribute ``unit``; "" if it states none."""
    if text in units:
        return units[text]
    return str(getattr(function_of(text), "unit", ""))


def signal(run: Trajectory, text: str) -> np.ndarray:
    """Return a column of ``run``, or the result of a function of it, row by row.

    Raises SceneError if it is neither, or does not give a number per row.
    """
    check(text, run.columns)
    function = function_of(text)
    given = run[text] if function is None else function(run)
    values = np.asarray(given, dtype=float) if np.isrealobj(given) else np.empty(0)
    if values.shape != (len(run),):
        raise SceneError(f"{text}: gives no number for each of the {len(run)} rows")
    if not np.isfinite(values).all():
        raise SceneError(f"{text}: is not finite at t = {run.time[~np.isfinite(values)][0]!s} s")
    return values


def sampled(
    run: Trajectory, what: str, step: float | None = None, since: float | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return equal steps of time from ``since`` [s] on, and a column of ``run``, or a function of it, at these.

    They are ``step`` [s] long; without that there are as many as rows. Values lie on the curve of the run between its
    rows (`springbeam.Trajectory.at`). Raises SceneError where there is nothing to sample.
    """
    begin = float(run.time[0]) if since is None else since
    end = float(run.time[-1])
    if not begin < end:
        raise SceneError(f"from {begin:g} s: the run ends at {end:g} s")
    count = int(np.count_nonzero(run.time >= begin)) if step is None else int((end - begin) / step * (1 + 1e-12)) + 1
    if not 2 <= count <= MOST:
        raise SceneError(
            f"{what}: {count:,} samples; there must be from 2 to {MOST:,}: take lower frequencies, or less of the run"
        )
    times = np.linspace(begin, end, count) if step is None else begin + step * np.arange(count)
    return times, signal(rows_at(run, np.minimum(times, end)), what)


def function_of(text: str) -> Callable[[Trajectory], Any] | None:
    """Return the Python function ``module:name``, ``None`` if ``text`` has another form.

    Modules are also searched in the current directory. Raises SceneError if there is none; so does the function if it
    fails.
    """
    if _FUNCTION.fullmatch(text) is None:
        return None
    if (here := os.getcwd()) not in sys.path:
        sys.path.append(here)
    try:
        function: Any = resolve_name(text)
    except Exception as error:
        raise SceneError(f"{text}: {_in_words(error)}") from error
    if not callable(function):
        raise SceneError(f"{text}: is a {type(function).__name__}, not a function of a run")

    @wraps(function)
    def guarded(run: Trajectory) -> Any:
        try:
            return function(run)
        except Exception as error:
            raise SceneError(f"{text}: {_in_words(error)}") from error

    return guarded


def _in_words(error: Exception) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())}"
