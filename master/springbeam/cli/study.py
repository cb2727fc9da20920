"""The frame of all commands that compute a study: where records go, cost, progress, how it stops and goes on."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
from rich.text import Text

from ..results.directory import ResultsExist
from .common import (
    BAD_INPUT,
    STOPPED,
    bad_input_reported,
    cause_of,
    console_for,
    fail,
    print_json,
    progress_bar,
)

if TYPE_CHECKING:
    from ..studies.study import Records, Row, Study

StudyOption = Annotated[
    Path | None,
    typer.Option("--out", "-o", metavar="DIR", help="Directory of the results; a study that was begun there goes on."),
]
WorkersOption = Annotated[
    int | None, typer.Option("--workers", metavar="N", min=1, help="Local processes. Default: one per core.")
]
SchedulerOption = Annotated[
    str | None,
    typer.Option("--scheduler", metavar="ADDRESS", help="Run on this Dask cluster instead of local processes."),
]
QuickOption = Annotated[bool, typer.Option("--quick", help="A smaller study, for a first look.")]
#: Where no bar is shown, a study that takes longer, and so much more, says how long the rest takes [s].
_LONG = 10.0


@dataclass(frozen=True)
class Frame:
    """The options of all studies; ``workers`` and ``scheduler`` of those whose cases workers compute."""

    out: Path | None
    force: bool
    no_plots: bool
    quiet: bool
    as_json: bool
    workers: int | None = None
    scheduler: str | None = None


def carry_out(make: Callable[[], Study], scene: str | None, frame: Frame) -> None:
    """Compute what of a study is not yet in its directory, write its files, and show what was found.

    ``make`` returns the study, and may raise what bad input raises. The directory is ``out``, else
    ``results/SCENE-KIND``, or with -2, -3, … behind it where another study is.
    """
    from .watchdog import watched

    console = console_for(silent=frame.quiet or frame.as_json)
    with bad_input_reported():
        study = make()
        study.cases()
        records = _opened(study, study.kind if scene is None else f"{Path(scene).stem}-{study.kind}", frame)
        directory = records.path.parent
        with _going_on(records, len(study.cases())) as cut_short:
            with watched(cut_short):
                computed = _computed(study, records, console, frame)
            files = study.write(computed, directory, pictures=not frame.no_plots)
        found = study.findings(computed)
    if frame.as_json:
        print_json({"directory": directory, "files": files, **found.document})
    elif frame.quiet:
        typer.echo(directory)
    for part in (*map(Text, study.remarks), *found.shown):
        console.print(part)
    for file in files:
        console.print(Text(f"results   {file}"), soft_wrap=True)
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
def _going_on(records: Records, total: int) -> Iterator[Callable[[str], str]]:
    """Where the study stops, end the command with the cause and how it goes on; yield what says that of a cause."""
    from ..monolithic.hybrid_system import ReferenceFailure
    from ..run.outcome import RunStopped

    directory = records.path.parent

    def cut_short(cause: str) -> str:
        if not records.by_name:
            return cause
        there = f"{len(records.by_name)} of {total} records are in {directory}"
        return f"{cause}; {there}; springbeam resume {directory} goes on"

    try:
        yield cut_short
    except ConnectionError as error:
        fail(BAD_INPUT, str(error))
    except (KeyboardInterrupt, RunStopped, ReferenceFailure, OSError) as error:
        if isinstance(error, OSError) and not records.by_name:
            raise
        fail(STOPPED, cut_short(cause_of(error, directory)))


class Rest:
    """How long the rest of a study takes, told from time to time.

    Told first when each of its ``processes`` has made two records since ``began`` [s], and again each time that the
    number of records has doubled; not where what is done, or the rest, takes less than `_LONG`.
    """

    def __init__(self, began: float, processes: int) -> None:
        self._began = self._first = began
        self._told_at = 2 * max(processes, 1)

    def after(self, now: float, done: int, left: int) -> float | None:
        """Return how long the ``left`` records take [s] if it is to be told ``now`` [s], after ``done`` records."""
        if done <= 1:
            self._first = now  # what comes before it, as the start of processes, is not done again
            return None
        seconds = (now - self._first) / (done - 1) * left
        if done < self._told_at or min(now - self._began, seconds) <= _LONG:
            return None
        self._told_at = 2 * done
        return seconds


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
    quiet = frame.quiet or frame.as_json
    bar = progress_bar(BarColumn(bar_width=20), MofNCompleteColumn(), state, left, quiet=quiet)
    task = bar.add_task("", total=total, completed=there, failed=0)
    processes = (frame.workers or os.cpu_count() or 1) if study.parallel else 0
    rest, failed = Rest(monotonic(), processes), 0

    def report(record: Row) -> None:
        nonlocal failed
        failed += study.failed(record)
        bar.update(task, advance=1, failed=failed)
        done = len(records.by_name)
        seconds = rest.after(monotonic(), done - there, total - done)
        if bar.disable and seconds is not None:
            console.print(f"{done} of {total} records; some {seconds:.0f} s more if the others are like them")

    with records, dask_cluster(frame.scheduler) if frame.scheduler else nullcontext() as cluster, bar:
        return record_all(study, records, processes, cluster, report)
