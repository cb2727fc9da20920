"""A study: a table of named cases, each giving one record.

* A `Study` holds what was asked for as plain values. They alone decide its cases, so `springbeam resume` needs no more
  than the results to go on.
* A case is computed by itself, in any order, in this process or by workers. Its record is plain JSON data.
* Each record is in ``study.jsonl`` of the results as soon as its case is done. The first line there says which study
  it is, with which version and which FMUs. Nothing is written before the FMUs are found, and nothing stays where no
  case was done.
* A case whose record is there is not computed again. A study with all records is shown at once.
* Tables, pictures and files are made from the records alone (`Study.findings`, `Study.write`).

`record_all` computes, `Records` is the file, `cli/study.py` the frame that all commands share.
"""

from __future__ import annotations

import errno
import multiprocessing
import os
import signal
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from importlib import import_module, metadata
from itertools import chain, islice
from pathlib import Path
from typing import Any, ClassVar

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import from_json, to_json

from ..bodies.factory import fingerprints
from ..results.directory import ResultsExist, ResultsUnreadable, RunDirectory, lock
from ..scene import Scene, load_scene

FILE = "study.jsonl"
#: Where `study_in` finds each kind.
_STUDIES = {
    "sweep": ".sweep:Sweep",
    "tradeoff": ".tradeoff:Tradeoff",
    "converge": ".converge:Converge",
    "stability": ".stability.grid:Grid",
    "crosscheck": ".crosscheck.comparison:Crosscheck",
    "orders": ".crosscheck.orders:Orders",
    "critical": ".stability.critical:Critical",
}
Record = dict[str, Any]
#: ``report(record)``, called for each record that is new.
Report = Callable[[Record], None]
#: Cases under way on a cluster.
_AHEAD_ON_CLUSTER = 256
#: The matrices are small: more threads of a worker only wait for each other.
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


@dataclass(frozen=True)
class Findings:
    """What the records of a study say."""

    document: dict[str, Any]  #: for programs (``--json``)
    shown: list[Any]  #: tables and lines for a terminal
    passed: bool = True


