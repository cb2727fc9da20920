"""What was found: for programs, for a terminal as tables of one look, and as CSV and Parquet files."""

from __future__ import annotations

import csv
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from rich.table import Table
from rich.text import Text

_DPI = 110

#: Columns of a row by name.
Row = dict[str, Any]


@dataclass(frozen=True)
class Findings:
    """What a command or a study has found."""

    document: Any = None  #: for programs (``--json``)
    shown: Sequence[Any] = ()  #: tables and lines for a terminal
    files: Sequence[tuple[str, Any]] = ()  #: where files are, each with a word before it
    where: Path | None = None  #: the place of all of them (``--quiet``)
    code: int = 0  #: exit code of the command
    error: str = ""  #: why, in words
    draw: Callable[[], Findings] | None = None  #: draws pictures, which takes a while, and says where they are
    #: What belongs into a directory, by the names of the files: tables, each as CSV and Parquet; texts; and pictures,
    #: which are drawn where they are wanted.
    tables: Mapping[str, Sequence[Row]] = field(default_factory=dict)
    texts: Mapping[str, str] = field(default_factory=dict)
    pictures: Mapping[str, Callable[[], Any]] = field(default_factory=dict)

    def written(self, directory: Path, *, pictures: bool) -> Findings:
        """Write tables, texts, and with ``pictures`` these into ``directory``; return the findings with the files."""
        files = []
        for name, rows in self.tables.items():
            path = directory / name
            files += [write_csv(path.with_suffix(".csv"), rows), write_parquet(path.with_suffix(".parquet"), rows)]
        for name, text in self.texts.items():
            (directory / name).write_text(text, encoding="utf-8")
        for name, draw in self.pictures.items() if pictures else ():
            files.append(directory / f"{name}.png")
            draw().savefig(files[-1], dpi=_DPI)
        document = {"directory": directory, "files": files, **self.document}
        return replace(self, document=document, files=[("results", file) for file in files], where=directory)


def table(columns: Sequence[str], rows: Iterable[Sequence[str]], title: str = "", words: Collection[str] = ()) -> Table:
    """Return a table: the first column and those named in ``words`` hold words, which may wrap, the others numbers."""
    made = Table(box=None, pad_edge=False, header_style="bold", title=title or None, title_justify="left")
    for k, name in enumerate(columns):
        left = k == 0 or name in words
        made.add_column(Text(name), justify="left" if left else "right", overflow="fold")
    for row in rows:
        made.add_row(*map(Text, row))
    return made


def number(value: float | None, form: str, lacking: str = "") -> str:
    """Return a number as ``form`` says, or ``lacking`` where there is none."""
    return lacking if value is None else format(value, form)


def write_csv(path: Path, rows: Sequence[Row]) -> Path:
    """Write rows, ``None`` left empty, and return the path."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, _names(rows))
        writer.writeheader()
        writer.writerows(rows)
    return path


def write_parquet(path: Path, rows: Sequence[Row]) -> Path:
    """Write rows, ``None`` as null, and return the path; a column without any value is one of numbers."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = {name: pa.array([row.get(name) for row in rows]) for name in _names(rows)}
    lacking = {name: column.cast(pa.float64()) for name, column in columns.items() if pa.types.is_null(column.type)}
    pq.write_table(pa.table(columns | lacking), path)
    return path


def _names(rows: Sequence[Row]) -> list[str]:
    return list(dict.fromkeys(name for row in rows for name in row))
