"""``springbeam converge``."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn
from rich.table import Table
from rich.text import Text

from ..scene import load_scene
from .common import (
    ForceOption,
    JsonOption,
    QuietOption,
    SceneArgument,
    SettingsOption,
    bad_input_reported,
    console_for,
    new_directory,
    print_json,
    progress_bar,
)

if TYPE_CHECKING:
    from ..studies.converge import Refinement, Study


def converge(
    scene: SceneArgument,
    settings: SettingsOption = None,
    levels: Annotated[
        int, typer.Option("--levels", metavar="N", min=3, max=8, help="Meshes, each with twice the elements.")
    ] = 4,
    metric: Annotated[
        list[str] | None, typer.Option("--metric", metavar="NAME", help="Quantity to compare; may be repeated.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="DIR", help="Where converge.csv and converge.png go. Default: results/…"),
    ] = None,
    force: ForceOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Show how the results settle with finer meshes and more modes: observed orders, extrapolated values, cost.

    Example: springbeam converge steel-bumper --metric contact_force_max
    """
    from ..studies.converge import draw, study, write_csv

    with bad_input_reported():
        what = load_scene(scene, settings or ())
        directory = new_directory(Path("results") / f"{Path(scene).stem}-converge", out, force)
        name = TextColumn("{task.fields[name]}")
        bar = progress_bar(BarColumn(bar_width=20), MofNCompleteColumn(), name, quiet=quiet)
        try:
            with bar:
                task = bar.add_task("", total=2 * levels, completed=-1, name="")
                found = study(what, levels, metric or (), lambda name: bar.update(task, advance=1, name=name))
        except BaseException:
            directory.discard()
            raise
        write_csv(found, directory.path / "converge.csv")
        draw(found, directory.path / "converge.png")
    if as_json:
        print_json({"directory": directory.path, **_as_json(found)})
    elif quiet:
        typer.echo(directory.path)
    console = console_for(silent=quiet or as_json)
    console.print(Text(what.title or "(untitled scene)", style="bold"))
    for refinement in found.sequences:
        console.print(_table(found, refinement))
        meshes = (f"{x.n_elements} el. {x.unknowns} modes {x.seconds:.2g} s" for x in refinement.levels)
        console.print(Text(f"runs      {', '.join(meshes)}"))
        for level in refinement.levels:
            if level.cause:
                console.print(
                    Text(f"stopped   {level.n_elements} elements, {level.n_modes or 'all'} modes: {level.cause}")
                )
    console.print("error: of the run as given; in brackets the last change, where the values show no limit")
    console.print("by H/2: what half the macro step changes on the finest mesh")
    console.print(Text(f"results   {directory.path}"), soft_wrap=True)


def _table(found: Study, refinement: Refinement) -> Table:
    """Return a row a quantity: of the mesh as given, and where finer ones or more modes lead."""
    from ..studies.sweep.metrics import heading

    title = f"more {refinement.refined}"
    table = Table(box=None, pad_edge=False, header_style="bold", title=title, title_justify="left")
    table.add_column("", no_wrap=True)
    for head in ("as given", "extrapolated", "error", "order", "by H/2"):
        table.add_column(head, justify="right", no_wrap=True)
    for name in found.quantities:
        given, last = found.as_given.values[name], found.sequences[0].levels[-1].values[name]
        settled = refinement.settled(name)
        limit, halved = settled.limit, found.halved.values[name]
        error = "" if settled.change is None else f"({settled.change:.1e})"
        if given is not None and limit is not None:
            error = f"{given - limit:.1e}"
        by_time = "" if last is None or halved is None else f"{halved - last:.1e}"
        cells = (_number(given, ".6g"), _number(limit, ".6g"), error, _number(settled.order, ".1f"), by_time)
        table.add_row(Text(heading(name)), *cells)
    return table


def _number(value: float | None, form: str) -> str:
    return "" if value is None else format(value, form)


def _as_json(found: Study) -> dict[str, object]:
    return {
        refinement.refined: {
            "levels": [asdict(level) for level in refinement.levels],
            "settled": {name: asdict(refinement.settled(name)) for name in found.quantities},
        }
        for refinement in found.sequences
    } | {"halved_macro_step": asdict(found.halved)}
