"""Files of measured columns: a record as a load, or one to compare with a run.

The first column is the time. The first line may name the columns, each with its unit in brackets, as ``time [ms],
acceleration [g]`` or ``time (ms)``; or a second line has the units. Tabs part the columns where every line has one,
else semicolons, else commas. Lines that are empty or begin with # are skipped. Pint knows the units; ``g`` of an
acceleration is standard gravity. `Reading` has what else a file may need; nothing of it is guessed.
"""

import codecs
import csv
import re
from collections.abc import Mapping
from io import BytesIO
from math import isnan, nan
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from ..lazily import Later
from .tables import Table, key

if TYPE_CHECKING:
    import numpy as np
else:
    np = Later("numpy")

#: Standard gravity [m/s²].
GRAVITY = 9.80665
_NAME_AND_UNIT = re.compile(r"^\s*(.*?)(?:\s*\[(.*)\]|\s+\((.*)\))?\s*$")
#: Byte order marks, which give the encoding of a file.
_MARKS = {codecs.BOM_UTF8: "utf-8", codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"}
#: Spellings of a missing value, in lower or upper case.
_NOTHING = ("", "nan", "na", "n/a", "null", "-", "--", "---")


class Reading(Table):
    """How a file of measured columns is read."""

    decimal: Literal[".", ","] = key("–", "file: decimal separator", ".")
    encoding: Literal["utf-8", "utf-16-le", "utf-16-be", "latin-1"] | None = key(
        "–", "file: encoding", None, otherwise="by its byte order mark; without one UTF-8"
    )
    skip_lines: int = key("–", "file: number of lines to skip at its beginning", 0, ge=0)
    units_row: bool = key("–", "file: whether the line after the names of the columns has their units", False)
    missing: Literal["refuse", "drop", "interpolate"] = key(
        "–", "file: treatment of missing values: drop the line, or interpolate between its neighbours", "refuse"
    )
    repeats: Literal["refuse", "first", "mean"] = key(
        "–",
        "file: treatment of times that repeat or decrease: keep those after all before, or sort and take means",
        "refuse",
    )


class Recorded:
    """The columns of a file. Raises ValueError, which names line and column, or OSError."""

    def __init__(self, path: Path, reading: Reading | None = None) -> None:
        self._reading = reading or Reading()
        #: Changes made to the data, in words.
        self.notes: list[str] = []
        lines = list(enumerate(self._text(path.read_bytes()).splitlines(), 1))[self._reading.skip_lines :]
        kept = [(number, line) for number, line in lines if line.strip() and not line.lstrip().startswith("#")]
        self._numbers = [number for number, _ in kept]
        columns = self._columns([line for _, line in kept])
        first = [cells[0] for cells in columns]
        named = bool(first) and isnan(self._number(first[0]))
        #: Names of the columns, none where the file has none.
        self.names = [_NAME_AND_UNIT.sub(r"\1", cell) for cell in first if named]
        #: Their units, "" where the file has none.
        self.units = [_NAME_AND_UNIT.sub(r"\2\3", cell) if named else "" for cell in first]
        if self._reading.units_row:
            if not named or len(kept) < 2:
                raise ValueError("units_row: the first line must name the columns, and the second one have their units")
            self.units = [cells[1].strip("[]()") for cells in columns]
        self._labels = self.names or [str(k + 1) for k in range(len(first))]
        above = named + self._reading.units_row
        self._numbers = self._numbers[above:]
        self._cells = [cells[above:] for cells in columns]
        if len(self._numbers) < 2:
            raise ValueError(f"{len(self._numbers)} lines with numbers; there must be two at least")

    def _text(self, content: bytes) -> str:
        """Return the text of a file. Raises ValueError if it is not in its encoding."""
        marked = next((encoding for mark, encoding in _MARKS.items() if content.startswith(mark)), None)
        encoding = self._reading.encoding or marked or "utf-8"
        if b"\0" in content and encoding in ("utf-8", "latin-1"):
            raise ValueError(f'it is no text in {encoding}; give its encoding, as encoding = "utf-16-le"')
        try:
            return content.decode(encoding).removeprefix("\ufeff")
        except UnicodeDecodeError as error:
            line = content.count(b"\n", 0, error.start) + 1
            what = f"line {line}: it is no text in {encoding} (byte {content[error.start]:#04x})"
            raise ValueError(f'{what}; give its encoding, as encoding = "latin-1"') from error

    def _columns(self, lines: list[str]) -> list[list[str]]:
        """Return the cells of lines, all of as many columns, without spaces around them."""
        if not lines:
            return []
        import pyarrow as arrow  # takes a tenth of a second: only if there is a file
        from pyarrow import csv as arrow_csv

        separator = next((mark for mark in "\t;" if all(mark in line for line in lines)), ",")
        what = "as many as the first line, and two at least, with ; or a tab"
        if self._reading.decimal == ".":
            what = what.replace("with ;", "with , or ;")
        elif separator == ",":
            raise ValueError(f"line {self._numbers[0]}: 1 column; there must be {what} between")
        columns = [str(k) for k in range(len(next(csv.reader(lines[:1], delimiter=separator))))]
        odd: list[tuple[int, int]] = [] if len(columns) > 1 else [(1, 1)]

        def skip(row: Any) -> str:
            odd.append((row.number, row.actual_columns))
            return "skip"

        found = arrow_csv.read_csv(
            BytesIO("\n".join(lines).encode()),
            arrow_csv.ReadOptions(use_threads=False, column_names=columns),
            arrow_csv.ParseOptions(delimiter=separator, invalid_row_handler=skip),
            arrow_csv.ConvertOptions(column_types=dict.fromkeys(columns, arrow.string()), strings_can_be_null=False),
        )
        if odd:
            row, number = odd[0]
            raise ValueError(f"line {self._numbers[row - 1]}: {number} columns; there must be {what} between")
        return [[cell.strip() for cell in column.to_pylist()] for column in found.columns]

    def read(self, wanted: Mapping[int, str]) -> "tuple[np.ndarray, dict[int, np.ndarray]]":
        """Return the times [s], ascending, shape (n,), and columns by their numbers, shapes (n,).

        ``wanted`` are the units of the result by number of the column; "" leaves a column as it is. `notes` then has
        the changes made to the data.
        """
        values = np.array([self._values(k, unit) for k, unit in {0: "s", **wanted}.items()])
        values = self._ascending(self._present(values))
        if self._reading.missing == "interpolate":
            values = self._interpolated(values)
        if values.shape[1] < 2:
            raise ValueError(f"{values.shape[1]} lines are left; there must be two at least")
        return values[0], dict(zip(wanted, values[1:], strict=True))

    def _values(self, k: int, wanted: str) -> "np.ndarray":
        """Return column ``k`` in the unit ``wanted``, as it is without any; NaN where a value is missing."""
        label = f"column {self._labels[k]}"
        cells = self._cells[k]
        values = np.array([self._number(cell) for cell in cells])
        for row in np.flatnonzero(~np.isfinite(values)):
            place = f"line {self._numbers[row]}, {label}"
            cell = cells[row]
            if cell.lower() not in _NOTHING:
                remedy = "leave the line out, or begin it with #"
                if "," in cell:
                    remedy = 'decimals have a point, or give decimal = ","'
                raise ValueError(f"{place}: {cell[:40]!r} is not a finite number; {remedy}")
            if self._reading.missing == "refuse":
                remedy = 'missing = "drop" leaves such lines out, "interpolate" fills them'
                raise ValueError(f"{place}: the value is missing; {remedy}")
            if self._reading.missing == "interpolate" and k == 0:
                raise ValueError(f'{place}: the time is missing, and cannot be interpolated; use missing = "drop"')
        if not self.units[k] and wanted:
            self.notes.append(f"{label} has no unit: {wanted} is assumed")
        return values * _factor(self.units[k], wanted, label)

    def _present(self, values: "np.ndarray") -> "np.ndarray":
        """Return ``values`` without the lines in which one is missing, if these are to be dropped."""
        lacking = np.isnan(values).any(axis=0)
        self._lines = np.arange(len(self._numbers))
        if self._reading.missing != "drop" or not lacking.any():
            return values
        self._lines = self._lines[~lacking]
        self._note(lacking, "dropped, where a value is missing")
        return values[:, ~lacking]

    def _ascending(self, values: "np.ndarray") -> "np.ndarray":
        """Return ``values`` with ascending times. Raises ValueError if that is not to be made."""
        times = values[0]
        late = np.zeros(len(times), dtype=bool)
        late[1:] = times[1:] <= np.maximum.accumulate(times)[:-1]
        if not late.any():
            return values
        if self._reading.repeats == "refuse":
            row = self._lines[int(np.argmax(late))]
            place = f"line {self._numbers[row]}: time {self._cells[0][row]}"
            remedy = 'repeats = "first" leaves such lines out, "mean" sorts them and takes means'
            raise ValueError(f"{place} is not after that of the line before; {remedy}")
        if self._reading.repeats == "first":
            self._note(late, "dropped, whose time is not after all before")
            return values[:, ~late]
        self._note(late, "sorted by their time, with means of those that have the same")
        sorted_times, of = np.unique(times, return_inverse=True)
        means = []
        for column in values[1:]:
            known = np.isfinite(column)
            numbers = np.bincount(of, known)
            sums = np.bincount(of, np.where(known, column, 0.0))
            means.append(np.where(numbers > 0, sums / np.maximum(numbers, 1), nan))
        return np.array([sorted_times, *means])

    def _interpolated(self, values: "np.ndarray") -> "np.ndarray":
        """Return ``values`` with those that are missing on the line between their neighbours; lines beyond go."""
        times = values[0]
        filled = [values[0]]
        for column in values[1:]:
            known = np.isfinite(column)
            filled.append(np.interp(times, times[known], column[known], left=nan, right=nan) if known.any() else column)
        beyond = np.isnan(filled).any(axis=0)
        between = np.isnan(values).any(axis=0) & ~beyond
        if between.any():
            self._note(between, "filled by interpolation, where a value is missing")
        if beyond.any():
            self._note(beyond, "dropped at the ends, where a value is missing")
        return np.array(filled)[:, ~beyond]

    def _note(self, lines: Any, what: str) -> None:
        self.notes.append(f"{np.count_nonzero(lines)} lines of {len(self._numbers)} {what}")

    def _number(self, text: str) -> float:
        """Return the number that a cell holds, NaN if it is none."""
        if self._reading.decimal == ",":
            text = text.replace(".", "?").replace(",", ".")
        try:
            return float(text)
        except ValueError:
            return nan


def _factor(unit: str, wanted: str, label: str) -> float:
    """Return the factor from ``unit`` to ``wanted``; 1 if one of them is not known."""
    if not unit or wanted in ("", unit):
        return 1.0
    if (unit, wanted) == ("g", "m/s²"):
        return GRAVITY
    from pint import PintError, Quantity  # takes a second: only if there are units to convert

    try:
        return float(Quantity(1.0, unit.replace("·", "*")).to(wanted.replace("·", "*")).magnitude)
    except (PintError, AssertionError) as error:
        raise ValueError(f"{label}: [{unit}] is no unit of what a run has in {wanted}: {error}") from error
