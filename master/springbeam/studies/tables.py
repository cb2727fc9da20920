"""Findings: for programs, for a terminal as tables of one format, and as CSV and Parquet files."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from io import BytesIO, StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from rich.console import Console
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

_DPI = 110
#: Most characters of a name that is not wrapped.
_NAME = 40
#: Width of printed findings [characters].
_WIDTH = 120

#: Columns of a row by name.
Row = dict[str, Any]
#: Called when a part of a study is done, for a progress bar.
Done = Callable[[], object]


def unseen() -> None:
    """Do nothing when a part is done: nobody watches."""


@dataclass(frozen=True, repr=False)
class Findings:
    """The findings of a command or a study; printed, they are what the command prints."""

    document: Any = None  #: for programs (``--json``)
    shown: Sequence[Any] = ()  #: tables and lines for a terminal
    files: Sequence[tuple[str, Any]] = ()  #: paths of files, each after a word
    where: Path | None = None  #: directory of all of them (``--quiet``)
    code: int = 0  #: exit code of the command
    error: str = ""  #: why, in words
    draw: Callable[[], Findings] | None = None  #: draws pictures, and returns their paths
    #: Files of the directory by name: tables, each as CSV and Parquet; texts; and pictures, drawn on demand.
    tables: Mapping[str, Sequence[Row]] = field(default_factory=dict)
    texts: Mapping[str, str] = field(default_factory=dict)
    pictures: Mapping[str, Callable[[], Any]] = field(default_factory=dict)

    def with_lines(self, before: Sequence[str], after: Sequence[str]) -> Findings:
        """Return the findings with more lines to show."""
        return replace(self, shown=[*before, *self.shown, *after])

    @property
    def ok(self) -> bool:
        """Whether the command would end with the exit code 0."""
        return self.code == 0

    @property
    def table(self) -> DataFrame | Sequence[Row]:
        """The first of `tables`, as a pandas DataFrame where pandas is installed."""
        rows = next(iter(self.tables.values()), ())
        try:
            from pandas import DataFrame
        except ImportError:
            return rows
        return DataFrame(rows)

    def plot(self) -> Figure:
        """Return the first of `pictures` as a matplotlib Figure. Raises ValueError if there is none."""
        for draw in self.pictures.values():
            return draw()
        raise ValueError("there is nothing to draw")

    def __repr__(self) -> str:
        console = Console(file=StringIO(), width=_WIDTH, color_system=None)
        for part in self.shown:
            console.print(part, highlight=False, soft_wrap=True)
        text: str = console.file.getvalue()  # type: ignore[attr-defined]
        return text.rstrip()

    def written(self, directory: Path, *, pictures: bool) -> Findings:
        """Write tables, texts, and with ``pictures`` these into ``directory``; return the findings with the files."""
        files = []
        for name, rows in self.tables.items():
            path = directory / name
            files += [write_csv(path.with_suffix(".csv"), rows), write_parquet(path.with_suffix(".parquet"), rows)]
        for name, text in self.texts.items():
            files.append(directory / name)
            files[-1].write_text(text, encoding="utf-8")
        for name, draw in self.pictures.items() if pictures else ():
            files.append(directory / f"{name}.png")
            draw().savefig(files[-1], dpi=_DPI)
        document = {"directory": directory, "files": files, **self.document}
        return replace(self, document=document, files=[("results", file) for file in files], where=directory)


def table(columns: Sequence[str], rows: Iterable[Sequence[Any]], title: str = "") -> Table:
    """Return a table whose ``columns`` are headings: of words, which may wrap, or with a colon of numbers.

    What stands behind the colon is the format of floating-point numbers, as in ``error [m]:.1e``.
    """
    shown = Table(box=None, pad_edge=False, header_style="bold", title=title or None, title_justify="left")
    forms = []
    rows = list(rows)
    for number, column in enumerate(columns):
        heading, colon, form = column.rpartition(":")
        # Names are not cut: other columns wrap.
        name = not colon and all(len(str(row[number])) <= _NAME and " " not in str(row[number]) for row in rows)
        justify: Literal["left", "right"] = "right" if colon else "left"
        shown.add_column(Text(heading if colon else column), justify=justify, overflow="fold", no_wrap=name)
        forms.append(form)
    for row in rows:
        shown.add_row(*(Text(in_words(value, form)) for value, form in zip(row, forms, strict=True)))
    return shown


def in_words(value: Any, form: str) -> str:
    """Return the text of a cell: "" for ``None``, floating-point numbers in ``form``, the elements of a list."""
    if isinstance(value, float):
        return format(value, form)
    return (
        ", ".join(in_words(v, form) for v in value) if isinstance(value, list) else str("" if value is None else value)
    )


def difference(first: float | None, second: float | None) -> float | None:
    """Return ``first`` − ``second``, ``None`` where one is lacking."""
    return None if first is None or second is None else first - second


def write_csv(path: Path, rows: Sequence[Row]) -> Path:
    """Write rows, ``None`` left empty, and return the path."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, _names(rows))
        writer.writeheader()
        writer.writerows(rows)
    return path


def write_parquet(path: Path, rows: Sequence[Row]) -> Path:
    """Write rows, ``None`` as null, and return the path; a column without any value is one of numbers.

    By way of JSON: before it looks at a list, pyarrow loads pandas where there is one, which takes a second. Of JSON it
    would take texts that look like times for times.
    """
    import pyarrow as pa
    import pyarrow.json
    import pyarrow.parquet
    from pydantic_core import to_json

    content = pa.table({})
    if rows:
        lines = [to_json(row, inf_nan_mode="constants", fallback=lambda value: value.tolist()) for row in rows]
        names = _names(rows)
        given = {name: [row[name] for row in rows if row.get(name) is not None] for name in names}
        texts = [(name, pa.string()) for name in names if any(isinstance(value, str) for value in given[name])]
        empty = [(name, pa.float64()) for name in names if not given[name]]
        as_given = pa.json.ParseOptions(explicit_schema=pa.schema([*texts, *empty]))
        content = pa.json.read_json(BytesIO(b"\n".join(lines)), parse_options=as_given).select(names)
    pa.parquet.write_table(content, path)
    return path


def _names(rows: Sequence[Row]) -> list[str]:
    return list(dict.fromkeys(name for row in rows for name in row))
