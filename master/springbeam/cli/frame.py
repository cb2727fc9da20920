"""What the commands of all studies share: their options, where records go, cost, progress, how they stop and go on."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
from rich.text import Text

from ..results.directory import ResultsExist
from .common import (
    BAD_INPUT,
    STOPPED,
    ForceOption,
    JsonOption,
    NoPlotsOption,
    QuietOption,
    bad_input_reported,
    cause_of,
    console_for,
    fail,
    progress_bar,
    say,
)

if TYPE_CHECKING:
    from ..studies.study import Records, Row, Study
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


def study_command(*of_workers: str) -> Callable[[Callable[..., Study]], Callable[..., None]]:
    """Return what makes a command of a function that returns a study: with its options, then those of `Frame`.

    ``of_workers`` names the options of workers that the command offers.
    """

    def decorate(make: Callable[..., Study]) -> Callable[..., None]:
        own, frame = (inspect.signature(what, eval_str=True).parameters for what in (make, Frame))
        shared = {name: p for name, p in frame.items() if name in of_workers or name not in ("workers", "scheduler")}

        def command(**given: Any) -> None:
            taken = {name: given.pop(name) for name in shared}
            carry_out(lambda: make(**given), given.get("scene"), Frame(**taken))

        command.__name__, command.__doc__ = make.__name__, make.__doc__
        parameters = [p.replace(kind=p.KEYWORD_ONLY) for p in (own | shared).values()]
        command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        return command

    return decorate


def carry_out(make: Callable[[], Study], scene: str | None, frame: Frame) -> None:
    """Compute what of a study is not yet in its directory, write its files, and show what was found.

    ``make`` returns the study, and may raise what bad input raises. The directory is ``out``, else
    ``results/SCENE-KIND``, or with -2, -3, … behind it where another study is.
    """
    console = console_for(silent=frame.quiet or frame.as_json)
    with bad_input_reported():
        study = make()
        study.cases()
        records = _opened(study, study.kind if scene is None else f"{Path(scene).stem}-{study.kind}", frame)
        directory = records.path.parent
        with _going_on(records, len(study.cases())):
            computed = _computed(study, records, console, frame)
            files = study.write(computed, directory, pictures=not frame.no_plots)
        found = study.findings(computed)
    say(
        {"directory": directory, "files": files, **found.document},
        [*map(Text, study.remarks), *found.shown],
        [("results", file) for file in files],
        where=directory,
        quiet=frame.quiet,
        as_json=frame.as_json,
    )
    if found.code:
        raise typer.Exit(found.code)


def _opened(study: Study, default: str, frame: Frame) -> Records:
    from ..studies.study import Records

    if frame.out is not None or frame.force:
        return Records(study, frame.out or Path("results") / default, replace=frame.force)
    for number in count(1):
        try:
            return Records(study, Path("results") / (default if number == 1 else f"{default}-{number}"))
        except ResultsExist:
            continue
    raise AssertionError("unreachable")


@contextmanager
def _going_on(records: Records, total: int) -> Iterator[None]:
    """Where the study stops, end the command with the cause and how it goes on."""
    from ..monolithic.hybrid_system import ReferenceFailure
    from ..run.outcome import RunStopped

    directory = records.path.parent

    try:
        yield
    except ConnectionError as error:
        fail(BAD_INPUT, str(error))
    except (KeyboardInterrupt, RunStopped, ReferenceFailure, OSError) as error:
        if isinstance(error, OSError) and not records.by_name:
            raise
        there = f"; {len(records.by_name)} of {total} records are in {directory}; springbeam resume {directory} goes on"
        fail(STOPPED, cause_of(error, directory) + there * bool(records.by_name))


def _computed(study: Study, records: Records, console: Console, frame: Frame) -> dict[str, Row]:
    """Return all records, and show meanwhile how far it is."""
    from ..studies.study import dask_cluster, record_all

    total, there = len(study.cases()), len(records.by_name)
    if there == total:
        return record_all(study, records)
    console.print(Text(study.cost()))
    if there:
        console.print(f"{there} of {total} records are there")
    state, left = TextColumn("{task.fields[failed]} failed"), TimeRemainingColumn()
    bar = progress_bar(BarColumn(bar_width=20), MofNCompleteColumn(), state, left, quiet=frame.quiet or frame.as_json)
    task, failed = bar.add_task("", total=total, completed=there, failed=0), [0]

    def report(record: Row) -> None:
        failed[0] += study.failed(record)
        bar.update(task, advance=1, failed=failed[0])

    processes = (frame.workers or os.cpu_count() or 1) if study.parallel else 0
    with records, dask_cluster(frame.scheduler) if frame.scheduler else nullcontext() as cluster, bar:
        return record_all(study, records, processes, cluster, report)