class Study(BaseModel, ABC):
    """What was asked for. A subclass adds its settings, its cases, and what it makes of their records."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: ClassVar[str]  #: names the command, and the files of the results
    files: ClassVar[tuple[str, ...]]  #: patterns of all that `write` may write
    #: Whether workers compute the cases; else they follow one another here, where they are timed or too few.
    parallel: ClassVar[bool] = False

    scene: Scene | None = None
    quick: bool = False  #: a smaller table of cases
    remarks: tuple[str, ...] = ()  #: said before what is found

    @abstractmethod
    def cases(self) -> Mapping[str, Any]:
        """Return what `record` takes, by name. Raises SceneError if there is nothing to compute."""

    @abstractmethod
    def record(self, case: Any) -> Record:
        """Compute one case; dataclasses and arrays in a record become JSON data, too.

        Raises FmuError if an FMU cannot be loaded.
        """

    @abstractmethod
    def findings(self, records: Mapping[str, Record]) -> Findings:
        """Judge the records, which come in the order of the cases."""

    @abstractmethod
    def write(self, records: Mapping[str, Record], directory: Path, *, pictures: bool) -> list[Path]:
        """Write tables and pictures into ``directory``; return the files, the main table first."""

    def lost(self, cause: str) -> Record:
        """Return the record of a case whose worker process has died. Raises ChildProcessError if there is none."""
        raise ChildProcessError(errno.ECHILD, cause)

    def failed(self, record: Record) -> bool:
        """Tell whether the progress bar counts a record as failed."""
        return bool(record.get("cause"))

    def cost(self) -> str:
        """Say how much there is to compute."""
        return f"{len(self.cases())} runs"

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
        self.by_name: dict[str, Record] = {}
        self._whole = 0  #: bytes of complete lines
        self._replaced = study.files  #: patterns of what the first record removes
        if replace:
            with suppress(ResultsUnreadable, KeyError):
                self._replaced += _class_of(_read(self.path)[0]["study"]).files
            return
        settings, self.by_name, self._whole = _read(self.path)
        if self._whole and settings != self._settings:
            raise ResultsExist(f"{directory}: holds another study, or one of another springbeam or FMU ({FILE})")
        if not self._whole and directory.is_dir() and any(file != self.path for file in directory.iterdir()):
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

    def add(self, name: str, record: Record) -> None:
        """Append a record; the first one removes what it replaces. Raises OSError if the disk is full."""
        if not self._begun:
            self._begun = True
            self._file.truncate(self._whole)  # without a line that was cut short
            if not self._whole:
                for stale in chain.from_iterable(map(self.path.parent.glob, self._replaced)):
                    stale.unlink()
                self._write(self._settings)
        self._write({"case": name, "record": record})
        self.by_name[name] = record

    def _write(self, line: dict[str, Any]) -> None:
        left = to_json(line) + b"\n"
        while left:
            left = left[self._file.write(left) :]


def _read(path: Path) -> tuple[dict[str, Any], dict[str, Record], int]:
    """Return the study, its records and the bytes of the complete lines; nothing where there is no file."""
    lines = path.read_bytes().splitlines(keepends=True) if path.exists() else []
    if lines and not lines[-1].endswith(b"\n"):
        lines.pop()
    try:
        settings, *entries = map(from_json, lines or [b"{}"])
        return settings, {entry["case"]: entry["record"] for entry in entries}, sum(map(len, lines))
    except (ValueError, KeyError, TypeError) as error:
        raise ResultsUnreadable(f"{path}: not a file of records: {error}") from error


def _class_of(kind: str) -> type[Study]:
    """Return the class of studies of ``kind``. Raises KeyError if it is not known."""
    module, name = _STUDIES[kind].split(":")
    found: type[Study] = getattr(import_module(module, __package__), name)
    return found


def study_in(directory: Path) -> Study | None:
    """Return the study that ``directory`` holds, ``None`` if it holds none.

    Raises
    ------
    ResultsUnreadable
        If it cannot be read, or cannot go on with this springbeam and these FMUs.
    """
    first, _, _ = _read(directory / FILE)
    if not first:
        return None
    try:
        study = _class_of(first["study"]).model_validate(first["settings"])
    except (KeyError, ValidationError) as error:
        raise ResultsUnreadable(f"{directory / FILE}: holds no study that is known: {error}") from error
    if first != study.settings():
        raise ResultsUnreadable(
            f"{directory}: was begun with another springbeam or other FMUs; the first command with --force begins anew"
        )
    return study


# -- computing ------------------------------------------------------------------------------------------------------


def record_all(
    study: Study,
    records: Records | None = None,
    workers: int = 0,
    cluster: Executor | None = None,
    report: Report = lambda record: None,
) -> dict[str, Record]:
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
    lost: dict[str, Record] = {}
    with closing(_computed(study, todo, workers, cluster)) as computed:
        for name, made in computed:
            if made is None:  # not kept: the next time it is tried again
                lost[name] = record = study.lost("its worker process died: an FMU has crashed, or memory ran out")
            else:
                record = from_json(to_json(made, inf_nan_mode="null", fallback=lambda value: value.tolist()))
                (known.__setitem__ if records is None else records.add)(name, record)
            report(record)
    return {name: known[name] if name in known else lost[name] for name in cases}


def _computed(
    study: Study, todo: dict[str, Any], workers: int, cluster: Executor | None
) -> Generator[tuple[str, Record | None]]:
    """Yield records as they come, ``None`` where a worker has died."""
    if cluster is not None:
        from distributed import KilledWorker

        for name, future in _as_done(cluster, study, todo, _AHEAD_ON_CLUSTER):
            yield name, None if isinstance(future.exception(), KilledWorker) else future.result()
    elif workers and todo:
        yield from _by_processes(study, todo, workers)
    else:
        yield from ((name, study.record(case)) for name, case in todo.items())


def _by_processes(study: Study, todo: dict[str, Any], workers: int) -> Iterator[tuple[str, Record | None]]:
    """Yield records as they come. Where a process dies, the cases that were under way are tried again, one by one."""
    suspects: dict[str, Any] = {}
    while todo or suspects:
        batch, count, ahead = (suspects, 1, 1) if suspects else (todo, min(workers, len(todo)), 2 * workers)
        died: list[str] = []
        with _pool(count) as pool:
            for name, future in _as_done(pool, study, dict(batch), ahead):
                if isinstance(future.exception(), BrokenProcessPool):
                    died.append(name)
                else:
                    del batch[name]
                    yield name, future.result()
        if suspects:  # which died alone
            for name in died:
                del suspects[name]
                yield name, None
        else:
            suspects = {name: todo.pop(name) for name in died}


def _as_done(
    executor: Executor, study: Study, cases: Mapping[str, Any], ahead: int
) -> Iterator[tuple[str, Future[Record]]]:
    """Yield cases as they are done; at most ``ahead`` are under way."""
    waiting = iter(cases.items())
    running: dict[Future[Record], str] = {}
    while True:
        try:
            for name, case in islice(waiting, ahead - len(running)):
                running[executor.submit(study.record, case)] = name
        except BrokenProcessPool:  # which the cases that are under way tell too
            waiting = iter(())
        if not running:
            return
        for future in wait(running, return_when=FIRST_COMPLETED).done:
            yield running.pop(future), future


@contextmanager
def _pool(workers: int) -> Iterator[Executor]:
    """Open a pool of processes, which are ended at once where its user gives up."""
    others, environment = set(multiprocessing.active_children()), dict(os.environ)
    os.environ.update(_ONE_THREAD)
    try:
        with ProcessPoolExecutor(
            workers, multiprocessing.get_context("spawn"), signal.signal, (signal.SIGINT, signal.SIG_IGN)
        ) as pool:
            try:
                yield pool
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                for child in set(multiprocessing.active_children()) - others:
                    child.terminate()
                raise
    finally:
        for name in _ONE_THREAD:
            os.environ.pop(name)
        os.environ.update(environment)


@contextmanager
def dask_cluster(scheduler: str) -> Iterator[Executor]:
    """Open the Dask cluster at ``scheduler``. Raises ConnectionError if it cannot be reached or its workers differ."""
    try:
        from distributed import Client

        client = Client(scheduler, timeout=10.0)
    except ImportError as error:
        raise ConnectionError(f"--scheduler: {error}; pip install distributed") from error
    except (OSError, ValueError) as error:
        raise ConnectionError(f"--scheduler {scheduler}: cannot be reached: {error}") from error
    with client:
        own = metadata.version("springbeam")
        try:
            theirs = client.run(metadata.version, "springbeam")
        except Exception as error:  # whatever a worker without the package raises
            raise ConnectionError(f"the workers lack springbeam {own}: {error}; install it there") from error
        if set(theirs.values()) != {own}:
            others = ", ".join(f"{address} has {version}" for address, version in theirs.items()) or "there are none"
            raise ConnectionError(f"the workers need springbeam {own}, as is here; {others}")
        yield client.get_executor(pure=False)
