"""Files of measured columns: a record as a load, or one to lay beside a run.

The first column is the time. The first line may name the columns, each with its unit in brackets, as ``time [ms],
acceleration [g]`` or ``time (ms)``; a comma, a semicolon or a tab parts them. Lines that are empty or begin with # are
skipped. A column without a unit is in that of what it stands for. Pint knows the units; ``g`` of an acceleration is
standard gravity.
"""

from __future__ import annotations

import csv
import re
from math import isnan, nan
from pathlib import Path

import numpy as np

#: Standard gravity [m/s²].
GRAVITY = 9.80665
_NAME_AND_UNIT = re.compile(r"^\s*(.*?)(?:\s*\[(.*)\]|\s+\((.*)\))?\s*$")


class Recorded:
    """The columns of a file. Raises ValueError, which names line and column, or OSError."""

    def __init__(self, path: Path) -> None:
        lines = enumerate(path.read_text(encoding="utf-8-sig").splitlines(), 1)
        kept = [(number, line) for number, line in lines if line.strip() and not line.lstrip().startswith("#")]
        separator = max(",;\t", key=kept[0][1].count) if kept else ","
        rows = [(number, next(csv.reader([line], delimiter=separator))) for number, line in kept]
        first = rows[0][1] if rows else []
        named = bool(first) and isnan(_number(first[0]))
        #: Names of the columns, none where the file has none.
        self.names = [_NAME_AND_UNIT.sub(r"\1", cell) for cell in first if named]
        #: Their units, "" where the file has none.
        self.units = [_NAME_AND_UNIT.sub(r"\2\3", cell) if named else "" for cell in first]
        self._labels = self.names or [str(k + 1) for k in range(len(first))]
        self._rows = rows[named:]
        for number, row in rows:
            if len(row) != max(2, len(first)):
                what = "as many as the first line, and two at least, with , or ; or a tab between"
                raise ValueError(f"line {number}: {len(row)} columns; there must be {what}")
        if len(self._rows) < 2:
            raise ValueError(f"{len(self._rows)} lines with numbers; there must be two at least")

    def times(self) -> np.ndarray:
        """Return the first column [s], ascending, shape (n,)."""
        times = self.column(0, "s")
        if not (rising := np.diff(times) > 0.0).all():
            number, row = self._rows[1 + int(np.argmin(rising))]
            raise ValueError(f"line {number}: time {row[0].strip()} is not after that of the line before")
        return times

    def column(self, k: int, wanted: str = "") -> np.ndarray:
        """Return column ``k`` in the unit ``wanted``, as it is without any; shape (n,)."""
        values, label = np.array([_number(row[k]) for _, row in self._rows]), f"column {self._labels[k]}"
        if not (finite := np.isfinite(values)).all():
            number, row = self._rows[int(np.argmin(finite))]
            remedy = "decimals have a point" if "," in row[k] else "leave the line out, or begin it with #"
            raise ValueError(f"line {number}, {label}: {row[k].strip()[:40]!r} is not a finite number; {remedy}")
        return values * _factor(self.units[k], wanted, label)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return nan


def _factor(unit: str, wanted: str, label: str) -> float:
    """Return what a value in ``unit`` is multiplied by to have it in ``wanted``; 1 where one of them is not known."""
    if not unit or wanted in ("", unit):
        return 1.0
    if (unit, wanted) == ("g", "m/s²"):
        return GRAVITY
    from pint import PintError, Quantity  # takes a second: only for who has units to convert

    try:
        return float(Quantity(1.0, unit.replace("·", "*")).to(wanted.replace("·", "*")).magnitude)
    except (PintError, AssertionError) as error:
        raise ValueError(f"{label}: [{unit}] is no unit of what a run has in {wanted}: {error}") from error
