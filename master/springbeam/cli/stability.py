"""``springbeam predict`` and ``springbeam stability``."""

from __future__ import annotations

import os
import re
import textwrap
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from ..scene import load_scene
from .common import (
    BAD_INPUT,
    DISAGREES,
    STOPPED,
    ForceOption,
    JsonOption,
    QuietOption,
    SceneArgument,
    SettingsOption,
    bad_input_reported,
    console_for,
    fail,
    print_json,
    progress_bar,
)

if TYPE_CHECKING:
    from ..studies.stability.grid import Outcome
    from ..studies.stability.predict import Prediction

#: A mesh that is so much too stiff is said to lock.
_LOCKS = 1.05
#: How many reasons the summary lists, and how many characters of each.
_REASONS, _REASON_WIDTH = 12, 66


def predict(
    scene: SceneArgument,
    settings: SettingsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Predict, without a run, frequencies, stable macro steps, whether the motion is resolved, and the best scheme.

    Example: springbeam predict soft --set coupling.macro_step=4e-3
    """
    from ..studies.stability.predict import predict as prediction_of

    with bad_input_reported():
        what = load_scene(scene, settings or ())
    prediction = prediction_of(what)
    if as_json:
        print_json(asdict(prediction))
    console = console_for(silent=as_json)
    console.print(Text(what.title or "(untitled scene)", style="bold"))
    for name, text in _lines(prediction):
        console.print(Text(f"{name:<10}{text}"))
    if prediction.schemes:
        console.print(_schemes_table(prediction))
    for note in prediction.notes:
        console.print(Text(f"note      {note}"))
    if prediction.auto is not None:
        scheme, degree, because = prediction.auto
        console.print(Text(f'fits      {scheme} {degree}, which coupling.scheme = "auto" takes: {because}'))


def _estimated(p: Prediction) -> Iterator[tuple[str, str]]:
    e = p.estimates
    masses = {"beam": e.beam_mass, "spring": e.spring_mass}
    yield "mass", ", ".join(f"{name} {mass:.4g} kg" for name, mass in masses.items() if mass is not None)
    if e.frequency is not None and p.frequencies:
        found = ", ".join(f"{frequency:.4g}" for frequency in p.frequencies)
        yield "vibrates", f"at {found} Hz on this mesh; first without a mesh {e.frequency:.4g} Hz"
    stiffness = [] if e.tip_stiffness is None else [f"tip {e.tip_stiffness:.4g} N/m (static)"]
    if e.locking is not None and e.locking > _LOCKS:
        stiffness[0] += f", {e.locking:.3g} times that on this mesh, which locks"
    yield (
        "stiffness",
        ", ".join([*stiffness, *([] if e.spring_stiffness is None else [f"spring {e.spring_stiffness:.4g} N/m"])]),
    )
    times = [] if e.contact_time is None or e.contact_time == inf else [f"first at t = {e.contact_time:.4g} s"]
    if e.contact_duration is not None:
        times.append(f"lasts about {e.contact_duration:.2g} s (half a period together)")
    if times:
        yield "contact", ", ".join(times)


def _lines(p: Prediction) -> list[tuple[str, str]]:
    lines = [*_estimated(p), ("H", f"{p.macro_step:g} s")]
    if p.omega_1 is not None and p.omega_max is not None:
        lines.append(("beam", f"ω₁H = {p.omega_1 * p.macro_step:.3g}, ω_max H = {p.omega_max * p.macro_step:.3g}; "
                              f"{p.resolved_modes} of {p.modes} modes resolved (ωH ≤ 1)"))  # fmt: skip
        lines.append(("", f"tip mass {p.tip_mass:.3g} kg, impedance Z = {p.impedance:.3g} N·s/m"))
    if p.spring_frequency is not None:
        lines.append(("spring", f"ωH = {p.spring_frequency * p.macro_step:.3g} at its stiffest"))
    if p.contact_frequency is not None:
        lines.append(("contact", f"ωH = {p.contact_frequency * p.macro_step:.3g} at its stiffest"))
    if p.displacement_gain is not None:
        verdict = "diverges" if p.displacement_gain > 1.0 else "converges"
        gain = f"of displacement against force: gain 2m/(ZH) = {p.displacement_gain:.3g}, {verdict}"
        lines.append(("exchange", gain))
    return lines


def _schemes_table(p: Prediction) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("scheme", no_wrap=True)
    table.add_column("degree", justify="right", no_wrap=True)
    for name in ("spectral radius − 1", "critical H [s]"):
        table.add_column(Text(name), justify="right", no_wrap=True)
    table.add_column("", no_wrap=True)
    for s in p.schemes:
        excess = s.spectral_radius - 1.0
        table.add_row(
            s.scheme,
            str(s.degree),
            "0" if abs(excess) < 1e-11 else f"{excess:.1e}",
            "none" if s.critical_step is None else f"{s.critical_step:.3g}",
            "unstable" if excess > p.threshold else "",
        )
    return table


def stability(
    critical: Annotated[
        bool,
        typer.Option("--critical", help="Compare predicted and measured critical macro steps of all schemes instead."),
    ] = False,
    samples: Annotated[
        int, typer.Option("--samples", metavar="N", min=0, help="Cells of the hypercube over all parameters.")
    ] = 300,
    resolution: Annotated[
        int, typer.Option("--resolution", metavar="N", min=0, help="Values of each parameter of a slice; 0: no slices.")
    ] = 6,
    seed: Annotated[int, typer.Option("--seed", metavar="N", min=0, help="Seed of the hypercube.")] = 1,
    workers: Annotated[
        int | None, typer.Option("--workers", metavar="N", min=1, help="Processes. Default: one per core.")
    ] = None,
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="DIR", help="Where the table and the pictures go.")
    ] = Path("results/stability"),
    force: ForceOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run extreme scenes and classify each result. Exit code 1 if a wrong result came without a warning.

    Example: springbeam stability --samples 100 --resolution 0
    """
    if critical:
        _critical(quiet=quiet, as_json=as_json)
        return
    from concurrent.futures.process import BrokenProcessPool

    from ..bodies.factory import fingerprints
    from ..studies.stability.cells import sampled_cells, slice_cells
    from ..studies.stability.grid import run_cells, write_csv, write_scene
    from ..studies.stability.picture import draw

    cells = [*sampled_cells(samples, seed), *slice_cells(resolution)]
    table = out / "stability.csv"
    if not cells:
        fail(BAD_INPUT, "no cells: --samples and --resolution are both 0")
    if table.exists() and not force:
        fail(BAD_INPUT, f"{table}: already there; --force replaces it, --out DIR names another directory")
    with bad_input_reported():
        fingerprints(load_scene("soft"))  # else each cell would say that an FMU is missing
        out.mkdir(parents=True, exist_ok=True)
    console = console_for(silent=quiet or as_json)
    console.print(f"{len(cells)} cells, mostly below a second each; --samples and --resolution set how many")
    garbage = 0

    def count(outcome: Outcome) -> None:
        nonlocal garbage
        garbage += outcome.kind == "garbage"
        bar.update(task, advance=1, garbage=garbage)

    state = TextColumn("{task.fields[garbage]} garbage")
    bar = progress_bar(
        BarColumn(bar_width=20), MofNCompleteColumn(), state, TimeRemainingColumn(), quiet=quiet or as_json
    )
    with bar:
        task = bar.add_task("", total=len(cells), garbage=0)
        try:
            outcomes = run_cells(cells, workers or os.cpu_count() or 1, count)
        except BrokenProcessPool:
            fail(STOPPED, "a worker process died: an FMU has crashed, or memory ran out")
    write_csv(cells, outcomes, table)
    pictures = draw(cells, outcomes, out)
    for stale in out.glob("garbage-*.toml"):
        stale.unlink()
    bad = {number: outcome.reason for number, outcome in enumerate(outcomes) if outcome.kind == "garbage"}
    for number in bad:
        write_scene(cells[number], out / f"garbage-{number}.toml")
    if as_json:
        print_json({"cells": len(cells), "classes": Counter(o.kind for o in outcomes), "garbage": bad})
    elif quiet:
        typer.echo(out)
    console.print(_outcome_table(cells, outcomes))
    console.print(_reason_table(outcomes))
    for number, reason in bad.items():
        console.print(Text(f"garbage   {out / f'garbage-{number}.toml'}: {reason}"))
    console.print(Text(f"cells     {table}"), soft_wrap=True)
    console.print(Text(f"pictures  {', '.join(map(str, pictures))}"), soft_wrap=True)
    if garbage:
        raise typer.Exit(DISAGREES)


#: Predicted and measured critical macro steps agree if they differ by less than this, relatively.
_AGREEMENT = 0.05


def _critical(*, quiet: bool, as_json: bool) -> None:
    """Print critical macro steps, predicted and measured; exit code 1 if they differ."""
    from ..studies.stability.critical import LARGE_STEP, comparisons
    from ..studies.stability.predict import THRESHOLD

    steps = Table(box=None, pad_edge=False, header_style="bold", title="critical macro steps", title_justify="left")
    steps.add_column("coupling", no_wrap=True)
    for name in ("λ [N/m]", "predicted [s]", "measured [s]", "differ by", f"at {LARGE_STEP:g} s"):
        steps.add_column(Text(name), justify="right", no_wrap=True)
    found, agree = [], True
    with bad_input_reported():
        for c in comparisons():
            stable = c.growth <= 1.0 + THRESHOLD
            cells = ("none", "", "")
            if c.predicted is None:
                agree &= stable
            elif c.measured is None:
                agree = False
                cells = (f"{c.predicted:.4g}", "none", "")
            else:
                differ = c.measured / c.predicted - 1.0
                agree &= abs(differ) <= _AGREEMENT
                cells = (f"{c.predicted:.4g}", f"{c.measured:.4g}", f"{100.0 * differ:+.2f} %")
            agree &= stable == (c.radius <= 1.0 + THRESHOLD)
            found.append({**asdict(c), "stable": stable})
            stiffness = f"{c.stiffness:g}" if c.law == "compliance" else "tie"
            steps.add_row(f"{c.scheme} {c.degree}", stiffness, *cells, "stable" if stable else "unstable")
    if as_json:
        print_json({"agree": agree, "couplings": found})
    elif quiet:
        typer.echo("agree" if agree else "disagree")
    console_for(silent=quiet or as_json).print(steps)
    if not agree:
        raise typer.Exit(DISAGREES)


def _outcome_table(cells: Sequence[dict[str, Any]], outcomes: Sequence[Outcome]) -> Table:
    """Return a row per coupling, with the largest residual of the runs that were done."""
    from ..studies.stability.cells import COUPLINGS
    from ..studies.stability.grid import CLASSES

    table = Table(box=None, pad_edge=False, header_style="bold", title=f"{len(cells)} cells", title_justify="left")
    table.add_column("coupling", no_wrap=True)
    for name in (*(f"{kind[:4]}." for kind in CLASSES), "residual"):
        table.add_column(Text(name), justify="right", no_wrap=True)
    ends = [(cell["coupling"], outcome) for cell, outcome in zip(cells, outcomes, strict=True)]
    for row in (*COUPLINGS, None):
        mine = [outcome for coupling, outcome in ends if row in (coupling, None)]
        counts = Counter(outcome.kind for outcome in mine)
        done = [o.residual for o in mine if o.kind in ("conserved", "dissipative", "approximate", "garbage")]
        done = [residual for residual in done if residual == residual]
        name = "all" if row is None else " ".join(map(str, row)).removeprefix("transmission ")
        numbers = [str(counts[kind]) if counts[kind] else "" for kind in CLASSES]
        table.add_row(name, *numbers, f"{max(done):.0e}" if done else "")
    return table


def _reason_table(outcomes: Sequence[Outcome]) -> Table:
    """Return why cells were refused or stopped, without numbers, the most frequent reasons first."""
    counts = Counter((o.kind, _without_numbers(o.reason)) for o in outcomes if o.kind in ("refused", "stopped"))
    table = Table(box=None, pad_edge=False, show_header=False)
    for _ in range(3):
        table.add_column(no_wrap=True)
    for (kind, reason), number in counts.most_common(_REASONS):
        table.add_row(kind, str(number), Text(textwrap.shorten(reason, _REASON_WIDTH, placeholder=" …")))
    if len(counts) > _REASONS:
        table.add_row("", "", f"and {len(counts) - _REASONS} further reasons, see the table")
    return table


def _without_numbers(reason: str) -> str:
    return re.sub(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?", "…", " ".join(reason.removeprefix("cell: ").split()))
