"""A run streamed into the files of a directory.

Records are appended to ``steps.bin`` as the run goes, a block at a time, after their events and shapes: a run that
is killed loses no more than that. Rows, ``trajectory.csv``, are made from the records at the end.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from io import FileIO
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from pydantic_core import to_json

from ..scene import Scene
from .columns import blocks
from .dense import rows_at
from .directory import RunDirectory
from .reading import load_events, read_run, refuse_cut
from .recording import Recorder, with_scene
from .steps import STEP
from .trajectory import EVENT_COLUMNS, SHAPE_COLUMNS, Event, Trajectory

#: Bytes kept free for the last summary; longer ones are written if the disk has room.
_SUMMARY_ROOM = 16384
#: Times closer than this share are one.
_SAME = 1e-12


class FileRecorder(Recorder):
    """Streams into a `RunDirectory` and keeps nothing, so that memory does not grow with the run.

    ``summary.json`` says from the start which scene the records belong to: the results of a run that was killed can be
    loaded. Results of an earlier run stay until this one has something to record; then they are removed.

    Parameters
    ----------
    scene
        As of `Recorder`.
    directory
        Where the results go (`RunDirectory.create`).
    interval
        Make the rows at its multiples [s], by `Trajectory.at`, instead of one per step.
    """

    def __init__(self, scene: Scene, directory: RunDirectory, interval: float | None = None) -> None:
        super().__init__(scene)
        self.directory = directory
        self.finished = False
        self.interval = interval
        #: The first line of each file that grows, in the order in which they do.
        self._headers = {directory.events: _lines([EVENT_COLUMNS]), directory.steps: b""}
        if scene.beam is not None:
            self._headers = {directory.shapes: _lines([SHAPE_COLUMNS]), **self._headers}
        #: Each hands what is written to the system at once, so that a killed run has it.
        self._files: dict[Path, FileIO] = {}

    def __enter__(self) -> FileRecorder:
        return self

    def __exit__(self, kind: object, error: BaseException | None, traceback: object) -> None:
        if self.begun and not self.finished and error is not None:
            self.finish({"status": "stopped", "cause": f"{type(error).__name__}: {error}", "time": self.time})
        self.close()

    @property
    def begun(self) -> bool:
        """Whether the directory holds results of this run."""
        return bool(self._files)

    @property
    def time(self) -> float | None:
        """Time of the last record [s]; ``None`` before the first."""
        steps = self.steps()
        return float(steps["time"][-1]) if len(steps) else None

    def keep(self, steps: np.ndarray, events: Sequence[Event], shapes: np.ndarray) -> None:
        self._begin()
        if self.directory.shapes in self._files:
            _append(self._files[self.directory.shapes], _lines(shapes.tolist()))
        _append(self._files[self.directory.events], _lines(_fields(event) for event in events))
        _append(self._files[self.directory.steps], steps.tobytes())

    def steps(self) -> np.ndarray:
        path = self.directory.steps
        whole = path.stat().st_size // STEP.itemsize if self.begun else 0
        return np.memmap(path, STEP, mode="r", shape=whole) if whole else np.empty(0, STEP)

    def events(self) -> Iterable[Event]:
        return load_events(self.directory.path) if self.begun else iter(())

    def trajectory(self) -> Trajectory:
        self._begin()
        return read_run(self.directory)

    def write(self, run: Trajectory) -> None:
        """Write a finished run, also one by a reference, which has columns only."""
        recorded = run.steps is not None
        steps = np.empty(0, STEP) if run.steps is None else run.steps
        shapes = np.empty((0, len(SHAPE_COLUMNS))) if run.shape_table is None else run.shape_table
        self.keep(steps, run.events, shapes)
        self.finish(
            {name: run.summary[name] for name in run.summary.keys() - {"scene", "files"}}, None if recorded else run
        )

    def finish(self, summary: Mapping[str, Any], run: Trajectory | None = None) -> None:
        """See `Recorder.finish`; a ``run`` that left no records has its own rows. Raises OSError."""
        self._begin()
        self._close_files()
        self.finished = True
        try:
            write_rows(self.directory, self._rows() if run is None else [run.columns])
        finally:  # also where the disk has no room for them
            self._write_summary({**summary, "files": self.directory.sizes()})
            if summary.get("status") == "done":
                self.directory.checkpoint.unlink(missing_ok=True)

    def _rows(self) -> Iterable[Mapping[str, np.ndarray]]:
        if self.interval is None or self.time is None:
            return blocks(self.scene, self.steps())
        return [at_multiples(self.trajectory(), self.interval)]

    def close(self) -> None:
        """Close the files, and let other processes use the directory."""
        self._close_files()
        self.directory.release()

    def _close_files(self) -> None:
        with ExitStack() as files:  # each is closed, also when another cannot be (a full disk)
            for file in self._files.values():
                files.callback(file.close)

    def save(self) -> dict[str, int]:
        """Write what was recorded to the disk, and return the sizes of its files [bytes], which `restore` needs."""
        self._begin()
        for file in self._files.values():
            os.fsync(file.fileno())
        return {path.name: path.stat().st_size for path in self._files}

    def restore(self, saved: Mapping[str, int]) -> None:
        """Go on from what `save` of a recorder in the same directory returned; what came later is removed.

        Raises
        ------
        ResultsUnreadable
            If a file is missing or shorter than it was; nothing is removed then.
        ResultsInUse
            If another process is writing them.
        """
        self.directory.claim()
        refuse_cut(self.directory, saved, longer=True)
        self._open()
        for path, file in self._files.items():
            file.truncate(saved[path.name])
        self.directory.trajectory.unlink(missing_ok=True)
        self._write_summary({"status": "running"})
        self._reserve_summary()

    def _begin(self) -> None:
        """Remove earlier results and write the files with their headers, once the disk has room for them."""
        if self._files:
            return
        try:
            self._reserve_summary()
        except OSError:
            _part(self.directory.summary).unlink(missing_ok=True)
            raise
        for file in self.directory.results():
            file.unlink()
        self._open()
        for path, header in self._headers.items():
            _append(self._files[path], header)
        # Last: where there is a summary, there is a run that can be loaded.
        self._write_summary({"status": "running"})
        self._reserve_summary()

    def _open(self) -> None:
        self._files = {path: path.open("ab", buffering=0) for path in self._headers}

    def _reserve_summary(self) -> None:
        """Keep room on the disk for the last summary, which has to be written also when the disk is full."""
        _part(self.directory.summary).write_bytes(b" " * _SUMMARY_ROOM)

    def _write_summary(self, summary: Mapping[str, Any]) -> None:
        write_summary(self.directory, with_scene(summary, self.scene))


def write_summary(directory: RunDirectory, summary: Mapping[str, Any]) -> None:
    """Replace ``summary.json``: a reader, or a run killed at this moment, finds the old or the new one, never half."""
    part = _part(directory.summary)
    with part.open("r+b" if part.exists() else "wb") as file:
        file.write(as_json(summary) + b"\n")
        file.truncate()
    os.replace(part, directory.summary)


def save(run: Trajectory, directory: str | Path, *, replace: bool) -> Path:
    """Write the files of a finished run; see `Trajectory.save`."""
    target = RunDirectory.create(directory, replace=replace)
    with FileRecorder(run.scene, target) as recorder:
        recorder.write(run)
    return target.path


def write_rows(directory: RunDirectory, rows: Iterable[Mapping[str, np.ndarray]]) -> None:
    """Replace ``trajectory.csv`` by columns, block after block. Raises OSError; the file is then as before."""
    with replaced(directory.trajectory) as file:
        for number, columns in enumerate(rows):
            if number == 0:
                file.write(_lines([list(columns)]))
            file.write(_lines(zip(*(values.tolist() for values in columns.values()), strict=True)))


@contextmanager
def replaced(path: Path) -> Iterator[BinaryIO]:
    """Open a file that takes the place of ``path`` once it is written; if that fails, the file is as before."""
    part = _part(path)
    try:
        with part.open("wb") as file:
            yield file
        os.replace(part, path)
    except BaseException:
        with suppress(OSError):
            part.unlink()
        raise


def at_multiples(run: Trajectory, interval: float) -> dict[str, np.ndarray]:
    """Return the columns of ``run`` at the multiples of ``interval`` [s] from its first to its last row."""
    first, last = (run.time[i] / interval for i in (0, -1))
    times = interval * np.arange(np.ceil(first * (1.0 - _SAME)), np.floor(last * (1.0 + _SAME)) + 1.0)
    return rows_at(run, np.clip(times, run.time[0], run.time[-1])).columns


def _part(path: Path) -> Path:
    """Return the file in which ``path`` is written before it takes its place."""
    return path.with_name(f"{path.name}.part")


def _append(file: FileIO, content: bytes) -> None:
    written = 0
    while written < len(content):  # a disk that is almost full takes a part, and then refuses
        written += file.write(content[written:])


def _fields(event: Event) -> list[Any]:
    values = [getattr(event, name) for name in EVENT_COLUMNS]
    return ["" if v is None else v if isinstance(v, str) else float(v) for v in values]


def _lines(rows: Iterable[Sequence[Any]]) -> bytes:
    """Return numbers and plain words as lines of CSV; JSON writes numbers as the shortest text that reads back."""
    text = to_json(list(rows))[2:-2].replace(b"],[", b"\n").replace(b'"', b"")
    return text + b"\n" if text else b""


def as_json(document: Any) -> bytes:
    """Return ``document`` as JSON; NaN and infinity become strings, because JSON has no such numbers."""
    return to_json(document, indent=2, inf_nan_mode="strings", fallback=lambda value: value.tolist())
