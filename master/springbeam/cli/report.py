"""``springbeam report`` and ``springbeam animate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..recording import REPORT, load_trajectory
from .common import BAD_INPUT, bad_input_reported, fail

RunArgument = Annotated[Path, typer.Argument(metavar="DIR", help="Where springbeam run has left its results.")]
ForceOption = Annotated[bool, typer.Option("--force", "-f", help="Replace a file that is already there.")]


def register(app: typer.Typer) -> None:
    app.command()(report)


def report(
    directory: RunArgument,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="FILE", help=f"Where it goes. Default: DIR/{REPORT}")
    ] = None,
    force: ForceOption = False,
) -> None:
    """Write a run as one HTML page: motion with a time slider, charts, numbers, the scene. It needs no network.

    Example: springbeam report results/soft
    """
    with bad_input_reported():
        trajectory = load_trajectory(directory)
        target = _free(out or directory / REPORT, force)
        from ..report import page  # plotly takes a second to load

        target.write_text(page(trajectory), encoding="utf-8")
    typer.echo(target)


def _free(path: Path, force: bool) -> Path:
    if path.exists() and not force:
        fail(BAD_INPUT, f"{path} already exists; --force replaces it, --out FILE writes another")
    return path
