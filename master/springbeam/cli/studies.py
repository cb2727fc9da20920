"""The commands that carry out a study: sweep, fit, tradeoff, converge, crosscheck.

Each is a function that makes the study of its own options. `study_command` adds the common parts: directory, progress,
interruption and continuation.
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

from .. import scene as scenes
from ..results.directory import ResultsExist, RunDirectory
from ..studies.tables import Findings
from .common import (
    STOPPED,
    AccuracyOption,
    ForceOption,
    JsonOption,
    MapOption,
    MeasuredArgument,
    NoPlotsOption,
    QuietOption,
    ReadOption,
    ScaleOption,
    SceneArgument,
    SettingsOption,
    cause_of,
    complete_key,
    console_for,
    fail,
    progress,
)
from .run import picked, picked_in_words

if TYPE_CHECKING:
    from ..studies.study import Records, Study
    from ..studies.tables import Done, Row
else:
    Study = Any


@dataclass(frozen=True)
class Frame:
    """The options of all studies; ``workers`` and ``scheduler`` of those whose cases workers compute."""

    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", metavar="DIR", help="Directory for results; a study that was begun there is continued."
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

    @property
    def silent(self) -> bool:
        """Whether only a path or JSON is to be printed."""
        return self.quiet or self.as_json


@dataclass(frozen=True)
class Once:
    """Findings that are computed at once, without cases to store."""

    kind: str  #: names the directory of the results
    announced: str  #: what there is to compute
    parts: int  #: how many parts that is
    find: Callable[[Done], Findings]  #: finds it, and says when a part is done


def study_command(*of_workers: str) -> Callable[[Callable[..., Study | Once]], Callable[..., Findings]]:
    """Return a decorator that makes a command of a function that returns a study: its options, then those of `Frame`.

    ``of_workers`` names the options of workers that the command offers.
    """

    def decorate(make: Callable[..., Study | Once]) -> Callable[..., Findings]:
        own, frame = (inspect.signature(what, eval_str=True).parameters for what in (make, Frame))
        shared = {name: p for name, p in frame.items() if name in of_workers or name not in ("workers", "scheduler")}

        def command(**given: Any) -> Findings:
            frame = Frame(**{name: given.pop(name) for name in shared})
            study = make(**given)
            if isinstance(study, Once):
                return find(study, given["scene"], frame)
            return carry_out(study, given.get("scene"), frame)

        command.__name__ = make.__name__
        command.__doc__ = make.__doc__
        parameters = [p.replace(kind=p.KEYWORD_ONLY) for p in (own | shared).values()]
        command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        return command

    return decorate


def find(once: Once, scene: str, frame: Frame) -> Findings:
    """Compute findings, write their files into a directory of their own, and return them.

    The directory is ``out``, else ``results/SCENE-KIND``, or with -2, -3, … behind it where there are results.
    """
    from ..monolithic.hybrid_system import ReferenceFailure
    from ..run.outcome import RunStopped

    with _new_directory(Path("results") / f"{Path(scene).stem}-{once.kind}", frame) as directory:
        number = count(1)
        try:
            with progress(once.announced, once.parts, silent=frame.silent) as show:
                findings = once.find(lambda: show(next(number)))
            if frame.force:
                for stale in directory.glob(f"{once.kind}.*"):
                    stale.unlink()
            return findings.written(directory, pictures=not frame.no_plots)
        except (RunStopped, ReferenceFailure) as error:
            fail(STOPPED, cause_of(error, directory))


@contextmanager
def _new_directory(default: Path, frame: Frame) -> Iterator[Path]:
    """Make and claim the directory of the results; remove it if nothing is written there."""
    if frame.out is None and not frame.force:
        directory = RunDirectory.create_numbered(default)
    else:
        directory = RunDirectory.create(frame.out or default, replace=True)
    try:
        if not frame.force and any(directory.path.iterdir()):
            raise ResultsExist(f"{directory.path}: is not empty")
        yield directory.path
    finally:
        directory.discard()


def carry_out(study: Study, scene: str | None, frame: Frame) -> Findings:
    """Compute the missing cases of a study, write its files, and return the findings.

    The directory is ``out``, else ``results/SCENE-KIND``, or with -2, -3, … behind it where another study is.
    """
    from ..studies.study import troubles

    records = _opened(study, study.kind if scene is None else f"{Path(scene).stem}-{study.kind}", frame)
    with _going_on(records, study):
        computed = _computed(study, records, frame)
        findings = study.findings(computed).written(records.path.parent, pictures=not frame.no_plots)
    return findings.with_lines(study.remarks, troubles(computed))


def _opened(study: Study, default: str, frame: Frame) -> Records:
    from ..studies.study import Records

    if frame.out is not None or frame.force:
        return Records(study, frame.out or Path("results") / default, replace=frame.force)
    for number in count(1):
        with suppress(ResultsExist):
            return Records(study, Path("results") / (default if number == 1 else f"{default}-{number}"))
    raise AssertionError("unreachable")


@contextmanager
def _going_on(records: Records, study: Study) -> Iterator[None]:
    """End the command with the cause, and how to continue the study, if it stops."""
    from ..monolithic.hybrid_system import ReferenceFailure
    from ..run.outcome import RunStopped

    directory = records.path.parent

    try:
        yield
    except (KeyboardInterrupt, RunStopped, ReferenceFailure, OSError) as error:
        if isinstance(error, OSError) and not records.by_name:
            raise
        done = len(records.by_name)
        there = f"; {done} of {study.expected(done)} records are in {directory}; the same command continues"
        fail(STOPPED, cause_of(error, directory) + there * bool(done))


def _computed(study: Study, records: Records, frame: Frame) -> dict[str, Row]:
    """Return all records, and show the progress."""
    from ..studies.engine import dask_cluster

    there = len(records.by_name)
    total = study.expected(there)
    if there == len(study.cases()) == total:
        return study.computed(records)
    known = f"\n{there} of {total} records are there" * bool(there)
    console_for(silent=frame.silent).print(f"{study.announced.format(total)}{known}")
    processes = (frame.workers or os.cpu_count() or 1) if study.parallel else 0
    workers = dask_cluster(frame.scheduler) if frame.scheduler else nullcontext()
    with records, workers as cluster, progress(study.kind, total, silent=frame.silent) as show:
        show(there)

        def report(_: Row) -> None:
            nonlocal total
            done = len(records.by_name)
            if done > total:
                total = study.expected(done)
            show(done, f"{study.kind}: {done} of {total}", total)

        return study.computed(records, processes, cluster, report)


# -- the commands ---------------------------------------------------------------------------------------------------

MetricOption = Annotated[
    list[str] | None,
    typer.Option(
        "--metric",
        metavar="NAME[=MODULE:FUNCTION]",
        help="A metric of each run (springbeam keys --metrics), or a Python function of it; may be repeated.",
    ),
]
SeedOption = Annotated[
    int, typer.Option("--seed", metavar="N", min=0, help="Seed of the samples; the same seed gives the same runs.")
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
    accuracy: AccuracyOption = None,
    samples: Annotated[
        int, typer.Option("--samples", metavar="N", min=0, help="Number of samples of the ranges, instead of a grid.")
    ] = 0,
    sampling: Annotated[
        Literal["latin_hypercube", "random"], typer.Option("--sampling", help="Distribution of --samples.")
    ] = "latin_hypercube",
    seed: SeedOption = 0,
    metric: MetricOption = None,
) -> Study:
    """Run a scene with many values of its keys, on all cores or a Dask cluster; write one row per run.

    Example: springbeam sweep soft --vary spring.linear_stiffness=1:200:64:log
    """
    from ..studies.sweep import Sweep

    return Sweep(
        scene=scenes.load_scene(scene, settings or (), accuracy),
        vary=tuple(vary or ()),
        samples=samples,
        sampling=sampling,
        seed=seed,
        metric=tuple(metric or ()),
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
            help="A key to find, and a guess or a range LOW:HIGH; may be repeated.",
            autocompletion=complete_key,
        ),
    ] = None,
    names: MapOption = None,
    scale: ScaleOption = None,
    read: ReadOption = None,
    shift: Annotated[
        float | None,
        typer.Option("--shift", metavar="SECONDS", help="Shift of the clock of the measurement. Default: fitted."),
    ] = None,
    repeat: Annotated[
        Path | None,
        typer.Option("--repeat", metavar="FILE", help="A second measurement of the same, which shows the noise."),
    ] = None,
    settings: SettingsOption = None,
) -> Study:
    """Fit keys of a scene to measured curves, with confidence intervals. Exit code 1 if the data does not
    determine them.

    Example: springbeam fit soft measured.csv --vary spring.linear_stiffness=3 --vary spring.damping=0.1
    """
    from ..studies.fit.study import Fit

    return Fit(
        scene=scenes.load_scene(scene, settings or ()),
        file=measured,
        vary=tuple(vary or ()),
        names=tuple(names or ()),
        scale=tuple(scale or ()),
        read=tuple(read or ()),
        shift=shift,
        repeat=repeat,
    )


@study_command()
def tradeoff(
    scene: SceneArgument,
    settings: SettingsOption = None,
    until: Annotated[
        float | None,
        typer.Option(
            "--until", metavar="SECONDS", help="End of the comparison. Default: as long as the runs are comparable."
        ),
    ] = None,
    repeats: Annotated[
        int,
        typer.Option("--repeats", metavar="N", min=1, help="Timings per configuration; the median is used."),
    ] = 3,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick", help="Every third configuration of a kind, timed once; slow ones are left out earlier."
        ),
    ] = False,
) -> Study:
    """Measure error against cost over schemes, macro steps and tolerances.

    Example: springbeam tradeoff soft --until 0.0712
    """
    from ..studies.tradeoff import Tradeoff

    return Tradeoff.of(scenes.load_scene(scene, settings or ()), until, repeats=repeats, quick=quick)


@study_command()
def converge(
    scene: SceneArgument,
    settings: SettingsOption = None,
    levels: Annotated[
        int, typer.Option("--levels", metavar="N", min=3, max=8, help="Meshes, each with twice the elements.")
    ] = 4,
    metric: MetricOption = None,
) -> Once:
    """Show the convergence of results with finer meshes and more modes: observed orders, extrapolated values, cost.

    Example: springbeam converge steel-bumper --metric contact_force_max
    """
    from ..studies.converge import QUANTITIES, meshes
    from ..studies.converge import converge as settle
    from ..studies.metrics import metrics_of

    what = scenes.load_scene(scene, settings or ())
    metrics_of(metric or QUANTITIES)
    runs = len(meshes(what, levels))

    def find(done: Done) -> Findings:
        return settle(what, levels=levels, metric=metric or (), done=done)

    return Once("converge", f"{runs} runs", runs, find)


@study_command()
def crosscheck(
    scene: SceneArgument,
    settings: SettingsOption = None,
    quick: Annotated[bool, typer.Option("--quick", help="Compare only the first quarter of the time.")] = False,
) -> Once:
    """Compare the co-simulation with the monolithic reference of its law.

    Exit code 1 if they differ, 4 if they cannot be compared over the whole run.

    Example: springbeam crosscheck soft --set coupling.degree=2
    """
    from ..monolithic import event_driven
    from ..studies import crosscheck as study
    from ..studies.comparison import PARTS

    what = scenes.load_scene(scene, settings or ())
    event_driven.refuse(what)

    def compare(done: Done) -> Findings:
        accurate = picked(what, silent=True)
        compared = what
        if accurate is not None:
            compared = accurate.scene
            done()
        findings = study.crosscheck(compared, quick=quick, done=done)
        if accurate is None:
            return findings
        return replace(findings, shown=[f"accuracy {picked_in_words(accurate.summary['accuracy'])}", *findings.shown])

    return Once("crosscheck", "2 runs and 2 references", PARTS + (what.accuracy is not None), compare)
