"""``springbeam sweep``."""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from ..scene import load_scene
from .common import (
    BAD_INPUT,
    SceneArgument,
    SettingsOption,
    complete_key,
    fail,
)
from .study import study_command

if TYPE_CHECKING:
    from ..studies.study import Study


@study_command("workers", "scheduler")
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
) -> Study:
    """Run a scene over many values of its keys, on all cores or a Dask cluster; one row per run.

    Example: springbeam sweep soft --vary spring.linear_stiffness=1:200:64:log
    """
    if find_spec("pyarrow") is None:
        fail(BAD_INPUT, "sweep needs the package pyarrow: pip install pyarrow")
    from ..studies.sweep import Sweep

    return Sweep(
        scene=load_scene(scene, settings or ()),
        vary=tuple(vary or ()),
        samples=samples,
        sampling=sampling,
        seed=seed,
        metric=tuple(metric or ()),
        stroboscopic=stroboscopic,
    )
