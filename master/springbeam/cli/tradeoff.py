"""``springbeam tradeoff``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn
from rich.table import Table
from rich.text import Text

from ..bodies.protocol import FmuError
from ..scene import load_scene
from .common import (
    BAD_INPUT,
    STOPPED,
    ForceOption,
    JsonOption,
    QuietOption,
    SceneArgument,
    SettingsOption,
    bad_input_reported,
    console_for,
    fail,
    new_directory,
    print_json,
    progress_bar,
)

if TYPE_CHECKING:
    from ..studies.tradeoff import Cheapest, Point, Study


def tradeoff(
    scene: SceneArgument,
    settings: SettingsOption = None,
    until: Annotated[
        float | None,
        typer.Option("--until", metavar="SECONDS", help="End of the comparison. Default: while comparable."),
    ] = None,
    repeats: Annotated[
        int,
        typer.Option("--repeats", metavar="N", min=1, help="Timings per configuration; the median is used."),
    ] = 3,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick", help="Every third configuration of a kind, timed once; the slow ones are left out sooner."
        ),
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="DIR", help="Where tradeoff.csv and tradeoff.png go. Default: results/…"),
    ] = None,
    force: ForceOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Measure error against cost over schemes, macro steps, modes, meshes and tolerances, beside scipy's solvers.

    Example: springbeam tradeoff soft --until 0.0712
    """
    from ..monolithic.event_driven import ReferenceFailure
    from ..studies.tradeoff import study, write_csv
    from ..studies.tradeoff.picture import draw

    with bad_input_reported():
        what = load_scene(scene, settings or ())
        directory = new_directory(Path("results") / f"{Path(scene).stem}-tradeoff", out, force)
        name = TextColumn("{task.fields[name]}")
        console = console_for(silent=quiet or as_json)

        def show(done: int, total: int, name: str) -> None:
            if done == 1:
                console.print(f"{total} runs; finer ones of a kind are left out after one that takes too long")
            bar.update(task, completed=done, total=total, name=name)

        bar = progress_bar(BarColumn(bar_width=20), MofNCompleteColumn(), name, quiet=quiet)
        try:
            with bar:
                task = bar.add_task("", total=None, name="")
                found = study(
                    what,
                    until,
                    repeats,
                    show,
                    quick=quick,
                )
        except FmuError as error:
            directory.discard()
            fail(BAD_INPUT, str(error))
        except ReferenceFailure as error:
            directory.discard()
            fail(STOPPED, str(error))
        except BaseException:
            directory.discard()
            raise
        write_csv(found, directory.path / "tradeoff.csv")
        draw(found, directory.path / "tradeoff.png")
    if as_json:
        print_json({"directory": directory.path, **_as_json(found)})
    elif quiet:
        typer.echo(directory.path)
    console.print(
        Text(f"{found.scene.title}: up to t = {found.scene.time.t_end:.6g} s, {len(found.points)} configurations")
    )
    console.print(_table(found))
    console.print(_front_table(found))
    for note in found.notes:
        console.print(Text(f"note      {note}"))
    console.print(Text(f"results   {directory.path}"), soft_wrap=True)


def _table(found: Study) -> Table:
    table = Table(
        box=None, pad_edge=False, header_style="bold", title="cheapest for an error (solve time)", title_justify="left"
    )
    for name in ("error", "co-simulation", "[ms]", "scipy", "[ms]", "ratio"):
        table.add_column(Text(name), justify="left" if name in ("co-simulation", "scipy") else "right", no_wrap=True)
    for choice in found.cheapest():
        ratio = f"{choice.ratio:.1f}" if choice.ours and choice.scipy else ""
        table.add_row(f"{choice.target:.0e}", *_cells(choice.ours), *_cells(choice.scipy), ratio)
    return table


def _cells(point: Point | None) -> tuple[str, str]:
    return ("none gets there", "") if point is None else (point.configuration.name, f"{1e3 * point.solve:.3g}")


def _front_table(found: Study) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold", title="Pareto front", title_justify="left")
    table.add_column("configuration", overflow="fold")
    for name in ("error", "event [s]", "solve [ms]", "set-up [ms]", "doSteps"):
        table.add_column(Text(name), justify="right", no_wrap=True)
    for point in found.front():
        assert point.errors is not None
        calls = point.do_steps
        table.add_row(
            point.configuration.name, f"{point.displacement:.1e}", f"{point.errors.event_time:.1e}",
            f"{1e3 * point.solve:.3g}", f"{1e3 * point.setup:.3g}", str(calls) if calls else "",
        )  # fmt: skip
    return table


def _as_json(found: Study) -> dict[str, Any]:
    def described(point: Point | None) -> dict[str, Any] | None:
        if point is None:
            return None
        return {
            "name": point.configuration.name,
            "error": point.displacement,
            "solve": point.solve,
            "setup": point.setup,
        }

    def chosen(choice: Cheapest) -> dict[str, Any]:
        return {"error": choice.target, "co_simulation": described(choice.ours), "scipy": described(choice.scipy)}

    return {
        "until": found.scene.time.t_end,
        "cheapest": [chosen(choice) for choice in found.cheapest()],
        "front": [described(point) for point in found.front()],
        "notes": found.notes,
    }
