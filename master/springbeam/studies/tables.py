"""Tables for a terminal, all of one look."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

from rich.table import Table
from rich.text import Text


def table(columns: Sequence[str], rows: Iterable[Sequence[str]], title: str = "", words: Collection[str] = ()) -> Table:
    """Return a table: the first column and those named in ``words`` hold words, the others numbers, on the right."""
    made = Table(box=None, pad_edge=False, header_style="bold", title=title or None, title_justify="left")
    for k, name in enumerate(columns):
        left = k == 0 or name in words
        made.add_column(Text(name), justify="left" if left else "right", no_wrap=k > 0, overflow="fold")
    for row in rows:
        made.add_row(*map(Text, row))
    return made
