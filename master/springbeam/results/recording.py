"""What a run reports to, row by row, and the recorder that keeps everything in memory.

``file_recorder`` streams into files instead. Both refuse numbers that are not finite.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from array import array
from collections.abc import Iterable, Mapping, Sequence
from math import isfinite
from typing import Any

import numpy as np

from ..scene import Scene
from ..scene.statics import SHAPE_POINTS
from .steps import steps_of
from .trajectory import (
    EVENT_COLUMNS,
    EVENT_KINDS,
    PHASES,
    SHAPE_COLUMNS,
    Event,
    Trajectory,
    columns_of,
)


class NonFiniteValue(ValueError):
    """A NaN or an infinity was about to be recorded, in ``column`` at ``time`` [s]."""

    def __init__(self, column: str, time: float, value: float) -> None:
        super().__init__(f"{column} = {value} at t = {time!r} s: not a finite number")
        self.column = column
        self.time = time
        self.value = value


def _refuse_non_finite(names: Sequence[str], row: list[float]) -> None:
    """Raise NonFiniteValue for the first number of ``row`` that is not finite; the row begins with its time [s]."""
    if not isfinite(sum(row)):  # or the sum alone overflows
        for name, value in zip(names, row, strict=True):
            if not isfinite(value):
                raise NonFiniteValue(name, row[0], value)


class Recorder(ABC):
    """What a run reports to, in this order: any number of rows, events and shapes, then ``finish``.

    It refuses rows, events and shapes that no file could hold.

    Parameters
    ----------
    scene
        The scene as run.
    columns
        Names in row order, starting with ``time``, ``phase`` among them; default `columns_of(scene)`.
    """

    def __init__(self, scene: Scene, columns: Sequence[str] | None = None) -> None:
        self.scene = scene
        self.columns = tuple(columns_of(scene) if columns is None else columns)
        self._phase_at = self.columns.index("phase")
        self._numbers = [name for name in self.columns if name != "phase"]
        self._steps = bytearray()  #: those that are in no file

    def row(self, values: Sequence[Any], step: bytes | None = None) -> None:
        """Record an accepted step: a value per column, in their order.

        ``step`` is `springbeam.results.steps.packed`; a run gives it with every row or with none. Its numbers are
        looked at later, many at a time.

        Raises
        ------
        NonFiniteValue
            If a number is NaN or infinite; nothing of the row is recorded then.
        """
        if len(values) != len(self.columns):
            raise ValueError(f"row of {len(values)} values for {len(self.columns)} columns")
        values = list(values)
        phase = values.pop(self._phase_at)
        if phase not in PHASES:
            raise ValueError(f"phase {phase!r}; allowed: {', '.join(PHASES)}")
        numbers = list(map(float, values))
        _refuse_non_finite(self._numbers, numbers)
        if step is not None:
            self._steps += step
        self._keep_row(numbers, phase)

    def event(self, event: Event) -> None:
        """Record an event."""
        if event.kind not in EVENT_KINDS:
            raise ValueError(f"event kind {event.kind!r}; allowed: {', '.join(EVENT_KINDS)}")
        for name in EVENT_COLUMNS:
            value = getattr(event, name)
            if name != "kind" and value is not None and not isfinite(value):
                raise NonFiniteValue(f"{name} of event {event.kind!r}", event.time, value)
        self._keep_event(event)

    def shape(self, time: float, deflection: np.ndarray) -> None:
        """Record the beam's deflection [m] at `SHAPE_POINTS`, shape (21,), at ``time`` [s]."""
        if self.scene.beam is None:
            raise ValueError("a beam's shape in a scene without a beam")
        if np.shape(deflection) != SHAPE_POINTS.shape:
            raise ValueError(f"shape of {np.shape(deflection)} values for {SHAPE_POINTS.shape} points")
        numbers = [float(time), *np.asarray(deflection, dtype=float).tolist()]
        _refuse_non_finite(SHAPE_COLUMNS, numbers)
        self._keep_shape(numbers)

    @abstractmethod
    def steps(self) -> np.ndarray | None:
        """Return the steps recorded so far, of dtype `springbeam.results.steps.STEP`; ``None`` if there are none."""

    @abstractmethod
    def events(self) -> Iterable[Event]:
        """Return the events recorded so far."""

    @abstractmethod
    def finish(self, summary: Mapping[str, Any]) -> None:
        """End the record with ``summary``, which is JSON-like; the scene as run is added.

        The command line reports ``status`` (``done``, ``stopped``, ``interrupted``), ``macro_steps``, ``wall_time``
        [s], ``max_energy_residual`` (relative) and ``warnings`` (list of str), those that are there.
        """

    @abstractmethod
    def _keep_row(self, numbers: list[float], phase: str) -> None:
        """Keep a row that has been checked: its numbers, and its phase."""

    @abstractmethod
    def _keep_event(self, event: Event) -> None:
        """Keep an event that has been checked."""

    @abstractmethod
    def _keep_shape(self, numbers: list[float]) -> None:
        """Keep the numbers of `SHAPE_COLUMNS`, which have been checked."""


class MemoryRecorder(Recorder):
    """Keeps everything; `trajectory` is the result."""

    def __init__(self, scene: Scene, columns: Sequence[str] | None = None) -> None:
        super().__init__(scene, columns)
        self._rows, self._shapes = array("d"), array("d")
        self._phase_of_row: list[str] = []
        self._events: list[Event] = []
        self._summary: dict[str, Any] = {}

    def _keep_row(self, numbers: list[float], phase: str) -> None:
        self._rows.fromlist(numbers)
        self._phase_of_row.append(phase)

    def _keep_event(self, event: Event) -> None:
        self._events.append(event)

    def _keep_shape(self, numbers: list[float]) -> None:
        self._shapes.fromlist(numbers)

    def steps(self) -> np.ndarray | None:
        return steps_of(self._steps)

    def events(self) -> Iterable[Event]:
        return iter(self._events)

    def finish(self, summary: Mapping[str, Any]) -> None:
        self._summary = with_scene(summary, self.scene)

    def trajectory(self) -> Trajectory:
        """Return everything recorded so far."""
        numbers = iter(np.reshape(self._rows, (-1, len(self._numbers))).T.copy())
        phases = np.array(self._phase_of_row, dtype=str)
        columns = {name: phases if name == "phase" else next(numbers) for name in self.columns}
        shapes = None
        if self.scene.beam is not None:
            table = np.reshape(self._shapes, (-1, len(SHAPE_COLUMNS)))
            shapes = (table[:, 0].copy(), table[:, 1:].copy())
        return Trajectory(self.scene, columns, list(self._events), shapes, dict(self._summary), self.steps())


def replay(trajectory: Trajectory, recorder: Recorder) -> None:
    """Record a finished run row by row and event by event."""
    steps = trajectory.steps
    for i, row in enumerate(zip(*(trajectory[name] for name in recorder.columns), strict=True)):
        recorder.row(row, None if steps is None else steps[i].tobytes())
    for event in trajectory.events:
        recorder.event(event)
    for time, deflection in zip(*(trajectory.shapes or ((), ())), strict=True):
        recorder.shape(float(time), deflection)
    recorder.finish({key: value for key, value in trajectory.summary.items() if key != "scene"})


def with_scene(summary: Mapping[str, Any], scene: Scene) -> dict[str, Any]:
    """Return ``summary`` with the scene as run, as it goes into ``summary.json``."""
    return {**summary, "scene": scene.model_dump(exclude_none=True)}
