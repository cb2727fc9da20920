"""``springbeam tradeoff``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..scene import load_scene
from .common import ForceOption, JsonOption, NoPlotsOption, QuietOption, SceneArgument, SettingsOption
from .study import StudyOption, carry_out


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
    out: StudyOption = None,
    force: ForceOption = False,
    no_plots: NoPlotsOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Measure error against cost over schemes, macro steps, modes, meshes and tolerances, beside scipy's solvers.

    Example: springbeam tradeoff soft --until 0.0712
    """
    from ..studies.tradeoff import Tradeoff

    carry_out(
        lambda: Tradeoff.of(load_scene(scene, settings or ()), until, repeats=repeats, quick=quick),
        f"{Path(scene).stem}-tradeoff",
        out=out,
        force=force,
        no_plots=no_plots,
        quiet=quiet,
        as_json=as_json,
    )
