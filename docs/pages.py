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


def with_section(text: str, name: str, lines: Iterable[str]) -> str:
    """Return a page with ``lines`` between ``<!-- NAME: who writes it -->`` and ``<!-- end of NAME -->``."""
    marks = rf"(<!-- {re.escape(name)}: [^>]*-->\n).*?(<!-- end of {re.escape(name)} -->)"
    content = "".join(f"{line}\n" for line in lines)
    text, count = re.subn(marks, lambda m: m[1] + content + m[2], text, flags=re.S)
    if count != 1:
        raise SystemExit(f"{count} places for {name} in the page, wanted is one")
    return text


def write_section(page: str, name: str, lines: Iterable[str]) -> None:
    """Write ``lines`` into a page of this folder, as `with_section` does."""
    path = DOCS / page
    path.write_text(with_section(path.read_text(encoding="utf-8"), name, lines), encoding="utf-8")


def shrink(picture: Path) -> None:
    """Reduce a PNG file to 64 colours: a fifth of its size."""
    from PIL import Image

    Image.open(picture).quantize(64).save(picture, optimize=True)
