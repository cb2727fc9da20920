"""Many runs of one scene: a row of metrics per run, errors as rows.

The rows depend on the design alone: not on the number of workers, nor on the order in which they finish.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

from rich.text import Text

from ...run.outcome import RunStopped
from ...scene import Scene, SceneError, key_kind
from ..accuracy import simulate
from ..study import Findings, Record, Study
from . import picture, stroboscopic
from .design import Axis, Sampling, compatible, design, parse_axis, varied
from .metrics import METRICS, PRINCIPAL

__all__ = ["METRICS", "PRINCIPAL", "TABLE", "Sweep", "rows"]

TABLE, PICTURE = "sweep.parquet", "sweep.png"
STATUSES = ("done", "stopped", "refused", "lost")


class Sweep(Study):
    """What is swept: ``vary`` holds ``TABLE.KEY=VALUES``."""

    kind: ClassVar[str] = "sweep"
    files: ClassVar[tuple[str, ...]] = (TABLE, PICTURE, stroboscopic.PICTURE)
    parallel: ClassVar[bool] = True

    scene: Scene
    vary: tuple[str, ...]
    samples: int = 0
    sampling: Sampling = "latin_hypercube"
    seed: int = 0
    metric: tuple[str, ...] = ()  #: all if empty
    stroboscopic: bool = False  #: whether each run is also seen once a period of its drive

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The keys that vary."""
        return tuple(parse_axis(text) for text in self.vary)

    @property
    def metrics(self) -> tuple[str, ...]:
        """The numbers that are kept of a run."""
        return self.metric or tuple(METRICS)

    def cases(self) -> dict[str, tuple[Any, ...]]:
        """Return the values of the axes. Raises SceneError if a key, a metric or the drive is not there."""
        if unknown := [name for name in self.metrics if name not in METRICS]:
            raise SceneError(f"--metric {unknown[0]}: unknown; allowed: {', '.join(METRICS)}")
        axes = self.axes
        compatible(self.scene, axes)
        if self.stroboscopic:
            stroboscopic.drive(self.scene)
        values = design(axes, self.samples, self.seed, self.sampling)
        return {str(index): several for index, several in enumerate(values)}

    def record(self, case: Sequence[Any]) -> Record:
        """Run once. ``status`` is ``done``, ``stopped`` (early) or ``refused`` (bad input), ``error`` says why."""
        status, error, warnings = "done", "", ""
        found: dict[str, Any] = dict.fromkeys(self.metrics)
        try:
            run = simulate(varied(self.scene, self.axes, case))
        except SceneError as refused:
            status, error = "refused", str(refused)
        except RunStopped as stopped:
            status, error = "stopped", str(stopped)
        else:
            warnings = "\n".join(run.summary["warnings"])
            found = {name: METRICS[name](run) for name in self.metrics}
            if self.stroboscopic:
                found |= stroboscopic.observed(run)
        return {"status": status, "error": error, "warnings": warnings, **found}

    def lost(self, cause: str) -> Record:
        """Return a row that says why there is no run."""
        return {"status": "lost", "error": cause, "warnings": ""}

    def failed(self, record: Record) -> bool:
        """Tell whether a row is no run that is done."""
        return bool(record["status"] != "done")

    def findings(self, records: Mapping[str, Record]) -> Findings:
        """Count the rows by status, and name the first error."""
        counts = Counter(record["status"] for record in records.values())
        lines = [f"runs      {', '.join(f'{counts[status]} {status}' for status in STATUSES if counts[status])}"]
        if first := next((record["error"] for record in records.values() if record["error"]), None):
            lines.append(f"error     {first}, the first of them")
        return Findings({"runs": {status: counts[status] for status in STATUSES}}, [Text(line) for line in lines])

    def write(self, records: Mapping[str, Record], directory: Path, *, pictures: bool) -> list[Path]:
        """Write ``sweep.parquet`` with a row per run, and draw what one or two keys change."""
        import pyarrow.parquet as pq

        files = [directory / TABLE]
        pq.write_table(self._table(records), files[0])
        if pictures:
            columns, axes = rows(directory), self.axes
            if picture.draw(columns, axes, self.metric or PRINCIPAL, self.scene.title, directory / PICTURE):
                files.append(directory / PICTURE)
            if self.stroboscopic and stroboscopic.draw(columns, axes, directory):
                files.append(directory / stroboscopic.PICTURE)
        return files

    def _table(self, records: Mapping[str, Record]) -> Any:
        import pyarrow as pa

        cases, names = self.cases(), [axis.name for axis in self.axes]
        fields = [("index", pa.int64())]
        types = {bool: pa.bool_(), str: pa.string()}
        fields += [(axis.name, types.get(key_kind(axis.table, axis.key), pa.float64())) for axis in self.axes]
        fields += [(name, pa.string()) for name in ("status", "error", "warnings")]
        fields += [(name, pa.float64()) for name in self.metrics]
        if self.stroboscopic:
            fields += [(stroboscopic.POINTS, pa.list_(pa.float64())), (stroboscopic.PEAK, pa.float64())]
        entries = [
            {"index": int(index), **dict(zip(names, cases[index], strict=True)), **record}
            for index, record in records.items()
        ]
        return pa.Table.from_pylist(entries, schema=pa.schema(fields))


def rows(directory: str | Path) -> dict[str, list[Any]]:
    """Read a finished sweep: ``index``, the varied keys, ``status``, ``error``, ``warnings``, the metrics."""
    import pyarrow.parquet as pq

    columns: dict[str, list[Any]] = pq.read_table(Path(directory) / TABLE).to_pydict()
    return columns
