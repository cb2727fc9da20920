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

from ..studies.tables import number, table
from .common import DISAGREES, JsonOption, bad_input_reported, console_for, print_json

if TYPE_CHECKING:
    from ..studies.verify.check import Check, Section


_COLUMNS = ("quantity", "exact", "computed", "error", "bound", "")


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
        reasons = dict.fromkeys(check.reason for check in checks)
        marks = dict(zip(reasons, "abcdefghijklmnopqrstuvwxyz", strict=False))
        console.print(table(_COLUMNS, [_row(check, marks) for check in checks], section.title))
        notes = Table.grid(padding=(0, 1))
        for reason, mark in marks.items():
            notes.add_row(Text(mark), Text(reason))
        console.print(notes, "")
    verdicts = [check.passed for checks in found.values() for check in checks]
    counts = f"{verdicts.count(True)} passed, {verdicts.count(False)} failed"
    console.print(f"{counts}; {perf_counter() - began:.0f} s")
    return found


def _row(check: Check, marks: dict[str, str]) -> tuple[str, ...]:
    """Return a check in words, with the mark of its reason."""
    numbers = ((check.exact, ".6g"), (check.computed, ".6g"), (check.error, ".1e"), (check.bound, ".1e"))
    verdict = f"{'pass' if check.passed else 'FAIL'} {marks[check.reason]}"
    return check.quantity, *(number(value, form, "–") for value, form in numbers), verdict
