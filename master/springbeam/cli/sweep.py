"""``springbeam sweep``."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.text import Text

from ..scene import SceneError, load_scene
from .common import BAD_INPUT, STOPPED, SceneArgument, SettingsOption, bad_input_reported, fail


def register(app: typer.Typer) -> None:
    app.command()(sweep)


def sweep(
    scene: SceneArgument,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary",
            metavar="TABLE.KEY=VALUES",
            help="A list 1,2,5, a grid LOW:HIGH:COUNT, or LOW:HIGH for --samples; with :log even in the logarithm.",
        ),
    ] = None,
    settings: SettingsOption = None,
    samples: Annotated[
        int, typer.Option("--samples", min=0, help="Sample the ranges so often, instead of a grid.")
    ] = 0,
    sampling: Annotated[
        Literal["latin_hypercube", "random"], typer.Option("--sampling", help="How --samples are placed.")
    ] = "latin_hypercube",
    seed: Annotated[int, typer.Option("--seed", min=0, help="Of the samples.")] = 0,
    metric: Annotated[
        list[str] | None,
        typer.Option("--metric", metavar="NAME", help="Keep only this; may be repeated. Default: all."),
    ] = None,
    workers: Annotated[
        int | None, typer.Option("--workers", min=1, help="Local processes. Default: one per core.")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option("--scheduler", metavar="ADDRESS", help="An existing Dask cluster instead.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="DIR", help="Where rows go; a sweep that was begun there goes on."),
    ] = None,
    no_plots: Annotated[bool, typer.Option("--no-plots", help="Do not draw the picture.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress bar; print only DIR.")] = False,
) -> None:
    """Run a scene over many values of its keys, on all cores or a Dask cluster; one row per run.

    Example: springbeam sweep soft --vary spring.linear_stiffness=1:200:64:log
    """
    if missing := [name for name in ("distributed", "pyarrow") if find_spec(name) is None]:
        fail(BAD_INPUT, f"sweep needs the packages {' and '.join(missing)}: pip install 'springbeam[sweep]'")
    from .. import sweep as sweeps
    from ..sweep.design import design, parse_axis
    from ..sweep.picture import draw

    directory = out or Path("results") / f"{Path(scene).stem}-sweep"
    bar = Progress(
        BarColumn(bar_width=20), MofNCompleteColumn(), TextColumn("{task.fields[state]}"), TimeRemainingColumn(),
        console=Console(stderr=True), transient=True, disable=quiet or not Console(stderr=True).is_terminal,
    )  # fmt: skip
    with bad_input_reported():
        metrics = tuple(metric or sweeps.METRICS)
        if unknown := [name for name in metrics if name not in sweeps.METRICS]:
            raise SceneError(f"--metric {unknown[0]}: unknown; allowed: {', '.join(sweeps.METRICS)}")
        what, axes = load_scene(scene, settings or ()), tuple(parse_axis(text) for text in vary or ())
        todo = sweeps.Sweep(what, axes, design(axes, samples, seed, sampling), metrics)
        try:
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
        drawn = not no_plots and draw(sweeps.rows(directory), axes, metrics, directory / "sweep.png")
    if quiet:
        typer.echo(directory)
        return
    console = Console(highlight=False)
    console.print(f"runs      {', '.join(f'{number} {status}' for status, number in counts.items() if number)}")
    console.print(Text(f"rows      {directory / sweeps.TABLE}"), soft_wrap=True)
    if drawn:
        console.print(Text(f"picture   {directory / 'sweep.png'}"), soft_wrap=True)
