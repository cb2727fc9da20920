"""One engine for experiments: a study is a table of cases, each a run of a scene with other values of some keys.

* The columns of a case are its **axes**: keys of a scene, as ``spring.mass``, with their values, or labels. Its record
  adds columns: how the run ended, **metrics** of it, ``error_…`` beside a **reference**, ``cost_…``.
* A `Study` holds what was asked for as plain values. They alone decide its cases, so the same command
  goes on with what is in the results.
* A case is computed by itself, in any order, in this process or by workers. Each record is in ``study.jsonl`` of the
  results as soon as its case is done. The first line there says which study it is, with which version and which FMUs.
  Nothing is written before the FMUs are found, and nothing stays where no case was done.
* A case whose record is there is not computed again. A study with all records is shown at once.
* `Findings` are made from the records alone: table (``KIND.parquet``, ``KIND.csv``), pictures and what is shown.

`record_all` computes, `Records` is the file, `cli/studies.py` has the commands.
"""

from __future__ import annotations

import ast
import inspect
import multiprocessing
import os
import re
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import closing, contextmanager
from importlib import metadata
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any, ClassVar

from pebble import ProcessExpired, ProcessPool
from pydantic import BaseModel, ConfigDict
from pydantic_core import from_json, to_json

from ..bodies.factory import fingerprints
from ..results.directory import ResultsExist, ResultsUnreadable, RunDirectory, lock
from ..results.trajectory import Trajectory
from ..run.accuracy import simulate
from ..run.outcome import RunStopped
from ..scene import ArgumentError, Scene, SceneError, load_scene, with_changes
from ..scene.scene import split_key
from .metrics import Metric, costs
from .tables import Findings, Row

FILE = "study.jsonl"
#: How the files of studies begin.
_KINDS = ("sweep", "tradeoff", "converge", "stability", "crosscheck", "orders", "fit")
#: ``report(record)``, called for each record that is new.
Report = Callable[[Row], None]
#: Cases under way: on a cluster, and for each process here.
_AHEAD_ON_CLUSTER, _AHEAD = 256, 2
#: The matrices are small: more threads of a worker only wait for each other.
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


class Study(BaseModel, ABC):
    """What was asked for. A subclass adds its settings, its cases, and what it makes of their records."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: ClassVar[str]  #: names the command, and the files of the results begin with it
    #: Whether workers compute the cases; else they follow one another here, where they are timed or too few.
    parallel: ClassVar[bool] = False
    announced: ClassVar[str] = "{} runs"  #: what there is to compute, with the number of cases

    scene: Scene | None = None
    quick: bool = False  #: a smaller table of cases
    remarks: tuple[str, ...] = ()  #: said before what is found

    @property
    def metrics(self) -> dict[str, Metric]:
        """The numbers that are kept of each run. Raises SceneError if one is unknown."""
        return {}

    @abstractmethod
    def cases(self) -> Mapping[str, Row]:
        """Return the axes of each case, by its name. Raises SceneError if there is nothing to compute."""

    def record(self, case: Row) -> Row:
        """Run one case; arrays in a record become lists. Raises FmuError if an FMU cannot be loaded.

        ``status`` is ``done``, ``stopped`` (early) or ``refused`` (bad input), ``error`` says why. Wall times, loading
        included [s], are kept where cases follow one another.
        """
        metrics = self.metrics
        row: Row = {"status": "done", "error": "", "warnings": "", **dict.fromkeys(metrics)}
        began = perf_counter()
        try:
            run = simulate(self.at(case))
            numbers = {name: metric(run) for name, metric in metrics.items()}
            lacking = dict.fromkeys(metric.lacking(run) for metric in metrics.values())
        except SceneError as refused:
            row |= {"status": "refused", "error": str(refused)}
        except RunStopped as stopped:
            row |= {"status": "stopped", "error": str(stopped)}
        else:
            row["warnings"] = "\n".join([*run.summary["warnings"], *filter(None, lacking)])
            row |= numbers | costs(run)
            row |= self.measured(run, case)
        return row if self.parallel else {**row, "cost_wall_time": perf_counter() - began}

    def measured(self, run: Trajectory, case: Row) -> Row:
        """Return what is kept of a run besides metrics and cost."""
        return {}

    def at(self, case: Row) -> Scene:
        """Return the scene of a case. Raises SceneError if it cannot be run."""
        tables: dict[str, Any] = {"accuracy": case["accuracy"]} if "accuracy" in case else {}
        for name, value in case.items():
            if (key := split_key(name)) is not None:  # others are labels
                tables.setdefault(key[0], {})[key[1]] = value
        assert self.scene is not None
        return with_changes(self.scene, **tables)

    def skipped(self, case: Row, records: Mapping[str, Row]) -> Row | None:
        """Return the record of a case that those before it make needless. Asked where cases follow one another."""
        return None

    def lost(self, cause: str) -> Row:
        """Return the record of a case whose worker process has died."""
        return {"status": "lost", "error": cause, "warnings": ""}

    def rows(self, records: Mapping[str, Row]) -> list[Row]:
        """Return a row per case, in their order: its axes and its record."""
        cases = self.cases()
        return [{"index": k, **cases[name], **record} for k, (name, record) in enumerate(records.items())]

    @abstractmethod
    def findings(self, records: Mapping[str, Row]) -> Findings:
        """Judge the records, which come in the order of the cases. The table is named as the study's `kind`."""

    def settings(self) -> dict[str, Any]:
        """Return what tells one study from another, with the files that it needs. Raises FmuError if one is missing."""
        return {
            "study": self.kind,
            "springbeam": metadata.version("springbeam"),
            "files": fingerprints(self.scene or load_scene("soft")),
            "settings": self.model_dump(mode="json", exclude_none=True),
        }


