"""``springbeam crosscheck`` and ``springbeam verify``."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table
from rich.text import Text

from ..results.trajectory import COLUMN_UNITS
from ..scene import load_scene, with_changes
from .common import (
    DISAGREES,
    STOPPED,
    ForceOption,
    JsonOption,
    SceneArgument,
    SettingsOption,
    bad_input_reported,
    console_for,
    fail,
    print_json,
)
from .run import picked
from .study import carry_out
from .summary import picked_in_words

if TYPE_CHECKING:
    from ..studies.crosscheck import Report


def crosscheck(
    scene: SceneArgument,
    settings: SettingsOption = None,
    with_orders: Annotated[
        bool, typer.Option("--orders", help="Repeat the run at H/2, H/4, H/8; print observed orders instead.")
    ] = False,
    quick: Annotated[
        bool, typer.Option("--quick", help="Compare only the first quarter of the time; with --orders, not H/8.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="PATH",
            help="Draw both runs and their errors into this file; with --orders the directory of the results.",
        ),
    ] = None,
    force: ForceOption = False,
    as_json: JsonOption = False,
) -> None:
    """Compare the co-simulation with the monolithic reference of its law. Exit code 1 if they disagree.

    Example: springbeam crosscheck soft --set coupling.scheme=hermite --set coupling.degree=2 --orders
    """
    from ..monolithic.hybrid_system import ReferenceFailure
    from ..run.outcome import RunStopped
    from ..studies.crosscheck import Orders
    from ..studies.crosscheck import crosscheck as compare
    from ..studies.crosscheck.picture import draw
    from ..studies.reference import refuse_without_reference

    console = console_for(silent=as_json)
    with bad_input_reported():
        what = load_scene(scene, settings or ())
        made = picked(what)
        if made is not None:
            what, how = made.scene, picked_in_words(made.summary["accuracy"])
            console.print(Text(f"accuracy {how}"))
        if with_orders:
            carry_out(Orders(scene=what, quick=quick), scene, out=out, force=force, as_json=as_json)
            return
        if quick:
            start = what.contact_time or 0.0
            what = with_changes(what, time={"t_end": start + 0.25 * (what.time.t_end - start)})
        if what.contact.law != "paper":
            refuse_without_reference(what)
            console.print("2 runs and 2 references, more where the motion is not resolved")
        try:
            report = compare(what)
        except (RunStopped, ReferenceFailure) as error:
            fail(STOPPED, str(error))
        if out is not None:
            draw(report, out)
    if as_json:
        print_json(_as_json(report))
    for part in (*map(Text, report.notes), *_tables(report)):
        console.print(part)
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


def _tables(report: Report) -> Iterator[Table]:
    """Yield what was compared: quantities, and changes of contact."""
    from ..studies.tables import table

    quantities = [
        (
            f"{row.quantity} [{COLUMN_UNITS[row.quantity]}]",
            *(f"{row.error:.2e}", f"{row.at:.6g}", f"{row.l2:.1e}", f"{row.bound:.1e}"),
            "ok" if row.passed else "FAILED",
        )
        for row in report.rows
    ]
    yield table(("quantity", "max error", "at t [s]", "L2 error", "bound", ""), quantities)
    changes = [
        (
            *(row.kind, f"{row.time:.10f}", f"{row.reference:.10f}"),
            *(f"{row.time - row.reference:.1e}", f"{row.bound:.1e}", "ok" if row.passed else "FAILED"),
        )
        for row in report.events
    ]
    if changes:
        yield table(("contact", "t [s]", "reference [s]", "error [s]", "bound [s]", ""), changes)
