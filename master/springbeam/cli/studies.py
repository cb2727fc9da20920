"""The commands that carry out a study: sweep, tradeoff, converge, crosscheck, stability."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

import typer

from ..scene import load_scene
from .common import (
    ForceOption,
    JsonOption,
    NoPlotsOption,
    QuietOption,
    SceneArgument,
    SettingsOption,
    complete_key,
)
from .run import picked
from .study import Frame, QuickOption, SchedulerOption, StudyOption, WorkersOption, carry_out
from .summary import picked_in_words

if TYPE_CHECKING:
    from ..studies.study import Study


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
    scheduler: SchedulerOption = None,
    out: StudyOption = None,
    force: ForceOption = False,
    no_plots: NoPlotsOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run a scene over many values of its keys, on all cores or a Dask cluster; one row per run.

    Example: springbeam sweep soft --vary spring.linear_stiffness=1:200:64:log
    """
    from ..studies.sweep import Sweep

    def study() -> Study:
        return Sweep(
            scene=load_scene(scene, settings or ()),
            vary=tuple(vary or ()),
            samples=samples,
            sampling=sampling,
            seed=seed,
            metric=tuple(metric or ()),
            stroboscopic=stroboscopic,
        )

    carry_out(study, scene, Frame(out, force, no_plots, quiet, as_json, workers, scheduler))


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

    def study() -> Study:
        return Tradeoff.of(load_scene(scene, settings or ()), until, repeats=repeats, quick=quick)

    carry_out(study, scene, Frame(out, force, no_plots, quiet, as_json))


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

    def study() -> Study:
        return Converge(scene=load_scene(scene, settings or ()), levels=levels, metric=tuple(metric or ()), quick=quick)

    carry_out(study, scene, Frame(out, force, no_plots, quiet, as_json))


def crosscheck(
    scene: SceneArgument,
    settings: SettingsOption = None,
    with_orders: Annotated[
        bool, typer.Option("--orders", help="Repeat the run at H/2, H/4, H/8; print observed orders instead.")
    ] = False,
    quick: Annotated[
        bool, typer.Option("--quick", help="Compare only the first quarter of the time; with --orders, not H/8.")
    ] = False,
    out: StudyOption = None,
    force: ForceOption = False,
    no_plots: NoPlotsOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Compare the co-simulation with the monolithic reference of its law.

    Exit code 1 if they differ, 4 if they cannot be compared over the run that was asked for.

    Example: springbeam crosscheck soft --set coupling.scheme=hermite --set coupling.degree=2 --orders
    """
    from ..studies.crosscheck import Crosscheck
    from ..studies.orders import Orders

    def study() -> Study:
        what = load_scene(scene, settings or ())
        made = picked(what)
        remarks = () if made is None else (f"accuracy {picked_in_words(made.summary['accuracy'])}",)
        kind = Orders if with_orders else Crosscheck
        return kind(scene=what if made is None else made.scene, quick=quick, remarks=remarks)

    carry_out(study, scene, Frame(out, force, no_plots, quiet, as_json))


def stability(
    samples: Annotated[
        int, typer.Option("--samples", metavar="N", min=0, help="Cells of the hypercube over all parameters.")
    ] = 300,
    resolution: Annotated[
        int, typer.Option("--resolution", metavar="N", min=0, help="Values of each parameter of a slice; 0: no slices.")
    ] = 6,
    seed: Annotated[int, typer.Option("--seed", metavar="N", min=0, help="Seed of the hypercube.")] = 1,
    quick: QuickOption = False,
    workers: WorkersOption = None,
    out: StudyOption = None,
    force: ForceOption = False,
    no_plots: NoPlotsOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run extreme scenes and classify each result. Exit code 1 if one is wrong.

    Example: springbeam stability --samples 100 --resolution 0
    """
    from ..studies.stability.grid import Grid

    def study() -> Study:
        return Grid(samples=samples, resolution=resolution, seed=seed, quick=quick)

    carry_out(study, None, Frame(out, force, no_plots, quiet, as_json, workers))