class Records:
    """``study.jsonl`` of a directory: the study in the first line, then a record a line, as they come.

    Within the context the file is open for new records. Results that are replaced stay until there is one.

    Raises
    ------
    ResultsExist
        If the directory holds something else.
    ResultsInUse
        On entry, if another process writes to it.
    FmuError
        If an FMU that the study needs is missing.
    """

    def __init__(self, study: Study, directory: Path, *, replace: bool = False) -> None:
        self._settings, self.path = study.settings(), directory / FILE
        settings, self.by_name, self._whole = ({}, {}, 0) if replace else _read(self.path)
        if settings not in ({}, self._settings):
            raise ResultsExist(f"{directory}: holds another study, or one of another springbeam or FMU ({FILE})")
        if not (settings or replace) and directory.is_dir() and any(file != self.path for file in directory.iterdir()):
            raise ResultsExist(f"{directory}: is not empty and holds no study")

    def __enter__(self) -> Records:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self._file = self.path.open("ab", buffering=0)
        lock(self._file, self.path)
        self._begun = False
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()
        if self.path.stat().st_size == 0:
            self.path.unlink()
            RunDirectory(self.path.parent).discard()

    def add(self, name: str, record: Row) -> None:
        """Append a record; the first one removes what it replaces. Raises OSError if the disk is full."""
        if not self._begun:
            self._begun = True
            self._file.truncate(self._whole)  # without a line that was cut short
            if not self._whole:
                for stale in self.path.parent.iterdir():
                    if re.split(r"[.-]", stale.name)[0] in _KINDS:
                        stale.unlink()
                self._write(self._settings)
        self._write({"case": name, "record": record})
        self.by_name[name] = record

    def _write(self, line: dict[str, Any]) -> None:
        left = to_json(line) + b"\n"
        while left:
            left = left[self._file.write(left) :]


def _read(path: Path) -> tuple[dict[str, Any], dict[str, Row], int]:
    """Return the study, its records and the bytes of the complete lines; nothing where there is no file."""
    lines = path.read_bytes().splitlines(keepends=True) if path.exists() else []
    if lines and not lines[-1].endswith(b"\n"):
        lines.pop()
    try:
        settings, *entries = map(from_json, lines or [b"{}"])
        return settings, {entry["case"]: entry["record"] for entry in entries}, sum(map(len, lines))
    except (ValueError, KeyError, TypeError) as error:
        raise ResultsUnreadable(f"{path}: not a file of records: {error}") from error


def troubles(records: Mapping[str, Row]) -> list[str]:
    """Return in how many cases there were errors, and warnings, with the first of each."""
    found = []
    for kind in ("error", "warnings"):
        said = [(name, record[kind]) for name, record in records.items() if record.get(kind)]
        if said:
            name, text = said[0]
            found.append(f"{kind:<10}in {len(said)} cases, first in {name}: {text.splitlines()[0]}")
    return found


# -- computing ------------------------------------------------------------------------------------------------------


def record_all(
    study: Study,
    records: Records | None = None,
    workers: int = 0,
    cluster: Executor | None = None,
    report: Report = lambda record: None,
) -> dict[str, Row]:
    """Compute the cases that ``records`` lacks, and return all records in the order of the cases.

    Parameters
    ----------
    records
        Where records are kept; ``None``: nowhere.
    workers
        Processes; 0: this one.
    cluster
        Takes the place of processes of this machine.

    Raises
    ------
    FmuError
        If an FMU cannot be loaded.
    """
    cases = study.cases()
    known = {} if records is None else records.by_name
    todo = {name: case for name, case in cases.items() if name not in known}
    lost: dict[str, Row] = {}
    with closing(_computed(study, todo, known, workers, cluster)) as computed:
        for name, made in computed:
            if made is None:  # not kept: the next time it is tried again
                lost[name] = record = study.lost("its worker process died: an FMU has crashed, or memory ran out")
            else:
                record = from_json(to_json(made, inf_nan_mode="null", fallback=lambda value: value.tolist()))
                (known.__setitem__ if records is None else records.add)(name, record)
            report(record)
    return {name: known[name] if name in known else lost[name] for name in cases}


