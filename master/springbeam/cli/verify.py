"""``springbeam verify``."""

from __future__ import annotations

from dataclasses import asdict

import typer

from .common import DISAGREES, JsonOption, bad_input_reported, console_for, print_json


def verify(as_json: JsonOption = False) -> None:
    """Check the FMUs against exact solutions. Exit code 1 if a check fails.

    Example: springbeam verify
    """
    from ..studies.verify import SECTIONS
    from ..studies.verify.table import report

    with bad_input_reported():
        found = report(SECTIONS, console_for(silent=as_json))
    passed = all(check.passed is not False for checks in found.values() for check in checks)
    if as_json:
        described = [
            {"title": title, "checks": [{**asdict(c), "error": c.error, "passed": c.passed} for c in checks]}
            for title, checks in found.items()
        ]
        print_json({"passed": passed, "sections": described})
    if not passed:
        raise typer.Exit(DISAGREES)
