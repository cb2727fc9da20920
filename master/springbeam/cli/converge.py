"""``springbeam converge``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..scene import load_scene
from .common import ForceOption, JsonOption, NoPlotsOption, QuietOption, SceneArgument, SettingsOption
from .study import QuickOption, StudyOption, carry_out


def converge(
    scene: SceneArgument,
    settings: SettingsOption = None,
    levels: Annotated[
        int, typer.Option("--levels", metavar="N", min=3, max=8, help="Meshes, each with twice the elements.")
    ] = 4,
    metric: Annotated[
        list[str] | None, typer.Option("--metric", metavar="NAME", help="Quantity to compare; may be repeated.")
    ] = None,
    quick: QuickOption = False,
    out: StudyOption = None,
    force: ForceOption = False,
    no_plots: NoPlotsOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Show how the results settle with finer meshes and more modes: observed orders, extrapolated values, cost.

    Example: springbeam converge steel-bumper --metric contact_force_max
    """
    from ..studies.converge import Converge

    carry_out(
        lambda: Converge(
            scene=load_scene(scene, settings or ()), levels=levels, metric=tuple(metric or ()), quick=quick
        ),
        f"{Path(scene).stem}-converge",
        out=out,
        force=force,
        no_plots=no_plots,
        quiet=quiet,
        as_json=as_json,
    )
