"""``springbeam converge``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from ..scene import load_scene
from .common import SceneArgument, SettingsOption
from .study import QuickOption, study_command

if TYPE_CHECKING:
    from ..studies.study import Study


@study_command()
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
) -> Study:
    """Show how the results settle with finer meshes and more modes: observed orders, extrapolated values, cost.

    Example: springbeam converge steel-bumper --metric contact_force_max
    """
    from ..studies.converge import Converge

    return Converge(scene=load_scene(scene, settings or ()), levels=levels, metric=tuple(metric or ()), quick=quick)
