"""Tables of what was found: for a terminal, all of one look, and as CSV files."""

from __future__ import annotations

import csv
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.table import Table
from rich.text import Text


def table(columns: Sequence[str], rows: Iterable[Sequence[str]], title: str = "", words: Collection[str] = ()) -> Table:
    """Return a table: the first column and those named in ``words`` hold words, which may wrap, the others numbers."""
    made = Table(box=None, pad_edge=False, header_style="bold", title=title or None, title_justify="left")
    for k, name in enumerate(columns):
        left = k == 0 or name in words
        made.add_column(Text(name), justify="left" if left else "right", no_wrap=not left, overflow="fold")
    for row in rows:
        made.add_row(*map(Text, row))
    return made


def number(value: float | None, form: str, lacking: str = "") -> str:
    """Return a number as ``form`` says, or ``lacking`` where there is none."""
    return lacking if value is None else format(value, form)


def write_csv(path: Path, rows: Sequence[Mapping[str, Any]]) -> Path:
    """Write rows with the keys of the first as header, ``None`` and NaN left empty; return the path."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]) if rows else [])
        writer.writeheader()
        writer.writerows({name: None if value != value else value for name, value in row.items()} for row in rows)
    return path
