"""Tables and pictures in the pages, for the scripts beside this one and `tests/bench`."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

DOCS = Path(__file__).parent
IMAGES = DOCS / "images"


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Return the lines of a table in Markdown."""
    return [_row(head), "|---" * len(head) + "|", *map(_row, rows)]


def _row(cells: Sequence[str]) -> str:
    return "|" + "|".join(f" {cell} " if cell else " " for cell in cells) + "|"


def write_section(page: str, name: str, lines: Iterable[str]) -> None:
    """Put ``lines`` into the page, between ``<!-- NAME: who writes it -->`` and ``<!-- end of NAME -->``."""
    path = DOCS / page
    marks = rf"(<!-- {re.escape(name)}: [^>]*-->\n).*?(<!-- end of {re.escape(name)} -->)"
    content = "".join(f"{line}\n" for line in lines)
    text, count = re.subn(marks, lambda m: m[1] + content + m[2], path.read_text(encoding="utf-8"), flags=re.S)
    if count != 1:
        raise SystemExit(f"{path}: {count} places for {name}, wanted is one")
    path.write_text(text, encoding="utf-8")


def shrink(picture: Path) -> None:
    """Reduce a PNG file to 64 colours: a fifth of its size."""
    from PIL import Image

    Image.open(picture).quantize(64).save(picture, optimize=True)
