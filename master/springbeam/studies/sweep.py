"""Run a scene with many values of its keys: one row of metrics per run, also of one that fails.

The rows depend on the design alone, not on the number of workers or the order in which they finish.

Over the amplitude and the duration of a pulse a sweep shows the damage boundary of a product: the pulses for which a
metric reaches its limit. A pulse is described by its peak and by its change of velocity, ∫ a dt. At each duration the
critical peak is that at which the metric first reaches its limit, interpolated linearly between the amplitudes swept
and 0: each duration has a run without the pulse.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, ClassVar

import numpy as np

from ..pictures.diagrams import Diagram, draw_diagrams
from ..scene import ArgumentError, Load, Scene
from ..scene.messages import unit_of
from .design import Axis, Sampling, design, parse_axis, with_keys
from .metrics import PRINCIPAL, USUAL, Metric, heading, metrics_of
from .picture import Scale, column, multiples, singly
from .study import Study, measured
from .tables import Findings, Row, table

STATUSES = ("done", "stopped", "refused", "lost")
#: Number of rows shown on the terminal; the files have all.
_FIRST_ROWS = 10
#: A metric that varies less, relative to its largest value, is constant.
_ROUNDING = 1e-12
#: Points of the integral of a pulse.
_POINTS = 20_001


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
    boundary: str = ""  #: METRIC=LIMIT of the damage boundary, for a sweep over a pulse

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The keys that vary."""
        return tuple(parse_axis(text) for text in self.vary)

    @property
    def metrics(self) -> dict[str, Metric]:
        """The given metrics."""
        asked = metrics_of(self.metric or USUAL, several=True)
        limited = self._limit[0] if self.boundary else ""
        return asked if not limited or limited in asked else asked | metrics_of([limited])

    @property
    def _shown(self) -> Sequence[str]:
        return list(metrics_of(self.metric, several=True)) or PRINCIPAL

    def cases(self) -> dict[str, Row]:
        """Return the values of the axes. Raises SceneError for an unknown key or metric."""
        _ = self.metrics, self.boundary and self._pulse  # both raise where something is not there
        names = [axis.name for axis in self.axes]
        for name in names:
            self._refuse_lacking(name)
        values = design(self.axes, self.samples, self.seed, self.sampling)
        cases = [dict(zip(names, several, strict=True)) for several in values]
        if self.boundary:
            amplitude = f"{self._pulse}.amplitude"
            still = [case | {amplitude: 0.0} for case in cases]
            cases += [case for k, case in enumerate(still) if case not in cases + still[:k]]
        return {str(index): case for index, case in enumerate(cases)}

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
        """Count the rows by status; show the first values of the given metrics, and the damage boundary."""
        rows = self.rows(records)
        critical = list[Row]()
        shown = list[Any]()
        counts = Counter(row["status"] for row in rows)
        document: dict[str, Any] = {"runs": {status: counts[status] for status in STATUSES}}
        shown.append(f"runs      {', '.join(f'{counts[status]} {status}' for status in STATUSES if counts[status])}")
        tables = {self.kind: rows}
        if self.boundary:
            document["boundary"] = critical = self._critical(rows)
            shown += _in_words(critical, self.boundary, self._exceeded(rows))
        if critical:
            tables["sweep-boundary"] = critical
        if self.metric:
            names = [*(axis.name for axis in self.axes), *self._shown]
            cells = [[row[name] for name in names] for row in rows[:_FIRST_ROWS]]
            several = f"the first {_FIRST_ROWS} of {len(rows)} rows" * (len(rows) > _FIRST_ROWS)
            shown.append(table([f"{name}:.6g" for name in names], cells, several))
        code = 2 if counts.keys() == {"refused"} else 0
        return Findings(document, shown, code=code, tables=tables, pictures=self._pictures(rows, critical))

    def _pictures(self, rows: Sequence[Row], critical: Sequence[Row]) -> dict[str, Callable[[], Any]]:
        """Return pictures of the metrics that change over the axes, and of the boundary; pulses above it damage."""
        pictures: dict[str, Callable[[], Any]] = {}
        words = [any(isinstance(row[axis.name], str) for row in rows) for axis in self.axes]
        scales = [Scale(a.name, self._labelled(a), a.log, word) for a, word in zip(self.axes, words, strict=True)]
        if shown := {name: heading(name) for name in self._shown if _varies(column(singly(rows, name), name))}:
            pictures["sweep"] = partial(multiples, rows, scales, shown, self.scene.title or "sweep")
        if critical:
            points = [(pulse["velocity_change"], pulse["peak"]) for pulse in critical]
            unit = self._load(self._pulse).unit
            labels = (f"velocity change [{'m/s' if unit == 'm/s²' else f'{unit}·s'}]", f"peak [{unit}]")
            diagram = Diagram(*labels, {self.boundary: points}, "damage boundary")
            pictures["sweep-boundary"] = partial(draw_diagrams, [diagram], self.scene.title, (7.0, 4.0))
        return pictures

    def _labelled(self, axis: Axis) -> str:
        table, _, key = axis.name.rpartition(".")
        unit = self._load(table).unit if key == "amplitude" else unit_of(table, key)
        return f"{axis.name} [{unit}]" if unit != "–" else axis.name

    def _load(self, table: str) -> Load:
        """Return a load by its table, as loads.0."""
        return self.scene.loads[int(table.partition(".")[2])]

    # Damage boundary

    @property
    def _limit(self) -> tuple[str, float]:
        """The metric of the boundary and its limit. Raises SceneError for anything else."""
        metric, _, value = self.boundary.rpartition("=")
        with suppress(ValueError):
            limit = float(value)
            if limit > 0.0:
                return metric.strip(), limit
        raise ArgumentError(
            f"--boundary {self.boundary}: must be METRIC=LIMIT with a limit above 0, as in max_clamp_moment=0.3"
        )

    @property
    def _pulse(self) -> str:
        """The load whose amplitude and duration vary. Raises SceneError if the sweep is over anything else."""
        names = {axis.name for axis in self.axes}
        pulse = min(names, default="").rpartition(".")[0]
        if names != {f"{pulse}.amplitude", f"{pulse}.duration"} or not pulse.startswith("loads."):
            raise ArgumentError(
                "--boundary: takes --vary loads.0.amplitude=… and --vary loads.0.duration=… of one pulse"
            )
        return pulse

    def _critical(self, rows: Sequence[Row]) -> list[Row]:
        """Return the critical pulses by duration; none at durations whose runs stay below the limit.

        A critical pulse has its ``duration`` [s], its ``peak``, in the load's unit, and its ``velocity_change``, the
        integral of the load.
        """
        pulse = self._pulse
        metric, limit = self._limit
        found = []
        amplitude = f"{pulse}.amplitude"
        duration = f"{pulse}.duration"
        load = self._load(pulse)
        known = [row for row in rows if row[metric] is not None]
        for length in sorted({row[duration] for row in known}):
            pairs = sorted((abs(row[amplitude]), abs(row[metric])) for row in known if row[duration] == length)
            peaks, values = np.array(pairs).T
            if peaks[0] == 0.0 and (k := int(np.argmax(values >= limit))):
                peak = float(np.interp(limit, values[k - 1 : k + 1], peaks[k - 1 : k + 1]))
                unit = load.model_copy(update={"amplitude": 1.0, "duration": length, "start": 0.0})
                mean = float(unit.value((np.arange(_POINTS) + 0.5) * length / _POINTS).mean())
                found.append({"duration": length, "velocity_change": peak * mean * length, "peak": peak})
        return found

    def _exceeded(self, rows: Sequence[Row]) -> bool:
        """Return whether a run without the pulse reaches the limit."""
        metric, limit = self._limit
        still = [row[metric] for row in rows if row[f"{self._pulse}.amplitude"] == 0.0]
        return any(value is not None and abs(value) >= limit for value in still)


def _varies(values: np.ndarray) -> bool:
    found = values[np.isfinite(values)]
    return found.size > 1 and bool(np.ptp(found) > _ROUNDING * np.abs(found).max())


def _in_words(found: Sequence[Mapping[str, float]], limit: str, exceeded: bool) -> list[str]:
    """Return the boundary in words: both of its sides, or that there is none."""
    if exceeded:
        return [f"boundary  none: {limit} is reached without the pulse; raise the limit"]
    if not found:
        return [f"boundary  {limit} is not reached in any run that has a value of it"]
    slowest, least = (min(found, key=lambda pulse: pulse[side]) for side in ("velocity_change", "peak"))
    return [
        f"boundary  {limit} is reached from a velocity change of {slowest['velocity_change']:.4g} on "
        f"(in {slowest['duration']:.4g} s)",
        f"          and from a peak of {least['peak']:.4g} on (in {least['duration']:.4g} s)",
    ]
