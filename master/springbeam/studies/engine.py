"""Compute cases, independently and in any order: in this process, in several processes, or on a cluster."""

from __future__ import annotations

import ast
import inspect
import multiprocessing
import os
import sys
from collections.abc import Callable, Generator, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import closing, contextmanager
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from pebble import ProcessExpired, ProcessPool
from pydantic_core import from_json, to_json

from ..scene import ArgumentError, SceneError
from ..version import __version__
from .tables import Row

#: Makes the record of a case of its axes; arrays in it become lists. It is sent to workers.
Measure = Callable[[Row], Row]
Report = Callable[[Row], None]
#: ``keep(name, record)``, called for each record that is new and whole.
Keep = Callable[[str, Row], None]
#: Cases in progress: on a cluster, and for each process here.
_AHEAD_ON_CLUSTER = 256
_AHEAD = 2
#: The matrices are small: more threads of a worker would only wait for each other.
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


def lost(cause: str) -> Row:
    """Return the record of a case whose worker process has died."""
    return {"status": "lost", "error": cause, "warnings": ""}


def record_all(
    cases: Mapping[str, Row],
    measure: Measure,
    known: Mapping[str, Row] | None = None,
    keep: Keep = lambda name, record: None,
    workers: int = 0,
    cluster: Executor | None = None,
    report: Report = lambda record: None,
    lost: Callable[[str], Row] = lost,
) -> dict[str, Row]:
    """Compute the cases that are not ``known``, and return the records of all in the order of the cases.

    Parameters
    ----------
    cases
        The axes of each case, by its name.
    measure
        Makes the record of a case.
    known
        Existing records.
    keep
        Stores a new record before the next case is finished.
    workers
        Processes; 0: this one, where cases follow one another.
    cluster
        Replaces processes of this machine.
    report
        Called with each new record.
    lost
        Makes the record of a case whose worker has died twice, from the cause. It is not kept, so that the case is
        tried again the next time.

    Raises
    ------
    FmuError
        If an FMU cannot be loaded.
    """
    records = dict(known or {})
    todo = {name: case for name, case in cases.items() if name not in records}
    with closing(_computed(todo, measure, workers, cluster)) as computed:
        for name, made in computed:
            if made is None:
                records[name] = lost("its worker process died: an FMU has crashed, or memory ran out")
            else:
                records[name] = from_json(to_json(made, inf_nan_mode="null", fallback=lambda value: value.tolist()))
                keep(name, records[name])
            report(records[name])
    return {name: records[name] for name in cases}


def _computed(
    todo: Mapping[str, Row], measure: Measure, workers: int, cluster: Executor | None
) -> Generator[tuple[str, Row | None]]:
    """Yield records as they come, ``None`` where a worker has died."""
    if cluster is not None:
        from distributed import KilledWorker  # after several deaths, as the cluster is configured

        yield from _as_done(cluster.submit, measure, todo, _AHEAD_ON_CLUSTER, KilledWorker)
    elif workers and todo:
        with _processes(min(workers, len(todo))) as submit:
            yield from _as_done(submit, measure, todo, _AHEAD * workers, ProcessExpired)
    else:
        for name, case in todo.items():
            yield name, measure(case)


def _as_done(
    submit: Callable[..., Future[Row]], measure: Measure, todo: Mapping[str, Row], ahead: int, died: type[Exception]
) -> Iterator[tuple[str, Row | None]]:
    """Yield finished records, with at most ``ahead`` cases in progress; a case whose process died is tried again."""
    waiting = iter(todo.items())
    again = set()
    running: dict[Future[Row], str] = {}
    while True:
        for name, case in islice(waiting, ahead - len(running)):
            running[submit(measure, case)] = name
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
                running[submit(measure, todo[name])] = name


def _refuse_unguarded(workers: int) -> None:
    """Raise ArgumentError if a script starts processes outside of ``if __name__ == "__main__"``.

    Each process runs the script again up to there, and would start processes as well.
    """
    main = sys.modules["__main__"]
    path = getattr(main, "__file__", None)
    frame = inspect.currentframe()
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
    """Open a pool of processes; one that dies is replaced, and an exception of the caller ends all at once.

    They end without cleaning up, so the folder of their temporary files is removed here.
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
        own = __version__
        known: Any = client.get_versions(packages=["springbeam"])
        theirs = {address: worker["packages"]["springbeam"] for address, worker in known["workers"].items()}
        if set(theirs.values()) != {own}:
            others = ", ".join(f"{address} has {version}" for address, version in theirs.items()) or "there are none"
            raise SceneError(f"the workers need springbeam {own}, as is here; {others}")
        yield client.get_executor(pure=False)
