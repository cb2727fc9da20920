"""The commands that carry out a study: sweep, fit, tradeoff, converge, crosscheck, stability.

Each is a function that makes the study of its own options. `study_command` adds what all studies share: where records
go, progress, how a study stops and goes on.
"""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from rich.progress import BarColumn, MofNCompleteColumn, TimeRemainingColumn

from ..results.directory import ResultsExist
from ..scene import load_scene
from ..studies.tables import Findings
from .common import (
    STOPPED,
    ForceOption,
    JsonOption,
    MapOption,
    MeasuredArgument,
    NoPlotsOption,
    QuietOption,
    ReadOption,
    SceneArgument,
    SettingsOption,
    cause_of,
    complete_key,
    console_for,
    fail,
    progress_bar,
)
from .run import picked, picked_in_words

if TYPE_CHECKING:
    from ..studies.study import Records, Study
    from ..studies.tables import Row
else:
    Study = Any


@dataclass(frozen=True)
class Frame:
    """The options of all studies; ``workers`` and ``scheduler`` of those whose cases workers compute."""

    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", metavar="DIR", help="Directory of the results; a study that was begun there goes on."
        ),
    ] = None
    force: ForceOption = False
    no_plots: NoPlotsOption = False
    quiet: QuietOption = False
    as_json: JsonOption = False
    workers: Annotated[
        int | None, typer.Option("--workers", metavar="N", min=1, help="Local processes. Default: one per core.")
    ] = None
    scheduler: Annotated[
        str | None,
        typer.Option("--scheduler", metavar="ADDRESS", help="Run on this Dask cluster instead of local processes."),
    ] = None


def study_command(*of_workers: str) -> Callable[[Callable[..., Study]], Callable[..., Findings]]:
    """Return what makes a command of a function that returns a study: with its options, then those of `Frame`.

    ``of_workers`` names the options of workers that the command offers.
    """

    def decorate(make: Callable[..., Study]) -> Callable[..., Findings]:
        own, frame = (inspect.signature(what, eval_str=True).parameters for what in (make, Frame))
        shared = {name: p for name, p in frame.items() if name in of_workers or name not in ("workers", "scheduler")}

        def command(**given: Any) -> Findings:
            frame = Frame(**{name: given.pop(name) for name in shared})
            return carry_out(make(**given), given.get("scene"), frame)

        command.__name__, command.__doc__ = make.__name__, make.__doc__
        parameters = [p.replace(kind=p.KEYWORD_ONLY) for p in (own | shared).values()]
        command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        return command

    return decorate


def carry_out(study: Study, scene: str | None, frame: Frame) -> Findings:
    """Compute what of a study is not yet in its directory, write its files, and return what was found.

    The directory is ``out``, else ``results/SCENE-KIND``, or with -2, -3, … behind it where another study is.
    """
    from ..studies.study import troubles

    study.cases()
    records = _opened(study, study.kind if scene is None else f"{Path(scene).stem}-{study.kind}", frame)
    with _going_on(records, len(study.cases())):
        computed = _computed(study, records, frame)
        found = study.findings(computed).written(records.path.parent, pictures=not frame.no_plots)
    return replace(found, shown=[*study.remarks, *found.shown, *troubles(computed)])


def _opened(study: Study, default: str, frame: Frame) -> Records:
    from ..studies.study import Records

    if frame.out is not None or frame.force:
        return Records(study, frame.out or Path("results") / default, replace=frame.force)
    for number in count(1):
        with suppress(ResultsExist):
            return Records(study, Path("results") / (default if number == 1 else f"{default}-{number}"))
    raise AssertionError("unreachable")


@contextmanager
def _going_on(records: Records, total: int) -> Iterator[None]:
    """End the command with the cause, and how the study goes on, where it stops."""
    from ..monolithic.hybrid_system import ReferenceFailure
    from ..run.outcome import RunStopped

    directory = records.path.parent

    try:
        yield
    except (KeyboardInterrupt, RunStopped, ReferenceFailure, OSError) as error:
        if isinstance(error, OSError) and not records.by_name:
            raise
        there = f"; {len(records.by_name)} of {total} records are in {directory}; the same command goes on"
        fail(STOPPED, cause_of(error, directory) + there * bool(records.by_name))


def _computed(study: Study, records: Records, frame: Frame) -> dict[str, Row]:
    """Return all records, and show meanwhile how far it is."""
    from ..studies.study import dask_cluster, record_all

    total, there = len(study.cases()), len(records.by_name)
    if there == total:
        return record_all(study, records)
    silent = frame.quiet or frame.as_json
    known = f"\n{there} of {total} records are there" * bool(there)
    console_for(silent=silent).print(f"{study.announced.format(total)}{known}")
    bar = progress_bar(BarColumn(bar_width=20), MofNCompleteColumn(), TimeRemainingColumn(), quiet=silent)
    task = bar.add_task("", total=total, completed=there)
    processes = (frame.workers or os.cpu_count() or 1) if study.parallel else 0
    with records, dask_cluster(frame.scheduler) if frame.scheduler else nullcontext() as cluster, bar:
        return record_all(study, records, processes, cluster, lambda record: bar.advance(task))


# -- the commands ---------------------------------------------------------------------------------------------------

MetricOption = Annotated[
    list[str] | None,
    typer.Option(
        "--metric",
        metavar="NAME[=MODULE:FUNCTION]",
        help="A metric of each run (springbeam keys --metrics), or a Python function of it; may be repeated.",
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
    read: ReadOption = None,
    shift: Annotated[
        float | None,
        typer.Option("--shift", metavar="SECONDS", help="Move the clock of the measurement by this. Default: found."),
    ] = None,
    settings: SettingsOption = None,
) -> Study:
    """Find keys of a scene by measured curves, with confidence intervals. Exit code 1 if the data does not
    determine them.

    Example: springbeam fit soft measured.csv --vary spring.linear_stiffness=3 --vary spring.damping=0.1
    """
    from ..studies.fit import Fit

    return Fit.of(
        load_scene(scene, settings or ()),
        measured,
        vary or (),
        names=tuple(names or ()),
        shift=shift,
        read=tuple(read or ()),
    )


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
    """Measure error against cost over schemes, macro steps and tolerances.

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

    Example: springbeam crosscheck soft --set coupling.degree=2 --orders
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
    """Run extreme scenes and classify each result. Exit code 1 if one is garbage.

    Example: springbeam stability --samples 100 --resolution 0
    """
    from ..studies.stability.grid import Grid

    return Grid(samples=samples, resolution=resolution, seed=seed, quick=quick)
