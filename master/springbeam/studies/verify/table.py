"""The comparison as tables on a console."""

from __future__ import annotations

from collections.abc import Iterable
from math import isnan
from time import perf_counter

from rich.console import Console
from rich.table import Table
from rich.text import Text

from .check import Check, Section


def report(sections: Iterable[Section], console: Console) -> dict[str, list[Check]]:
    """Print each section's table as it comes and a last line that counts; return the checks by title."""
    began, found = perf_counter(), dict[str, list[Check]]()
    for section in sections:
        checks = found[section.title] = list(section())
        console.print(Text(section.title, style="bold"))
        console.print(_table(checks))
        console.print(_footnotes(checks))
        console.print()
    verdicts = [check.passed for checks in found.values() for check in checks]
    counts = f"{verdicts.count(True)} passed, {verdicts.count(False)} failed, {verdicts.count(None)} reported without"
    console.print(f"{counts} judgement; {perf_counter() - began:.0f} s")
    return found


def _table(section: list[Check]) -> Table:
    notes = _reasons(section)
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="bold")
    table.add_column("quantity", no_wrap=True, min_width=30)
    for heading, width in (("exact", 11), ("computed", 11), ("error", 8), ("bound", 7)):
        table.add_column(heading, justify="right", no_wrap=True, min_width=width)
    table.add_column("", no_wrap=True)
    for check in section:
        verdict = {True: Text("pass"), False: Text("FAIL", style="bold red"), None: Text("–")}[check.passed]
        table.add_row(
            Text(check.quantity),
            _number(check.exact, ".6g"),
            _number(check.computed, ".6g"),
            _number(check.error, ".1e"),
            _number(check.bound, ".1e"),
            verdict.append(f" {notes[check.reason]}"),
        )
    return table


def _reasons(section: list[Check]) -> dict[str, str]:
    """Return the footnotes: reason → letter."""
    return {reason: chr(ord("a") + i) for i, reason in enumerate(dict.fromkeys(c.reason for c in section))}


def _footnotes(section: list[Check]) -> Table:
    notes = Table.grid(padding=(0, 1))
    for reason, mark in _reasons(section).items():
        notes.add_row(Text(mark), Text(reason))
    return notes


def _number(value: float | None, form: str) -> str:
    if value is None:
        return "–"
    return "nan" if isnan(value) else f"{value:{form}}"