def _computed(
    study: Study, todo: dict[str, Row], known: Mapping[str, Row], workers: int, cluster: Executor | None
) -> Generator[tuple[str, Row | None]]:
    """Yield records as they come, ``None`` where a worker has died."""
    if cluster is not None:
        from distributed import KilledWorker  # after several deaths, as the cluster is configured

        yield from _as_done(cluster.submit, study, todo, _AHEAD_ON_CLUSTER, KilledWorker)
    elif workers and todo:
        with _processes(min(workers, len(todo))) as submit:
            yield from _as_done(submit, study, todo, _AHEAD * workers, ProcessExpired)
    else:
        for name, case in todo.items():
            skipped = study.skipped(case, known)
            yield name, study.record(case) if skipped is None else skipped


def _as_done(
    submit: Callable[..., Future[Row]], study: Study, todo: Mapping[str, Row], ahead: int, died: type[Exception]
) -> Iterator[tuple[str, Row | None]]:
    """Yield records as they come, from cases of which at most ``ahead`` are under way; one that died is tried again."""
    waiting, again = iter(todo.items()), set()
    running: dict[Future[Row], str] = {}
    while True:
        for name, case in islice(waiting, ahead - len(running)):
            running[submit(study.record, case)] = name
        if not running:
            return
        for future in wait(running, return_when=FIRST_COMPLETED).done:
            name = running.pop(future)
            if not isinstance(future.exception(), died):
                yield name, future.result()
            elif name in again:
                yield name, None
            else:
                again.add(name)
                running[submit(study.record, todo[name])] = name


def _refuse_unguarded(workers: int) -> None:
    """Raise ArgumentError if a script asks for processes outside of ``if __name__ == "__main__"``.

    Each process runs the script again up to there, and would ask for processes as well.
    """
    main = sys.modules["__main__"]
    path, frame = getattr(main, "__file__", None), inspect.currentframe()
    while frame is not None and (frame.f_code.co_filename, frame.f_code.co_name) != (path, "<module>"):
        frame = frame.f_back
    if frame is None or path is None or getattr(main.__spec__, "name", "").endswith("__main__"):
        return  # no script, or the module of a package, which is not run again
    for statement in ast.parse(Path(path).read_bytes()).body:
        guarded = isinstance(statement, ast.If) and "__name__" in ast.unparse(statement.test)
        if statement.lineno <= frame.f_lineno <= (statement.end_lineno or 0) and not guarded:
            place = f"{path}, line {frame.f_lineno}"
            raise ArgumentError(f'--workers {workers}: {place} must stand under if __name__ == "__main__":')


@contextmanager
def _processes(workers: int) -> Iterator[Callable[..., Future[Row]]]:
    """Open a pool of processes, of which one that dies is replaced; they are ended at once if its user gives up.

    They end without clearing up after themselves, so the folder of their temporary files is removed here.
    """
    _refuse_unguarded(workers)
    with TemporaryDirectory(prefix="springbeam-", ignore_cleanup_errors=True) as folder:
        own = {**_ONE_THREAD, "TMPDIR": folder}
        before = {name: os.environ.get(name) for name in own}
        os.environ.update(own)
        pool = ProcessPool(workers, context=multiprocessing.get_context("spawn"))
        try:
            yield lambda function, case: pool.schedule(function, (case,))
            pool.close()
        finally:
            pool.stop()
            pool.join()
            for name, value in before.items():
                os.environ.pop(name) if value is None else os.environ.update({name: value})


@contextmanager
def dask_cluster(scheduler: str) -> Iterator[Executor]:
    """Open the Dask cluster at ``scheduler``. Raises SceneError if it cannot be reached or its workers differ."""
    try:
        from distributed import Client

        client = Client(scheduler, timeout=10.0)
    except ImportError as error:
        raise ArgumentError(f"--scheduler: {error}; pip install distributed") from error
    except (OSError, ValueError) as error:
        raise ArgumentError(f"--scheduler {scheduler}: cannot be reached: {error}") from error
    with client:
        own = metadata.version("springbeam")
        told: Any = client.get_versions(packages=["springbeam"])
        theirs = {address: worker["packages"]["springbeam"] for address, worker in told["workers"].items()}
        if set(theirs.values()) != {own}:
            others = ", ".join(f"{address} has {version}" for address, version in theirs.items()) or "there are none"
            raise SceneError(f"the workers need springbeam {own}, as is here; {others}")
        yield client.get_executor(pure=False)
