"""Run a scene with many values of its keys: one row of metrics per run, also of one that fails.

The rows depend on the design alone, not on the number of workers or the order in which they finish.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, ClassVar

import numpy as np

from ..scene import ArgumentError, Scene
from ..scene.messages import unit_of
from .design import Axis, Sampling, design, parse_axis, with_keys
from .metrics import METRICS, PRINCIPAL, USUAL, Metric, metrics_of
from .picture import Scale, column, multiples, readable, singly
from .study import Study, measured
from .tables import Findings, Row, table

STATUSES = ("done", "stopped", "refused", "lost")
#: Number of rows shown on the terminal; the files have all.
_FIRST_ROWS = 10
#: A metric that varies less, relative to its largest value, is constant.
_ROUNDING = 1e-12


class Sweep(Study):
    """A sweep over the values in ``vary``, ``TABLE.KEY=VALUES`` each."""

    kind: ClassVar[str] = "sweep"
    parallel: ClassVar[bool] = True

    scene: Scene
    vary: tuple[str, ...]
    samples: int = 0
    sampling: Sampling = "latin_hypercube"
    seed: int = 0
    metric: tuple[str, ...] = ()  #: the usual ones if empty

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The keys that vary."""
        return tuple(parse_axis(text) for text in self.vary)

    @property
    def metrics(self) -> dict[str, Metric]:
        """The given metrics."""
        return metrics_of(self.metric or USUAL, several=True)

    @property
    def _shown(self) -> Sequence[str]:
        return list(metrics_of(self.metric, several=True)) or PRINCIPAL

    def cases(self) -> dict[str, Row]:
        """Return the values of the axes. Raises SceneError for an unknown key or metric."""
        _ = self.metrics  # raises if one is unknown
        names = [axis.name for axis in self.axes]
        for name in names:
            self._refuse_lacking(name)
        values = design(self.axes, self.samples, self.seed, self.sampling)
        return {str(index): dict(zip(names, several, strict=True)) for index, several in enumerate(values)}

    def _refuse_lacking(self, name: str) -> None:
        """Raise ArgumentError if ``name`` is a key of a load that the scene does not have."""
        table, _, number = name.rpartition(".")[0].partition(".")
        if table == "loads" and int(number) >= len(self.scene.loads):
            there = ", ".join(f"loads.{k}" for k in range(len(self.scene.loads))) or "none"
            raise ArgumentError(f"--vary {name}: the scene has no such load; there are: {there}")

    def record(self, case: Row) -> Row:
        """Run one case and return its metrics, as `measured` does."""
        return measured(lambda: with_keys(self.scene, case), self.metrics)

    def findings(self, records: Mapping[str, Row]) -> Findings:
        """Count the rows by status; show the first values of the given metrics."""
        rows = self.rows(records)
        counts = Counter(row["status"] for row in rows)
        shown: list[Any] = [
            f"runs      {', '.join(f'{counts[status]} {status}' for status in STATUSES if counts[status])}"
        ]
        if self.metric:
            names = [*(axis.name for axis in self.axes), *self._shown]
            first, headings = readable(rows[:_FIRST_ROWS], {name: self._unit(name) for name in names})
            cells = [[row[name] for name in names] for row in first]
            several = f"the first {_FIRST_ROWS} of {len(rows)} rows" * (len(rows) > _FIRST_ROWS)
            shown.append(
                table([f"{headings[name].replace(' [', chr(10) + '[')}:.6g" for name in names], cells, several)
            )
        code = 2 if counts.keys() == {"refused"} else 0
        document = {"runs": {status: counts[status] for status in STATUSES}}
        return Findings(document, shown, code=code, tables={self.kind: rows}, pictures=self._pictures(rows))

    def _pictures(self, rows: Sequence[Row]) -> dict[str, Callable[[], Any]]:
        """Return a picture of the metrics that change over the axes."""
        words = [any(isinstance(row[axis.name], str) for row in rows) for axis in self.axes]
        varied = [name for name in self._shown if _varies(column(singly(rows, name), name))]
        shown_rows, headings = readable(
            rows, {name: self._unit(name) for name in (*(a.name for a in self.axes), *varied)}
        )
        scales = [Scale(a.name, headings[a.name], a.log, word) for a, word in zip(self.axes, words, strict=True)]
        shown = {name: headings[name] for name in varied}
        return (
            {self.kind: partial(multiples, shown_rows, scales, shown, self.scene.title or self.kind)} if shown else {}
        )

    def _unit(self, name: str) -> str:
        """Return the unit of an axis or of a metric, "" or "–" where there is none."""
        if name not in {axis.name for axis in self.axes}:
            return METRICS[name].unit if name in METRICS else ""
        table, _, key = name.rpartition(".")
        if key != "amplitude":
            return unit_of(table, key)
        return self.scene.loads[int(table.partition(".")[2])].unit


def _varies(values: np.ndarray) -> bool:
    finite = values[np.isfinite(values)]
    return finite.size > 1 and bool(np.ptp(finite) > _ROUNDING * np.abs(finite).max())
