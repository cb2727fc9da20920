"""``springbeam sweep``."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
from rich.text import Text

from ..scene import SceneError, load_scene
from .common import (
    BAD_INPUT,
    STOPPED,
    JsonOption,
    NoPlotsOption,
    QuietOption,
    SceneArgument,
    SettingsOption,
    bad_input_reported,
    complete_key,
    console_for,
    fail,
    print_json,
    progress_bar,
)


def sweep(
    scene: SceneArgument,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary",
            metavar="TABLE.KEY=VALUES",
            help="A list 1,2,5, a grid LOW:HIGH:COUNT, or LOW:HIGH for --samples; with :log even in the logarithm.",
            autocompletion=complete_key,
        ),
    ] = None,
    settings: SettingsOption = None,
    samples: Annotated[
        int, typer.Option("--samples", metavar="N", min=0, help="Number of samples of the ranges, instead of a grid.")
    ] = 0,
    sampling: Annotated[
        Literal["latin_hypercube", "random"], typer.Option("--sampling", help="How --samples are placed.")
    ] = "latin_hypercube",
    seed: Annotated[
        int, typer.Option("--seed", metavar="N", min=0, help="Seed of the samples; one seed gives the same runs again.")
    ] = 0,
    metric: Annotated[
        list[str] | None,
        typer.Option(
            "--metric", metavar="NAME", help="Keep only this number of each run; may be repeated. Default: all."
        ),
    ] = None,
    stroboscopic: Annotated[
        bool,
        typer.Option(
            "--stroboscopic",
            help="Keep the positions once a period of the harmonic load in the last third of each run, and draw them.",
        ),
    ] = False,
    workers: Annotated[
        int | None, typer.Option("--workers", metavar="N", min=1, help="Local processes. Default: one per core.")
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option("--scheduler", metavar="ADDRESS", help="Run on this Dask cluster instead of local processes."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="DIR", help="Directory of the rows; a sweep that was begun there goes on."),
    ] = None,
    no_plots: NoPlotsOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run a scene over many values of its keys, on all cores or a Dask cluster; one row per run.

    Example: springbeam sweep soft --vary spring.linear_stiffness=1:200:64:log
    """
    if missing := [name for name in ("distributed", "pyarrow") if find_spec(name) is None]:
        fail(BAD_INPUT, f"sweep needs the packages {' and '.join(missing)}: pip install {' '.join(missing)}")
    from ..studies import sweep as sweeps
    from ..studies.sweep.design import design, parse_axis
    from ..studies.sweep.picture import draw

    directory = out or Path("results") / f"{Path(scene).stem}-sweep"
    state, left = TextColumn("{task.fields[state]}"), TimeRemainingColumn()
    bar = progress_bar(BarColumn(bar_width=20), MofNCompleteColumn(), state, left, quiet=quiet)
    with bad_input_reported():
        metrics = tuple(metric or sweeps.METRICS)
        if unknown := [name for name in metrics if name not in sweeps.METRICS]:
            raise SceneError(f"--metric {unknown[0]}: unknown; allowed: {', '.join(sweeps.METRICS)}")
        what, axes = load_scene(scene, settings or ()), tuple(parse_axis(text) for text in vary or ())
        todo = sweeps.Sweep(what, axes, design(axes, samples, seed, sampling), metrics, stroboscopic)
        try:
            counts = sweeps.finished(todo, directory)
            if counts is None:
                with bar, sweeps.cluster(scheduler, workers) as client:
                    task = bar.add_task("", total=len(todo.values), state="starting")
                    counts = sweeps.run(
                        todo,
                        directory,
                        client,
                        lambda done, total, failed: bar.update(task, completed=done, state=f"{failed} failed"),
                    )
        except sweeps.SweepError as error:
            fail(BAD_INPUT, str(error))
        except KeyboardInterrupt:
            fail(STOPPED, f"interrupted; the same command goes on with what is in {directory}")
        columns = sweeps.rows(directory)
        drawn = not no_plots and draw(columns, axes, metric or sweeps.PRINCIPAL, what.title, directory / sweeps.PICTURE)
        pictures = [directory / sweeps.PICTURE] if drawn else []
        if stroboscopic and not no_plots and sweeps.stroboscopic.draw(columns, axes, directory):
            pictures.append(directory / sweeps.stroboscopic.PICTURE)
    if as_json:
        picture = directory / sweeps.PICTURE if drawn else None
        print_json({"directory": directory, "rows": directory / sweeps.TABLE, "picture": picture, "runs": counts})
    elif quiet:
        typer.echo(directory)
    console = console_for(silent=quiet or as_json)
    console.print(f"runs      {', '.join(f'{number} {status}' for status, number in counts.items() if number)}")
    if first := next(filter(None, columns["error"]), None):
        console.print(Text(f"error     {first}, the first of them"))
    console.print(Text(f"rows      {directory / sweeps.TABLE}"), soft_wrap=True)
    for path in pictures:
        console.print(Text(f"picture   {path}"), soft_wrap=True)
