"""``springbeam tradeoff``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from ..scene import load_scene
from .common import SceneArgument, SettingsOption
from .study import study_command

if TYPE_CHECKING:
    from ..studies.study import Study


@study_command()
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
) -> Study:
    """Measure error against cost over schemes, macro steps, modes, meshes and tolerances, beside scipy's solvers.

    Example: springbeam tradeoff soft --until 0.0712
    """
    from ..studies.tradeoff import Tradeoff

    return Tradeoff.of(load_scene(scene, settings or ()), until, repeats=repeats, quick=quick)
