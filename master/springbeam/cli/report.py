"""``springbeam report`` and ``springbeam animate``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.progress import BarColumn, MofNCompleteColumn

from ..results.directory import ANIMATIONS, REPORT
from ..results.reading import load_trajectory
from .common import (
    BAD_INPUT,
    ForceOption,
    QuietOption,
    RunArgument,
    bad_input_reported,
    fail,
    progress_bar,
    results_directory,
)


def report(
    directory: RunArgument,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="FILE", help=f"The file to write. Default: DIR/{REPORT}")
    ] = None,
    force: ForceOption = False,
) -> None:
    """Write a run as one HTML page: motion with a time slider, charts, numbers, the scene. It needs no network.

    Example: springbeam report results/soft
    """
    with bad_input_reported():
        trajectory = load_trajectory(results_directory(directory))
        target = _free(out or directory / REPORT, force)
        from ..pictures.report import page  # plotly takes a second to load

        target.write_text(page(trajectory), encoding="utf-8")
    typer.echo(target)


def export(
    directory: RunArgument,
    form: Annotated[
        Literal["csv", "parquet"],
        typer.Option("--format", help="csv: trajectory.csv anew. parquet: rows, events and shapes (needs pandas)."),
    ] = "csv",
) -> None:
    """Write the tables of a run from its records (steps.bin), also of one that was killed or still runs.

    Example: springbeam export results/soft --format parquet
    """
    from ..results.export import export as write

    with bad_input_reported():
        try:
            files = write(results_directory(directory), form)
        except ImportError as error:
            fail(BAD_INPUT, f"--format {form}: {error}; pip install -e '.[data]' in the checkout of springbeam")
    for file in files:
        typer.echo(file)


def animate(
    directory: RunArgument,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", metavar="FILE", help=f"A .gif, or an .mp4 (needs ffmpeg). Default: DIR/{ANIMATIONS[0]}"
        ),
    ] = None,
    seconds: Annotated[
        float, typer.Option("--seconds", metavar="SECONDS", min=0.1, max=600.0, help="How long it plays.")
    ] = 10.0,
    fps: Annotated[int, typer.Option("--fps", metavar="N", min=1, max=50, help="Frames per second.")] = 20,
    force: ForceOption = False,
    quiet: QuietOption = False,
) -> None:
    """Write a run as an animation: beam and spring above their positions over time.

    Example: springbeam animate results/soft --out soft.mp4
    """
    with bad_input_reported():
        trajectory = load_trajectory(results_directory(directory))
        target = _free(out or directory / ANIMATIONS[0], force)
        from ..pictures.animation import AnimationError
        from ..pictures.animation import animate as write

        def progress(times: Sequence[float]) -> Iterable[float]:
            with progress_bar(BarColumn(bar_width=20), MofNCompleteColumn(), quiet=quiet) as bar:
                yield from bar.track(times)

        try:
            write(trajectory, target, seconds=seconds, fps=fps, progress=progress)
        except AnimationError as error:
            fail(BAD_INPUT, str(error))
    typer.echo(target)


def _free(path: Path, force: bool) -> Path:
    if path.exists() and not force:
        fail(BAD_INPUT, f"{path} already exists; --force replaces it, --out FILE writes another")
    return path
