"""``springbeam verify``."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from time import perf_counter
from typing import TYPE_CHECKING

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..studies.tables import number
from .common import DISAGREES, JsonOption, bad_input_reported, console_for, print_json

if TYPE_CHECKING:
    from ..studies.verify.check import Check, Section


def verify(as_json: JsonOption = False) -> None:
    """Check the FMUs against exact solutions. Exit code 1 if a check fails.

    Example: springbeam verify
    """
    from ..studies.verify import SECTIONS

    with bad_input_reported():
        found = report(SECTIONS, console_for(silent=as_json))
    passed = all(check.passed for checks in found.values() for check in checks)
    if as_json:
        described = [
            {"title": title, "checks": [{**asdict(c), "error": c.error, "passed": c.passed} for c in checks]}
            for title, checks in found.items()
        ]
        print_json({"passed": passed, "sections": described})
    if not passed:
        raise typer.Exit(DISAGREES)


def report(sections: Iterable[Section], console: Console) -> dict[str, list[Check]]:
    """Print each section's table as it comes and a last line that counts; return the checks by title."""
    began = perf_counter()
    found: dict[str, list[Check]] = {}
    for section in sections:
        checks = found[section.title] = list(section())
        console.print(Text(section.title, style="bold"))
        marks = {reason: chr(ord("a") + i) for i, reason in enumerate(dict.fromkeys(c.reason for c in checks))}
        console.print(_table(checks, marks))
        notes = Table.grid(padding=(0, 1))
        for reason, mark in marks.items():
            notes.add_row(Text(mark), Text(reason))
        console.print(notes)
        console.print()
    verdicts = [check.passed for checks in found.values() for check in checks]
    counts = f"{verdicts.count(True)} passed, {verdicts.count(False)} failed"
    console.print(f"{counts}; {perf_counter() - began:.0f} s")
    return found


def _table(checks: list[Check], marks: dict[str, str]) -> Table:
    """Return a row per check, with the mark of its reason."""
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="bold")
    table.add_column("quantity", no_wrap=True, min_width=30)
    for heading, width in (("exact", 11), ("computed", 11), ("error", 8), ("bound", 7)):
        table.add_column(heading, justify="right", no_wrap=True, min_width=width)
    table.add_column("", no_wrap=True)
    for check in checks:
        verdict = Text("pass") if check.passed else Text("FAIL", style="bold red")
        table.add_row(
            Text(check.quantity),
            *(number(value, ".6g", "–") for value in (check.exact, check.computed)),
            *(number(value, ".1e", "–") for value in (check.error, check.bound)),
            verdict.append(f" {marks[check.reason]}"),
        )
    return table
