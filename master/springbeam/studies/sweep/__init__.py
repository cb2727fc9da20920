"""Many runs of one scene on Dask: a row of metrics per run, errors as rows.

The sweep's directory holds ``sweep.json`` (what is swept), ``parts/`` (rows as they come) and, once all are there,
``sweep.parquet`` with the rows in the order of the design. The rows depend on the design alone: not on the
number of workers, nor on the order in which they finish.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, perf_counter
from typing import TYPE_CHECKING, Any

from ...bodies.protocol import FmuError
from ...run.outcome import RunStopped
from ...scene import Scene, SceneError, scene_from_dict
from ..accuracy import simulate
from . import stroboscopic
from .design import Axis, compatible, varied
from .metrics import METRICS, PRINCIPAL

if TYPE_CHECKING:
    import pyarrow as pa
    from distributed import Client

__all__ = ["METRICS", "PRINCIPAL", "Sweep", "SweepError", "cluster", "finished", "rows", "run"]

#: Rows are written at least this often [s].
_WRITE_SECONDS = 5.0
#: Tasks handed to the scheduler ahead of what has finished, per worker.
_AHEAD = 4
#: Runs that take less together are handed out as one task [s]: Dask takes some 6 ms for each.
_TASK_SECONDS = 1.0
TABLE, DESCRIPTION, PARTS, PICTURE = "sweep.parquet", "sweep.json", "parts", "sweep.png"


STATUSES = ("done", "stopped", "refused", "lost")


class SweepError(RuntimeError):
    """A sweep that cannot go on; the message says why and what to do."""


@dataclass(frozen=True)
class Sweep:
    """The definition of a sweep. Raises SceneError if one of the axes has no effect."""

    scene: Scene
    axes: tuple[Axis, ...]
    values: Sequence[tuple[Any, ...]]  #: of the axes, per run
    metrics: tuple[str, ...]
    #: Whether each run is also seen once a period of its drive.
    stroboscopic: bool = False

    def __post_init__(self) -> None:
        compatible(self.scene, self.axes)
        if self.stroboscopic:
            stroboscopic.drive(self.scene)

    def description(self) -> dict[str, Any]:
        """Return what tells one sweep from another, as it goes into ``sweep.json``."""
        design = json.dumps(self.values)
        return {
            "scene": self.scene.model_dump(exclude_none=True),
            "axes": [axis.name for axis in self.axes],
            "runs": len(self.values),
            "design": hashlib.sha256(design.encode()).hexdigest(),
            "metrics": list(self.metrics),
            **({"stroboscopic": True} if self.stroboscopic else {}),
        }


def row(
    scene: Scene, axes: Sequence[Axis], values: Sequence[Any], metrics: Sequence[str], once_a_period: bool = False
) -> dict[str, Any]:
    """Run once. ``status`` is ``done``, ``stopped`` (early) or ``refused`` (bad input), ``error`` says why.

    ``once_a_period`` adds what `stroboscopic` observes.
    """
    blank: dict[str, Any] = dict.fromkeys(metrics)
    try:
        run = simulate(varied(scene, axes, values))
    except SceneError as error:
        return {"status": "refused", "error": str(error), "warnings": "", **blank}
    except RunStopped as error:
        return {"status": "stopped", "error": str(error), "warnings": "", **blank}
    found: dict[str, Any] = {name: METRICS[name](run) for name in metrics}
    if once_a_period:
        found |= stroboscopic.observed(run)
    return {"status": "done", "error": "", "warnings": "\n".join(run.summary["warnings"]), **found}


def run(
    sweep: Sweep, directory: Path, client: Client, progress: Callable[[int, int, int], None] | None = None
) -> dict[str, int]:
    """Run what of the sweep is not yet in ``directory``, on the workers of ``client``.

    Parameters
    ----------
    progress
        ``progress(done, total, failed)``, called as rows come.

    Returns
    -------
    dict
        Number of rows by status.

    Raises
    ------
    SweepError
        If the directory holds another sweep, or a worker cannot run it.
    """
    import pyarrow.parquet as pq

    _claim(sweep, directory)
    _check_workers(client)
    parts = _Parts(sweep, directory / PARTS)
    finished = parts.finished
    total, counts = len(sweep.values), dict.fromkeys(STATUSES, 0)
    for status in finished.values():
        counts[status] += 1
    todo = [index for index in range(total) if index not in finished]
    if progress is not None:
        progress(len(finished), total, len(finished) - counts["done"])
    for index, result in _results(sweep, todo, client):
        parts.add(index, result)
        counts[result["status"]] += 1
        if progress is not None:
            progress(sum(counts.values()), total, sum(counts.values()) - counts["done"])
    parts.flush()
    temporary = directory / (TABLE + ".new")
    pq.write_table(parts.table(), temporary)
    os.replace(temporary, directory / TABLE)
    return counts


def finished(sweep: Sweep, directory: Path) -> dict[str, int] | None:
    """Return the number of rows by status of a sweep that has nothing left to run; ``None`` if there is something.

    Raises SweepError if the directory holds another sweep.
    """
    if not (directory / TABLE).exists():
        return None
    _claim(sweep, directory)
    statuses = rows(directory)["status"]
    counts = {status: statuses.count(status) for status in STATUSES}
    return None if counts["lost"] else counts


def rows(directory: str | Path) -> dict[str, list[Any]]:
    """Read a finished sweep: ``index``, the varied keys, ``status``, ``error``, ``warnings``, the metrics."""
    import pyarrow.parquet as pq

    columns: dict[str, list[Any]] = pq.read_table(Path(directory) / TABLE).to_pydict()
    return columns


@contextmanager
def cluster(scheduler: str | None, workers: int | None) -> Iterator[Client]:
    """Open a Dask client: of the cluster at ``scheduler``, or of local processes that listen on loopback only.

    Raises
    ------
    SweepError
        If the scheduler cannot be reached.
    """
    import dask
    from distributed import Client, LocalCluster

    dask.config.set({"distributed.logging.distributed": "critical"})
    if scheduler is not None:
        try:
            client = Client(scheduler, timeout=10.0)
        except (OSError, ValueError) as error:
            raise SweepError(f"--scheduler {scheduler}: cannot be reached: {error}") from error
        with client:
            yield client
        return
    with (
        LocalCluster(
            n_workers=workers or os.cpu_count() or 1,
            threads_per_worker=1,  # a run holds Python's lock
            processes=True,
            host="127.0.0.1",
            dashboard_address="127.0.0.1:0",
        ) as local,
        Client(local) as client,
    ):
        yield client


def _claim(sweep: Sweep, directory: Path) -> None:
    """Claim the directory for this sweep: new, or one that was begun."""
    directory.mkdir(parents=True, exist_ok=True)
    file, description = directory / DESCRIPTION, sweep.description()
    if file.exists():
        if json.loads(file.read_text(encoding="utf-8")) != description:
            raise SweepError(f"{directory}: holds another sweep (see {DESCRIPTION}); --out DIR names another directory")
        return
    if any(directory.iterdir()):
        raise SweepError(f"{directory}: is not empty and holds no sweep; --out DIR names another directory")
    file.write_text(json.dumps(description, indent=1), encoding="utf-8")


def _version() -> str:
    from importlib.metadata import version

    return version("springbeam")


def _check_workers(client: Client) -> None:
    own = _version()
    try:
        theirs = client.run(_version)
    except Exception as error:  # whatever a worker without the package raises
        raise SweepError(f"the workers cannot load springbeam {own}: {error}; install it where they run") from error
    if not theirs:
        raise SweepError("the scheduler has no workers; start some, or leave out --scheduler")
    for address, version in theirs.items():
        if version != own:
            raise SweepError(f"the worker {address} has springbeam {version}, this is {own}; install the same version")


def _task(
    scene: dict[str, Any],
    axes: Sequence[Axis],
    several: Sequence[Sequence[Any]],
    metrics: Sequence[str],
    once_a_period: bool,
) -> tuple[list[dict[str, Any]], float]:
    """Return the rows of several runs, and the seconds that they took."""
    began = perf_counter()
    try:
        found = [row(scene_from_dict(scene), axes, values, metrics, once_a_period) for values in several]
    except FmuError as error:  # an exception would be in the worker's log with its traceback
        found = [{"status": "no FMU", "error": str(error)}]
    return found, perf_counter() - began


def _results(sweep: Sweep, todo: Sequence[int], client: Client) -> Iterator[tuple[int, dict[str, Any]]]:
    from distributed import KilledWorker, as_completed

    shared = sweep.scene.model_dump(exclude_none=True)
    workers = max(1, len(client.scheduler_info()["workers"]))
    left, seconds, runs = list(reversed(todo)), 0.0, 0
    queue = as_completed()

    def submit(indices: Sequence[int]) -> None:
        values = [sweep.values[index] for index in indices]
        key = ("springbeam", *indices)
        of_sweep = (sweep.metrics, sweep.stroboscopic)
        queue.add(client.submit(_task, shared, sweep.axes, values, *of_sweep, key=key, pure=False))

    def submit_next() -> None:
        if left:
            # Long enough for Dask, yet small shares of what is left, so that all workers end together.
            wanted = int(_TASK_SECONDS * runs / seconds) if seconds > 0.0 else 1
            share = len(left) // (_AHEAD * workers)
            submit([left.pop() for _ in range(max(1, min(wanted, share)))])

    for _ in range(_AHEAD * workers):
        submit_next()
    for future in queue:
        indices = future.key[1:]
        try:
            found, took = future.result()
            seconds, runs = seconds + took, runs + len(found)
        except KilledWorker as error:
            if len(indices) > 1:  # which of them it was shows alone
                for index in indices:
                    submit([index])
                continue
            found = [{"status": "lost", "error": f"its workers died: {error}", "warnings": ""}]
        future.release()
        submit_next()
        for index, result in zip(indices, found, strict=False):
            if result["status"] == "no FMU":
                raise SweepError(result["error"])
            yield index, result


class _Parts:
    """Rows on disk as they come, in small Parquet files; a file appears whole or not at all."""

    def __init__(self, sweep: Sweep, directory: Path) -> None:
        import pyarrow as pa

        self._sweep, self._directory = sweep, directory
        directory.mkdir(exist_ok=True)
        self._pending: list[dict[str, Any]] = []
        self._written = monotonic()
        fields = [("index", pa.int64())]
        for k, axis in enumerate(sweep.axes):
            sample = sweep.values[0][k]
            kind = pa.bool_() if isinstance(sample, bool) else pa.string() if isinstance(sample, str) else pa.float64()
            fields.append((axis.name, kind))
        fields += [(name, pa.string()) for name in ("status", "error", "warnings")]
        fields += [(name, pa.float64()) for name in sweep.metrics]
        if sweep.stroboscopic:
            fields += [(stroboscopic.POINTS, pa.list_(pa.float64())), (stroboscopic.PEAK, pa.float64())]
        self._schema = pa.schema(fields)
        #: Status of the rows that need not be run again.
        self.finished: dict[int, str] = {}
        for table in self._tables():
            for index, status in zip(table["index"].to_pylist(), table["status"].to_pylist(), strict=True):
                if status != "lost":
                    self.finished[index] = status

    def _files(self) -> list[Path]:
        return sorted(self._directory.glob("part-*.parquet"))

    def _tables(self) -> Iterator[pa.Table]:
        import pyarrow.parquet as pq

        for file in self._files():
            yield pq.read_table(file, schema=self._schema)

    def add(self, index: int, result: dict[str, Any]) -> None:
        values = dict(zip((axis.name for axis in self._sweep.axes), self._sweep.values[index], strict=True))
        self._pending.append({"index": index, **values, **result})
        if monotonic() - self._written > _WRITE_SECONDS:
            self.flush()

    def flush(self) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        self._written = monotonic()
        if not self._pending:
            return
        files = self._files()
        number = int(files[-1].stem.removeprefix("part-")) + 1 if files else 0
        temporary = self._directory / "new.parquet"
        pq.write_table(pa.Table.from_pylist(self._pending, schema=self._schema), temporary)
        os.replace(temporary, self._directory / f"part-{number:06d}.parquet")
        self._pending.clear()

    def table(self) -> pa.Table:
        """Return all rows in the order of the design, of each index the last one written."""
        import pyarrow as pa

        last: dict[int, dict[str, Any]] = {}
        for table in self._tables():
            for entry in table.to_pylist():
                last[entry["index"]] = entry
        return pa.Table.from_pylist([last[index] for index in range(len(self._sweep.values))], schema=self._schema)
