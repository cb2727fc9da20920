"""``springbeam verify``."""

from __future__ import annotations

from dataclasses import asdict

import typer

from .common import DISAGREES, JsonOption, bad_input_reported, console_for, print_json


def verify(as_json: JsonOption = False) -> None:
    """Check the FMUs against exact solutions. Exit code 1 if a check fails.

    Example: springbeam verify
    """
    from ..studies import verify as checks
    from ..studies.verify.table import report

    with bad_input_reported():
        if as_json:
            sections = list(checks.verify())
            passed = all(check.passed is not False for _, section in sections for check in section)
            described = [
                {"title": title, "checks": [{**asdict(c), "error": c.error, "passed": c.passed} for c in section]}
                for title, section in sections
            ]
            print_json({"passed": passed, "sections": described})
        else:
            passed = report(console_for(silent=False))
    if not passed:
        raise typer.Exit(DISAGREES)
