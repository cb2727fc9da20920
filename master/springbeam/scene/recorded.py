"""Files of measured columns: a record as a load, or one to compare with a run.

The first line may name the columns, each with its unit in brackets, as ``time [ms], acceleration [g]`` or ``time(ms)``;
or a second line has the units. Tabs, semicolons, commas or blanks separate the columns. Lines that are empty or begin
with # are skipped; one with # right above the numbers may name the columns, as numpy.savetxt writes it. `Reading` has
what else a file may need.
"""

import codecs
import csv
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from io import BytesIO
from itertools import count
from math import nan
from pathlib import Path
from statistics import mode
from typing import TYPE_CHECKING, Any, Literal

from ..lazily import Later
from .tables import Table, key
from .units import factor

if TYPE_CHECKING:
    import numpy as np
    from scipy.interpolate import PPoly
else:
    np = Later("numpy")

#: A name and its unit in brackets; a unit by itself; a cell where blanks separate the columns.
_NAME_AND_UNIT = re.compile(r"(.*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\))?")
_UNIT = re.compile(r"\[.*\]|\(.*\)")
_CELL = re.compile(r"[^\s\[(]+(?:\s*(?:\[[^\]]*\]|\([^)]*\)))?|\[[^\]]*\]|\([^)]*\)")
#: Byte order marks, which give the encoding of a file; bytes that no text has.
_MARKS = {codecs.BOM_UTF8: "utf-8", codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"}
_NO_TEXT = re.compile(rb"[\x01-\x08\x0e-\x1f]")
#: Most lines above the numbers.
_MOST_ABOVE = 500
#: Spellings of a missing value, in lower case.
_NOTHING = ("", "nan", "na", "n/a", "#n/a", "null", "-", "--", "---")
#: How pyarrow says which cell is no number.
_NO_NUMBER = re.compile(r"column #(\d+): Row #(\d+): .* invalid value '(.*)'", re.DOTALL)
#: Names of the column of times, in lower case.
_TIMES = ("time", "t")


class Reading(Table):
    """How a file of measured columns is read."""

    decimal: Literal[".", ","] = key("–", "file: decimal separator", ".")
    encoding: Literal["utf-8", "utf-16-le", "utf-16-be", "latin-1"] | None = key(
        "–", "file: encoding", None, otherwise="by its byte order mark; without one UTF-8"
    )
    skip_lines: int = key("–", "file: number of lines to skip at its beginning, above the names", 0, ge=0)
    units_row: bool = key("–", "file: whether the line after the names has their units, without brackets", False)
    time_column: str | None = key(
        "–", "file: name or number of the column of times", None, otherwise="the one called time or t, else the first"
    )
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
        #: Assumptions about the data and changes made to them, in words.
        self.notes: list[str] = []
        lines = [line.strip() for line in self._text(path.read_bytes()).splitlines()]
        skipped = self._reading.skip_lines
        rows = [(n, line) for n, line in zip(count(1), lines) if n > skipped and line and not line.startswith("#")]
        self._refuse_few(rows)
        middle = rows[len(rows) // 2][1]
        marks = "\t;" if self._reading.decimal == "," else "\t;,"
        self._mark = next((mark for mark in marks if mark in middle), " ")
        width = mode(len(self._cells(line)) for _, line in rows[-_MOST_ABOVE:])
        if width < 2:
            between = "a tab or ;" if self._reading.decimal == "," else "a tab, a comma, ; or blanks"
            raise ValueError(f"line {rows[0][0]}: 1 column; there must be two at least, with {between} between")
        head = [self._cells(line) for _, line in rows[: self._above(rows, width)]]
        self._numbers = [number for number, _ in rows[len(head) :]]
        self._table = [line for _, line in rows[len(head) :]]
        self._refuse_few(self._numbers)
        if not head and self._numbers[0] > skipped + 1:
            # numpy.savetxt writes the names as a comment.
            head = [self._cells(lines[self._numbers[0] - 2].lstrip("# "))]
            if len(head[0]) != width or not all(map(self._is_text, head[0])):
                head = []
        headings = [_NAME_AND_UNIT.fullmatch(cell) for cell in head[0]] if head else []
        #: Names of the columns, none where the file has none.
        self.names = [name[1] for name in headings if name]
        #: Their units, "" where the file has none.
        self.units = [name[2] or name[3] or "" for name in headings if name] or [""] * width
        if len(head) > 1:
            self.units = [cell.strip("[]()") for cell in head[1]]
        #: Names of the columns, or their numbers.
        self.labels = self.names or [str(k + 1) for k in range(width)]
        #: Number of the column of times, from 0.
        self.time = self._time_column()

    @staticmethod
    def _refuse_few(lines: Sequence[Any]) -> None:
        if len(lines) < 2:
            raise ValueError(f"{len(lines)} lines with numbers; there must be two at least")

    def _text(self, content: bytes) -> str:
        """Return the text of a file. Raises ValueError if it is not in its encoding."""
        marked = next((encoding for mark, encoding in _MARKS.items() if content.startswith(mark)), None)
        encoding = self._reading.encoding or marked or "utf-8"
        if encoding in ("utf-8", "latin-1"):
            if _NO_TEXT.search(content):
                raise ValueError("it is no text; export the measurement as text, with numbers in columns")
            if b"\0" in content:
                raise ValueError(f'it is no text in {encoding}; give its encoding, as encoding = "utf-16-le"')
        try:
            return content.decode(encoding).removeprefix("\ufeff")
        except UnicodeDecodeError as error:
            line = content.count(b"\n", 0, error.start) + 1
            what = f"line {line}: it is no text in {encoding} (byte {content[error.start]:#04x})"
            raise ValueError(f'{what}; give its encoding, as encoding = "latin-1"') from error

    def _cells(self, line: str) -> list[str]:
        """Return the cells of a line."""
        if self._mark == " ":
            return _CELL.findall(line)
        return [cell.strip() for cell in next(csv.reader([line], delimiter=self._mark), [])]

    def _is_number(self, cell: str) -> bool:
        with suppress(ValueError):
            float(cell.replace(self._reading.decimal, "."))
            return True
        return False

    def _is_text(self, cell: str) -> bool:
        """Return whether a cell is neither a number nor a missing value."""
        return not self._is_number(cell) and cell.lower() not in _NOTHING

    def _above(self, rows: list[tuple[int, str]], width: int) -> int:
        """Return how many of ``rows`` stand above the numbers: 1 with names, 2 with units, else 0.

        Raises ValueError if there are others.
        """
        first = [self._cells(line) for _, line in rows[:_MOST_ABOVE]]
        numbers = (k for k, cells in enumerate(first) if len(cells) == width and not any(map(self._is_text, cells)))
        start = next(numbers, 1)
        in_brackets = start > 1 and all(map(_UNIT.fullmatch, first[start - 1]))
        names = start - 1 - (self._reading.units_row or in_brackets)
        if names < 0:
            if self._reading.units_row:
                raise ValueError("units_row: the first line must name the columns, and the second one have their units")
            return 0
        cells = first[names]
        if len(cells) == width and not self._is_text(cells[0]) and any(map(self._is_number, cells)):
            return 0  # a value that is no number
        if len(cells) != width:
            names += 1
        if names > 0:
            above = f"line {rows[0][0]}: {rows[0][1][:40]!r} is above the table"
            begin = rows[names][0]
            units = f", or units_row = true, if line {begin} has the units" if names == 1 and start == 2 else ""
            raise ValueError(f"{above}; skip_lines = {begin - 1} leaves out what is above line {begin}{units}")
        return start

    def _time_column(self) -> int:
        """Return the number of the column of times."""
        wanted = self._reading.time_column
        if wanted is None:
            return next((k for k, name in enumerate(self.names) if name.lower() in _TIMES), 0)
        if wanted in self.names:
            return self.names.index(wanted)
        if wanted.isdecimal() and 0 < int(wanted) <= len(self.labels):
            return int(wanted) - 1
        raise ValueError(f"time_column = {wanted!r}: there are the columns {', '.join(self.labels)}")

    def read(self, wanted: Mapping[int, str], along: str = "s") -> "tuple[np.ndarray, dict[int, np.ndarray]]":
        """Return the times [s], ascending, shape (n,), and columns by their numbers, shapes (n,).

        ``wanted`` are the units of the result by number of the column; "" leaves a column as it is. ``along`` is the
        unit of the times, or of another quantity in their place. `notes` then has the changes made to the data.
        """
        units = {self.time: along, **wanted}
        factors = [self._factor(k, unit) for k, unit in units.items()]
        values = self._ascending(self._present(self._values(list(units))))
        if self._reading.missing == "interpolate":
            values = self._interpolated(values)
        if values.shape[1] < 2:
            raise ValueError(f"{values.shape[1]} lines are left; there must be two at least")
        values *= np.array(factors)[:, None]
        return values[0], dict(zip(wanted, values[1:], strict=True))

    def _factor(self, k: int, wanted: str) -> float:
        """Return the factor of column ``k`` to the unit ``wanted``; one without a unit has it already."""
        label = f"column {self.labels[k]}"
        if not wanted:
            return 1.0
        if not self.units[k]:
            self.notes.append(f"{label} has no unit: {wanted} is assumed")
            return 1.0
        try:
            return factor(self.units[k], wanted)
        except ValueError as error:
            remedy = "; if another column has the times, name it as time_column" if k == self.time else ""
            raise ValueError(f"{label}: {error}{remedy}") from error

    def _values(self, wanted: list[int]) -> "np.ndarray":
        """Return columns as they are, shape (columns, lines), the first of which is the time; NaN where one is missing.

        Raises ValueError if a cell is no number, or misses and must not.
        """
        import pyarrow as arrow  # takes a tenth of a second: only if there is a file
        from pyarrow import csv as arrow_csv

        columns = [str(k) for k in range(len(self.labels))]
        names = [str(k) for k in wanted]
        blanks = self._mark == " "
        mark = "\t" if blanks else self._mark
        around = re.compile(r"\s+" if blanks else rf"[^\S\t]*{mark}[^\S\t]*")
        odd: list[tuple[int, int]] = []

        def skip(row: Any) -> str:
            odd.append((row.number, row.actual_columns))
            return "skip"

        trouble = ""
        try:
            table = arrow_csv.read_csv(
                BytesIO("\n".join(around.sub(mark, line) for line in self._table).encode()),
                arrow_csv.ReadOptions(use_threads=False, column_names=columns),
                arrow_csv.ParseOptions(delimiter=mark, invalid_row_handler=skip),
                arrow_csv.ConvertOptions(
                    column_types=dict.fromkeys(names, arrow.float64()),
                    include_columns=names,
                    null_values=[*_NOTHING, *map(str.upper, _NOTHING), "NaN"],
                    decimal_point=self._reading.decimal,
                ),
            )
        except arrow.ArrowInvalid as error:
            trouble = str(error)
        if odd:
            row, number = odd[0]
            raise ValueError(
                f"line {self._numbers[row - 1]}: {number} columns; there must be {len(columns)} as in other lines"
            )
        if trouble:
            raise ValueError(self._in_words(trouble))
        values = np.array([column.to_numpy() for column in table.columns])
        for k, row in np.argwhere(~np.isfinite(values)).tolist():
            place = self._place(row, wanted[k])
            if np.isinf(values[k, row]):
                raise ValueError(f"{place}: is infinite; leave the line out, or begin it with #")
            if self._reading.missing == "refuse":
                remedy = 'missing = "drop" leaves such lines out, "interpolate" fills them'
                raise ValueError(f"{place}: the value is missing; {remedy}")
            if self._reading.missing == "interpolate" and k == 0:
                raise ValueError(f'{place}: the time is missing, and cannot be interpolated; use missing = "drop"')
        return values

    def _place(self, row: int, k: int) -> str:
        """Return line and column of a value in words."""
        return f"line {self._numbers[row]}, column {self.labels[k]}"

    def _in_words(self, trouble: str) -> str:
        """Return an error of pyarrow, which is about a cell that is no number, with its place and a remedy."""
        match = _NO_NUMBER.search(trouble)
        if match is None:
            return trouble
        place = self._place(int(match[2]) - 1, int(match[1]))
        remedy = "leave the line out, or begin it with #"
        if "," in match[3] or (self._mark == "," and " " in match[3]):
            remedy = 'decimals have a point, or give decimal = ","'
        return f"{place}: {match[3][:40]!r} is not a finite number; {remedy}"

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
            place = f"line {self._numbers[row]}: time {times[np.argmax(late)]:.12g}"
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


@lru_cache(maxsize=16)
def curve_of(path: Path, modified: int, interpolation: str, unit: str, reading: Reading) -> "tuple[PPoly, list[str]]":
    """Return a file of two columns, time [s] and value in ``unit``, as a curve, and notes; ``modified`` is its time.

    Raises ValueError if it is no such file.
    """
    recorded = Recorded(path, reading)
    if len(recorded.units) != 2:
        raise ValueError(f"{len(recorded.units)} columns; a table has two, time and value")
    value = 1 - recorded.time
    times, columns = recorded.read({value: unit})
    values = columns[value]
    notes = recorded.notes
    from scipy.interpolate import CubicSpline, PPoly  # takes half a second to load: only if there is a table

    if interpolation == "cubic":
        spline = CubicSpline(times, values)
        return PPoly(spline.c, spline.x), notes
    return PPoly(np.array([np.diff(values) / np.diff(times), values[:-1]]), times), notes
