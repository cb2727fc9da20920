"""The published values of docs/published.md: ours are as close as each line says, and the page tells them."""

import importlib
from math import isnan
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"


def test_published_values_are_met_and_the_page_tells_them(monkeypatch):
    """The bounds are relative, each with its reason in docs/published.py."""
    monkeypatch.syspath_prepend(DOCS)
    published = importlib.import_module("published")
    lines = list(published.lines())
    for line in lines:
        assert isnan(line.theirs) or line.ours == pytest.approx(line.theirs, rel=line.bound, abs=0.0), line
    page = (DOCS / "published.md").read_text(encoding="utf-8")
    assert "\n".join(published.table(published.HEAD, map(published.written, lines))) in page
