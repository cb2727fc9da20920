"""Files of measured columns: a record as a load, or one to lay beside a run.

The first column is the time. The first line may name the columns, each with its unit in brackets, as ``time [ms],
acceleration [g]`` or ``time (ms)``; a comma, a semicolon or a tab parts them. Lines that are empty or begin with # are
skipped. A column without a unit is in that of what it stands for. Pint knows the units; ``g`` of an acceleration is
standard gravity.
"""

from __future__ import annotations

import csv
import re
from functools import lru_cache
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

#: Standard gravity [m/s²].
GRAVITY = 9.80665
_NAME = re.compile(r"\s*(.*?)(?:\s*\[(.*)\]|\s+\((.*)\))?\s*")


class Recorded:
    """The columns of a file. Raises ValueError, which names line and column, or OSError."""

    def __init__(self, path: Path) -> None:
        try:
            lines = enumerate(path.read_text(encoding="utf-8-sig").splitlines(), 1)
        except UnicodeDecodeError as error:
            raise ValueError(f"not a text in UTF-8: {error.reason} at byte {error.start}; save it as that") from error
        kept = [(number, line) for number, line in lines if line.strip() and not line.lstrip().startswith("#")]
        separator = max(",;\t", key=kept[0][1].count) if kept else ","
        self._rows = [(number, next(csv.reader([line], delimiter=separator))) for number, line in kept]
        named = bool(kept) and _number(self._rows[0][1][0]) is None
        cells = self._rows.pop(0)[1] if named else self._rows[0][1] if kept else []
        found = [m for cell in cells if (m := _NAME.fullmatch(cell)) is not None]
        #: Names of the columns, none where the file has none.
        self.names = [m[1] for m in found] if named else []
        self._units = [(m[2] or m[3] or "") if named else "" for m in found]
        self._labels = self.names or [str(k + 1) for k in range(len(found))]
        if kept and len(found) < 2:
            raise ValueError(f"line {kept[0][0]}: one column; there must be two at least, with , or ; or a tab between")
        if len(self._rows) < 2:
            raise ValueError(f"{len(self._rows)} lines with numbers; there must be two at least")
        for number, row in self._rows:
            if len(row) != len(found):
                raise ValueError(f"line {number}: {len(row)} columns; the first line has {len(found)}")

    def __len__(self) -> int:
        return len(self._units)

    def times(self) -> np.ndarray:
        """Return the first column [s], ascending, shape (n,)."""
        times = self.column(0, "s")
        if not (rising := np.diff(times) > 0.0).all():
            row = int(np.argmin(rising))
            before, after = (self._rows[k][1][0].strip() for k in (row, row + 1))
            raise ValueError(f"line {self._rows[row + 1][0]}: time {after} comes after {before}; times must increase")
        return times

    def column(self, k: int, wanted: str = "") -> np.ndarray:
        """Return column ``k`` in the unit ``wanted``, as it is without any; shape (n,)."""
        found = []
        for number, row in self._rows:
            value = _number(row[k])
            if value is None or not isfinite(value):
                cell = row[k].strip()[:40]
                remedy = "decimals have a point" if "," in cell else "leave the line out, or begin it with #"
                raise ValueError(f"line {number}, column {self._labels[k]}: {cell!r} is not a finite number; {remedy}")
            found.append(value)
        unit = self._units[k]
        return (
            _factor(unit, wanted, f"column {self._labels[k]}") * np.array(found) if unit and wanted else np.array(found)
        )

    def unit(self, k: int) -> str:
        """Return the unit of column ``k``, "" if the file has none."""
        return self._units[k]


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


@lru_cache(maxsize=1)
def _registry() -> Any:
    from pint import UnitRegistry  # takes a second: only for who has units to convert

    return UnitRegistry()


def _factor(unit: str, wanted: str, where: str) -> float:
    """Return what a value in ``unit`` is multiplied by to have it in ``wanted``."""
    if unit == wanted:
        return 1.0
    if (unit, wanted) == ("g", "m/s²"):
        return GRAVITY
    from pint.errors import PintError

    try:
        return float(_registry().Quantity(1.0, unit.replace("·", "*")).to(wanted.replace("·", "*")).magnitude)
    except (PintError, ValueError, AssertionError) as error:
        raise ValueError(f"{where}: [{unit}] is no unit of what a run has in {wanted}: {error}") from error
