"""The commands that carry out a study: sweep, tradeoff, converge, crosscheck, stability; and resume.

Each is a function that makes the study of its own options; `study_command` adds what all studies share.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from ..results.directory import RunDirectory
from ..scene import load_scene
from .common import (
    JsonOption,
    MapOption,
    MeasuredArgument,
    NoPlotsOption,
    QuietOption,
    SceneArgument,
    SettingsOption,
    bad_input_reported,
    complete_key,
    results_directory,
)
from .frame import Frame, carry_out, study_command
from .run import carry_out as carry_out_run
from .run import picked, picked_in_words

if TYPE_CHECKING:
    from ..studies.study import Study
else:
    Study = Any

MetricOption = Annotated[
    list[str] | None,
    typer.Option(
        "--metric",
        metavar="NAME[=FORMULA]",
        help="A number of each run, or yours as in a='max(a_tip)/g'; may be repeated. Default: those that fit.",
    ),
]
QuickOption = Annotated[bool, typer.Option("--quick", help="A smaller study, for a first look.")]
SeedOption = Annotated[
    int, typer.Option("--seed", metavar="N", min=0, help="Seed of the samples; one seed gives the same runs again.")
]


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
    seed: SeedOption = 0,
    metric: MetricOption = None,
    boundary: Annotated[
        str,
        typer.Option(
            "--boundary",
            metavar="METRIC=LIMIT",
            help="Over amplitude and duration of a pulse: the damage boundary, where the metric reaches its limit.",
        ),
    ] = "",
) -> Study:
    """Run a scene over many values of its keys, on all cores or a Dask cluster; one row per run.

    Example: springbeam sweep soft --vary spring.linear_stiffness=1:200:64:log
    """
    from ..studies.sweep import Sweep

    return Sweep(
        scene=load_scene(scene, settings or ()),
        vary=tuple(vary or ()),
        samples=samples,
        sampling=sampling,
        seed=seed,
        metric=tuple(metric or ()),
        boundary=boundary,
    )


@study_command()
def fit(
    scene: SceneArgument,
    measured: MeasuredArgument,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary",
            metavar="KEY=GUESS",
            help="A key to find, and where to begin; may be repeated.",
            autocompletion=complete_key,
        ),
    ] = None,
    names: MapOption = None,
    shift: Annotated[
        float | None,
        typer.Option("--shift", metavar="SECONDS", help="Move the clock of the measurement by this. Default: found."),
    ] = None,
    settings: SettingsOption = None,
) -> Study:
    """Find keys of a scene by measured curves, with confidence intervals. Exit code 1 if the data does not tell.

    Example: springbeam fit soft measured.csv --vary spring.linear_stiffness=3 --vary spring.damping=0.1
    """
    from ..studies.fit import Fit

    return Fit.of(load_scene(scene, settings or ()), measured, vary or (), names=tuple(names or ()), shift=shift)


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
    """Measure error against cost over schemes, macro steps and tolerances, beside scipy's solvers.

    Example: springbeam tradeoff soft --until 0.0712
    """
    from ..studies.tradeoff import Tradeoff

    return Tradeoff.of(load_scene(scene, settings or ()), until, repeats=repeats, quick=quick)


@study_command()
def converge(
    scene: SceneArgument,
    settings: SettingsOption = None,
    levels: Annotated[
        int, typer.Option("--levels", metavar="N", min=3, max=8, help="Meshes, each with twice the elements.")
    ] = 4,
    metric: MetricOption = None,
) -> Study:
    """Show how the results settle with finer meshes and more modes: observed orders, extrapolated values, cost.

    Example: springbeam converge steel-bumper --metric contact_force_max
    """
    from ..studies.converge import Converge

    return Converge(scene=load_scene(scene, settings or ()), levels=levels, metric=tuple(metric or ()))


@study_command()
def crosscheck(
    scene: SceneArgument,
    settings: SettingsOption = None,
    with_orders: Annotated[
        bool, typer.Option("--orders", help="Repeat the run at H/2, H/4, H/8; print observed orders instead.")
    ] = False,
    quick: Annotated[
        bool, typer.Option("--quick", help="Compare only the first quarter of the time; with --orders, not H/8.")
    ] = False,
) -> Study:
    """Compare the co-simulation with the monolithic reference of its law.

    Exit code 1 if they differ, 4 if they cannot be compared over the run that was asked for.

    Example: springbeam crosscheck soft --set coupling.scheme=hermite --set coupling.degree=2 --orders
    """
    from ..studies.crosscheck import Crosscheck, Orders

    what = load_scene(scene, settings or ())
    made = picked(what)
    remarks = () if made is None else (f"accuracy {picked_in_words(made.summary['accuracy'])}",)
    kind = Orders if with_orders else Crosscheck
    return kind(scene=what if made is None else made.scene, quick=quick, remarks=remarks)


@study_command("workers")
def stability(
    samples: Annotated[
        int, typer.Option("--samples", metavar="N", min=0, help="Cells of the hypercube over all parameters.")
    ] = 300,
    resolution: Annotated[
        int, typer.Option("--resolution", metavar="N", min=0, help="Values of each parameter of a slice; 0: no slices.")
    ] = 6,
    seed: SeedOption = 1,
    quick: QuickOption = False,
) -> Study:
    """Run extreme scenes and classify each result. Exit code 1 if one is wrong.

    Example: springbeam stability --samples 100 --resolution 0
    """
    from ..studies.stability.grid import Grid

    return Grid(samples=samples, resolution=resolution, seed=seed, quick=quick)


def resume(
    directory: Annotated[
        Path, typer.Argument(metavar="DIR", help="The directory of the run or the study.", show_default=False)
    ],
    no_plots: NoPlotsOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Go on with a run or a study that was killed or stopped.

    A run needs --checkpoint; its results are those of a run that was never stopped, to the last bit. A study (sweep,
    tradeoff, converge, stability, crosscheck) goes on with the cases that have no record yet.

    Example: springbeam resume results/soft
    """
    from ..run.runner import last_checkpoint
    from ..studies.study import study_in

    with bad_input_reported():
        study = study_in(directory)
        start = None if study is not None else last_checkpoint(results_directory(directory))
    if start is not None:
        carry_out_run(
            start.scene,
            RunDirectory(directory),
            seconds=start.seconds,
            start=start,
            interval=start.interval,
            no_plots=no_plots,
            quiet=quiet,
            as_json=as_json,
        )
    elif study is not None:
        carry_out(lambda: study, None, Frame(directory, False, no_plots, quiet, as_json))
