"""``springbeam sweep``."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Literal

import typer

from ..scene import load_scene
from .common import (
    BAD_INPUT,
    ForceOption,
    JsonOption,
    NoPlotsOption,
    QuietOption,
    SceneArgument,
    SettingsOption,
    complete_key,
    fail,
)
from .study import StudyOption, WorkersOption, carry_out


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
    workers: WorkersOption = None,
    scheduler: Annotated[
        str | None,
        typer.Option("--scheduler", metavar="ADDRESS", help="Run on this Dask cluster instead of local processes."),
    ] = None,
    out: StudyOption = None,
    force: ForceOption = False,
    no_plots: NoPlotsOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run a scene over many values of its keys, on all cores or a Dask cluster; one row per run.

    Example: springbeam sweep soft --vary spring.linear_stiffness=1:200:64:log
    """
    needed = ("pyarrow", "distributed") if scheduler else ("pyarrow",)
    if missing := [name for name in needed if find_spec(name) is None]:
        fail(BAD_INPUT, f"sweep needs the packages {' and '.join(missing)}: pip install {' '.join(missing)}")
    from ..studies.sweep import Sweep

    carry_out(
        lambda: Sweep(
            scene=load_scene(scene, settings or ()),
            vary=tuple(vary or ()),
            samples=samples,
            sampling=sampling,
            seed=seed,
            metric=tuple(metric or ()),
            stroboscopic=stroboscopic,
        ),
        f"{Path(scene).stem}-sweep",
        out=out,
        force=force,
        workers=workers,
        scheduler=scheduler,
        no_plots=no_plots,
        quiet=quiet,
        as_json=as_json,
    )
