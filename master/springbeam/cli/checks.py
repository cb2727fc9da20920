"""``springbeam crosscheck`` and ``springbeam verify``."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table
from rich.text import Text

from ..bodies.protocol import FmuError
from ..results.trajectory import COLUMN_UNITS
from ..scene import load_scene
from .common import (
    BAD_INPUT,
    DISAGREES,
    STOPPED,
    JsonOption,
    SceneArgument,
    SettingsOption,
    bad_input_reported,
    console_for,
    fail,
    print_json,
)
from .run import picked, picked_in_words

if TYPE_CHECKING:
    from ..studies.crosscheck import OrderRow, Report


def crosscheck(
    scene: SceneArgument,
    settings: SettingsOption = None,
    with_orders: Annotated[
        bool, typer.Option("--orders", help="Repeat the run at H/2, H/4, H/8; print observed orders instead.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="PNG", help="Draw both runs and their errors into this file."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compare the co-simulation with the monolithic reference of its law. Exit code 1 if they disagree.

    Example: springbeam crosscheck soft --set coupling.scheme=hermite --set coupling.degree=2 --orders
    """
    from ..monolithic.event_driven import ReferenceFailure
    from ..run.outcome import RunStopped
    from ..studies.crosscheck import crosscheck as compare
    from ..studies.crosscheck import orders
    from ..studies.crosscheck.picture import draw

    console = console_for(silent=as_json)
    with bad_input_reported():
        what = load_scene(scene, settings or ())
        made = picked(what)
        if made is not None:
            what, how = made.scene, picked_in_words(made.summary["accuracy"])
            console.print(Text(f"accuracy {how}"))
        try:
            if with_orders:
                found = orders(what)
                if as_json:
                    print_json({"orders": [asdict(row) for row in found]})
                console.print(_orders_table(found))
                return
            report = compare(what)
        except FmuError as error:
            fail(BAD_INPUT, str(error))
        except (RunStopped, ReferenceFailure) as error:
            fail(STOPPED, str(error))
        if out is not None:
            draw(report, out)
    if as_json:
        print_json(_as_json(report))
    for note in report.notes:
        console.print(Text(note))
    console.print(_error_table(report))
    if report.events:
        console.print(_event_errors_table(report))
    begin, end = report.trajectory["time"][0], report.trajectory["time"][-1]
    console.print(Text(
        f"comparable from {begin:.9g} to {report.horizon:.9g} s of {end:.9g} s; there a perturbation of the reference "
        f"has grown {report.growth:.3g} times"
    ))  # fmt: skip
    console.print(Text("passed" if report.passed else "FAILED", style="bold green" if report.passed else "bold red"))
    if not report.passed:
        raise typer.Exit(DISAGREES)


def verify(as_json: JsonOption = False) -> None:
    """Check the FMUs against exact solutions. Exit code 1 if a check fails.

    Example: springbeam verify
    """
    from ..studies import verify as checks
    from ..studies.verify.table import report

    try:
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
    except FmuError as error:
        fail(BAD_INPUT, str(error))
    if not passed:
        raise typer.Exit(DISAGREES)


def _as_json(report: Report) -> dict[str, Any]:
    rows = [
        {"quantity": r.quantity, "error": r.error, "at": r.at, "l2": r.l2, "bound": r.bound, "passed": r.passed}
        for r in report.rows
    ]
    return {
        "passed": report.passed,
        "horizon": report.horizon,
        "growth": report.growth,
        "quantities": rows,
        "events": [asdict(event) for event in report.events],
        "notes": report.notes,
        "scene": report.scene.model_dump(exclude_none=True),
    }


def _error_table(report: Report) -> Table:
    table = Table("quantity", box=None, pad_edge=False, header_style="bold")
    for name in ("max error", "at t [s]", "L2 error", "bound", ""):
        table.add_column(Text(name), justify="right", no_wrap=True)
    for row in report.rows:
        verdict, unit = "ok" if row.passed else "FAILED", COLUMN_UNITS[row.quantity]
        numbers = (f"{row.error:.2e}", f"{row.at:.6g}", f"{row.l2:.1e}", f"{row.bound:.1e}")
        table.add_row(Text(f"{row.quantity} [{unit}]"), *numbers, verdict)
    return table


def _event_errors_table(report: Report) -> Table:
    table = Table("contact", box=None, pad_edge=False, header_style="bold")
    for name in ("t [s]", "reference [s]", "error [s]", "bound [s]", ""):
        table.add_column(Text(name), justify="right", no_wrap=True)
    for row in report.events:
        error, verdict = row.time - row.reference, "ok" if row.passed else "FAILED"
        table.add_row(
            row.kind, f"{row.time:.10f}", f"{row.reference:.10f}", f"{error:.1e}", f"{row.bound:.1e}", verdict
        )
    return table


def _orders_table(rows: list[OrderRow]) -> Table:
    table = Table(
        "phase",
        r"from \[s]",
        "quantity",
        box=None,
        pad_edge=False,
        header_style="bold",
        title="max errors at H, H/2, …",
        title_justify="left",
    )
    count = len(rows[0].errors) if rows else 0
    for column in table.columns:
        column.no_wrap = True
    for k in range(count):
        table.add_column(f"H/{2**k}" if k else "H", justify="right", no_wrap=True)
    table.add_column("orders", justify="right", no_wrap=True)
    for row in rows:
        observed = " ".join(f"{order:.1f}" for order in row.orders)
        table.add_row(row.phase, f"{row.begin:.4f}", row.quantity, *[f"{error:.1e}" for error in row.errors], observed)
    return table
