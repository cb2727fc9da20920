"""Recorders of a run's records, events and shapes, a thousand steps at a time: in memory, or in a directory."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from io import FileIO
from pathlib import Path
from typing import Any

import numpy as np

from ..motion.events import Event
from ..scene import Scene
from .columns import blocks, trajectory_of
from .contacts import contacts, contacts_as_array
from .dense import at_multiples
from .directory import RunDirectory
from .files import (
    chunks,
    load_events,
    load_summary,
    mapped,
    read_run,
    write_columns,
    write_summary,
    write_tables,
)
from .records import EVENT, SHAPE, STEP, events_as_array
from .trajectory import SHAPE_COLUMNS, Trajectory


class MemoryRecorder:
    """Keep a run in memory: any number of blocks and then ``finish``.

    Parameters
    ----------
    scene
        The scene as run.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._steps = [np.empty(0, STEP)]
        self._shapes = [np.empty((0, len(SHAPE_COLUMNS)))]
        self._events: list[Event] = []
        self._summary: dict[str, Any] = {}

    def keep(self, steps: np.ndarray, events: Sequence[Event], shapes: np.ndarray) -> None:
        """Keep the next steps of the run.

        Parameters
        ----------
        steps
            Their records, of dtype `springbeam.results.records.STEP`, shape (n,); all numbers are finite.
        events
            That happened on them.
        shapes
            The beam's shapes at some of them: the numbers of `SHAPE_COLUMNS`, shape (m, 64).
        """
        self._steps.append(steps)
        self._events += events
        self._shapes.append(shapes)

    def steps(self) -> np.ndarray:
        """Return the records kept so far, shape (n,)."""
        self._steps = [np.concatenate(self._steps)]
        return self._steps[0]

    def events(self) -> list[Event]:
        """Return the events kept so far."""
        return list(self._events)

    def trajectory(self) -> Trajectory:
        """Return everything kept so far."""
        shapes = None if self.scene.beam is None else np.concatenate(self._shapes)
        return trajectory_of(self.scene, self.steps(), self.events(), shapes, dict(self._summary))

    def finish(self, summary: Mapping[str, Any]) -> None:
        """End the record with ``summary``, which is JSON-like; the scene as run is added.

        The command line shows ``status`` (``done``, ``stopped``, ``interrupted``), ``macro_steps``, ``wall_time`` [s],
        ``max_energy_residual`` (relative) and ``warnings`` (list of str) if present.
        """
        self._summary = _with_scene(summary, self.scene)


class FileRecorder(AbstractContextManager["FileRecorder"]):
    """Write a run into a `RunDirectory`, so that memory does not grow with the run.

    Records are appended a block at a time, after their events and shapes: a run that is killed loses no more than one
    block, and ``summary.json`` has the scene from the start. Tables are made from the arrays at the end. Results of an
    earlier run are removed when this one has something to record.

    As a context it closes the files.

    Parameters
    ----------
    scene
        As of `MemoryRecorder`.
    directory
        Where the results go (`RunDirectory.create`).
    interval
        Make the rows at its multiples [s], by `Trajectory.at`, instead of one per step.
    """

    def __init__(self, scene: Scene, directory: RunDirectory, interval: float | None = None) -> None:
        self.scene = scene
        self.directory = directory
        self.interval = interval
        #: In the order in which they grow. Each hands what is written to the system at once, so that a killed run has
        #: it.
        self._files: dict[Path, FileIO] = {}

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def begun(self) -> bool:
        """Whether the directory holds results of this run."""
        return bool(self._files)

    @property
    def time(self) -> float:
        """Time of the last record [s], 0 before the first."""
        return float(self.steps()["time"][-1:].sum())

    def keep(self, steps: np.ndarray, events: Sequence[Event], shapes: np.ndarray) -> None:
        """See `MemoryRecorder.keep`. Raises OSError."""
        self._begin()
        contents = (shapes, events_as_array(events), steps)
        for file, content in zip(self._files.values(), contents[-len(self._files) :], strict=True):
            append(file, content.tobytes())

    def steps(self) -> np.ndarray:
        return mapped(self.directory.steps, STEP) if self.begun else np.empty(0, STEP)

    def events(self) -> list[Event]:
        return load_events(self.directory.path) if self.begun else []

    def trajectory(self) -> Trajectory:
        self._begin()
        return read_run(self.directory)

    def write(self, run: Trajectory) -> None:
        """Write a finished run, also one by a reference, which has columns only."""
        steps = np.empty(0, STEP) if run.steps is None else run.steps
        shapes = np.empty((0, len(SHAPE_COLUMNS))) if run.shape_table is None else run.shape_table
        self.keep(steps, run.events, shapes)
        if run.steps is None:
            write_columns(self.directory, run.columns)
        self.finish(run.summary)

    def finish(self, summary: Mapping[str, Any]) -> None:
        """See `MemoryRecorder.finish`. Raises OSError."""
        self._begin()
        directory = self.directory
        steps = self.steps()
        rows: Iterable[Mapping[str, np.ndarray]] = blocks(self.scene, steps)
        if directory.rows.exists():
            rows = [self.trajectory().columns]
        elif self.interval is not None and len(steps):
            rows = [at_multiples(self.trajectory(), self.interval).columns]
        self._close_files()
        write_summary(directory, _with_scene({**summary, "files": directory.sizes()}, self.scene))
        shapes = [chunks(mapped(directory.shapes, SHAPE))] * (self.scene.beam is not None)
        table = contacts(self.scene, steps, self.events(), summary.get("contact_force_window"))
        write_tables(
            directory, [rows, chunks(mapped(directory.events, EVENT)), chunks(contacts_as_array(table)), *shapes]
        )

    def amend(self, entries: Mapping[str, Any]) -> None:
        """Replace ``entries`` of the summary of a finished run, or add them. Raises OSError."""
        write_summary(self.directory, {**load_summary(self.directory.path), **entries})

    def close(self) -> None:
        """Close the files, and let other processes use the directory."""
        self._close_files()
        self.directory.release()

    def _close_files(self) -> None:
        for file in self._files.values():
            file.close()

    def _begin(self) -> None:
        """Remove earlier results and begin the files, if that is not done."""
        if self._files:
            return
        for file in self.directory.results():
            file.unlink()
        directory = self.directory
        arrays = [*([] if self.scene.beam is None else [directory.shapes]), directory.events, directory.steps]
        self._files = {path: path.open("ab", buffering=0) for path in arrays}
        # Last: where there is a summary, there is a run that can be loaded.
        write_summary(self.directory, _with_scene({"status": "running"}, self.scene))


Recorder = MemoryRecorder | FileRecorder


def save(run: Trajectory, directory: str | Path, *, replace: bool) -> Path:
    """Write the files of a finished run; see `Trajectory.save`."""
    target = RunDirectory.create(directory, replace=replace)
    with FileRecorder(run.scene, target) as recorder:
        recorder.write(run)
    return target.path


def _with_scene(summary: Mapping[str, Any], scene: Scene) -> dict[str, Any]:
    return {**summary, "scene": scene.model_dump(exclude_none=True)}


def append(file: FileIO, content: bytes) -> None:
    written = 0
    while written < len(content):  # a disk that is almost full takes a part, and then refuses
        written += file.write(content[written:])
