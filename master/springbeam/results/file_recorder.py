"""Results streamed into the files of a run directory.

Numbers are written as the shortest text that reads back to the same double, so a file holds exactly what was computed.
No file ever holds NaN or inf.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
from pydantic_core import to_json

from ..scene import Scene
from .directory import ResultsUnreadable, RunDirectory, lock
from .reading import load_events, load_trajectory
from .recording import Recorder, replay, with_scene
from .steps import STEP, steps_of
from .trajectory import EVENT_COLUMNS, SHAPE_COLUMNS, Event, Trajectory

#: Bytes kept free for the last summary; longer ones are written if the disk has room.
_SUMMARY_ROOM = 16384
#: Bytes of steps that are written together.
_STEPS_TOGETHER = 8192
#: Times closer than this share are one.
_SAME = 1e-12


class FileRecorder(Recorder):
    """Streams into a `RunDirectory` and keeps nothing, so that memory does not grow with the run.

    A row is in its file when `row` returns, its step some rows later, and ``summary.json`` says from the start which
    scene it belongs to: the results of a run that was killed can be loaded. Results of an earlier run stay until this
    one has something to record; then they are removed.

    Parameters
    ----------
    directory
        Where the results go (`RunDirectory.create`); the others are those of `Recorder`.
    """

    def __init__(self, scene: Scene, directory: RunDirectory, columns: Sequence[str] | None = None) -> None:
        super().__init__(scene, columns)
        self.directory = directory
        self.finished = False
        #: Time of the last row [s]; ``None`` before the first.
        self.time: float | None = None
        #: The columns of each file; one that is no table has none.
        self._columns: dict[Path, Sequence[str]] = {
            directory.trajectory: self.columns,
            directory.events: EVENT_COLUMNS,
            directory.steps: (),
        }
        if scene.beam is not None:
            self._columns[directory.shapes] = SHAPE_COLUMNS
        self._files: dict[Path, _Lines] = {}

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

    def _keep_row(self, numbers: list[float], phase: str) -> None:
        fields: list[float | str] = [*numbers]
        fields.insert(self._phase_at, phase)
        self._file(self.directory.trajectory).write(_line(fields))
        self.time = numbers[0]
        if len(self._steps) >= _STEPS_TOGETHER:
            self._write_steps()

    def _write_steps(self) -> None:
        waiting, self._steps = self._steps, bytearray()
        if waiting:
            steps_of(waiting)
            self._file(self.directory.steps).write(waiting)

    def steps(self) -> np.ndarray | None:
        self._write_steps()
        path = self.directory.steps
        whole = path.stat().st_size // STEP.itemsize if self.begun else 0
        return np.memmap(path, STEP, mode="r", shape=whole) if whole else None

    def events(self) -> Iterable[Event]:
        return load_events(self.directory.path) if self.begun else iter(())

    def _keep_event(self, event: Event) -> None:
        values = [getattr(event, name) for name in EVENT_COLUMNS]
        fields = ["" if v is None else v if isinstance(v, str) else float(v) for v in values]
        self._file(self.directory.events).write(_line(fields))

    def _keep_shape(self, numbers: list[float]) -> None:
        self._file(self.directory.shapes).write(_line(numbers))

    def finish(self, summary: Mapping[str, Any]) -> None:
        self._begin()
        self._write_steps()
        self.close()
        self._write_summary(summary)
        if summary.get("status") == "done":
            self.directory.checkpoint.unlink(missing_ok=True)
        self.finished = True

    def close(self) -> None:
        with ExitStack() as files:  # each is closed, also when another cannot be (a full disk)
            for lines in self._files.values():
                files.callback(lines.file.close)

    def save(self) -> dict[str, Any]:
        """Write what was recorded to the disk, and return what `restore` needs."""
        self._begin()
        self._write_steps()
        for lines in self._files.values():
            os.fsync(lines.file.fileno())
        return {"time": self.time, "files": {path.name: (f.size, f.crc) for path, f in self._files.items()}}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Go on from what `save` of a recorder in the same directory returned; later rows are removed.

        Raises
        ------
        ResultsUnreadable
            If a file is missing or has changed; nothing is removed then.
        ResultsInUse
            If another process is writing them.
        """
        with ExitStack() as opened:
            files: dict[Path, _Lines] = {}
            for path in self._columns:
                files[path] = _Lines(path, *saved["files"][path.name])
                opened.callback(files[path].file.close)
            lock(files[self.directory.trajectory].file)
            for lines in files.values():
                lines.check()
            opened.pop_all()
        self._files = files
        for lines in files.values():
            lines.file.truncate(lines.size)
        self.time = saved["time"]
        self._write_summary({"status": "running"})
        self._reserve_summary()

    def _file(self, path: Path) -> _Lines:
        self._begin()
        return self._files[path]

    def _begin(self) -> None:
        """Write the files with their headers, which then replace earlier results."""
        if self._files:
            return
        headers = {path: ",".join(names).encode() + b"\n" if names else b"" for path, names in self._columns.items()}
        try:
            for path, header in headers.items():
                _part(path).write_bytes(header)
            self._reserve_summary()
        except OSError:
            for path in (*headers, self.directory.summary):
                with suppress(OSError):
                    _part(path).unlink()
            raise
        for file in self.directory.results():
            file.unlink()
        for path, header in headers.items():
            os.replace(_part(path), path)
            self._files[path] = _Lines(path, len(header), crc32(header))
        lock(self._files[self.directory.trajectory].file)
        # Last: where there is a summary, there is a run that can be loaded.
        self._write_summary({"status": "running"})
        self._reserve_summary()

    def _reserve_summary(self) -> None:
        """Keep room on the disk for the last summary, which has to be written also when the disk is full."""
        _part(self.directory.summary).write_bytes(b" " * _SUMMARY_ROOM)

    def _write_summary(self, summary: Mapping[str, Any]) -> None:
        text, part = as_json(with_scene(summary, self.scene)), _part(self.directory.summary)
        # A reader, or a run killed at this moment, finds the old summary or the new one, never half of it.
        with part.open("r+b" if part.exists() else "wb") as file:
            file.write(text + b"\n")
            file.truncate()
        os.replace(part, self.directory.summary)


def save(run: Trajectory, directory: str | Path, *, replace: bool) -> Path:
    """Write the files of a finished run; see `Trajectory.save`."""
    target = RunDirectory.create(directory, replace=replace)
    with FileRecorder(run.scene, target, tuple(run.columns)) as recorder:
        replay(run, recorder)
    return target.path


def leave_rows_at_multiples(directory: RunDirectory, interval: float) -> None:
    """Replace the rows of a finished run by those at the multiples of ``interval`` [s] from its first to its last row.

    Events and shapes stay; nothing is left that tells what lies between the rows. Raises OSError; the directory is then
    as before.
    """
    run = load_trajectory(directory.path)
    if run.steps is None:  # it stopped before its first row
        return
    first, last = (run.time[i] / interval for i in (0, -1))
    times = interval * np.arange(np.ceil(first * (1.0 - _SAME)), np.floor(last * (1.0 + _SAME)) + 1.0)
    rows = run.at(np.clip(times, run.time[0], run.time[-1]))
    table = ",".join(run.columns).encode() + b"\n"
    table += b"".join(map(_line, zip(*(values.tolist() for values in rows.columns.values()), strict=True)))
    part = _part(directory.trajectory)
    try:
        part.write_bytes(table)
    except OSError:
        part.unlink(missing_ok=True)
        raise
    directory.steps.unlink()
    os.replace(part, directory.trajectory)


def _part(path: Path) -> Path:
    """Return the file in which ``path`` is written before it takes its place."""
    return path.with_name(f"{path.name}.part")


class _Lines:
    """A result file that grows line by line; each is handed to the system at once, so a killed run loses none."""

    def __init__(self, path: Path, size: int, crc: int) -> None:
        if not path.is_file():
            raise ResultsUnreadable(f"{path}: missing")
        self.path = path
        self.size, self.crc = size, crc  #: of the lines written [bytes], and their CRC-32
        self.file = path.open("ab", buffering=0)

    def check(self) -> None:
        """Raise ResultsUnreadable if the file does not begin with the lines written."""
        found, left = 0, self.size
        with self.path.open("rb") as file:
            while left > 0 and (chunk := file.read(min(left, 1 << 20))):
                found, left = crc32(chunk, found), left - len(chunk)
        if left > 0:
            raise ResultsUnreadable(f"{self.path}: {self.size - left} bytes, fewer than the {self.size} once written")
        if found != self.crc:
            raise ResultsUnreadable(f"{self.path}: changed since it was written")

    def write(self, line: bytes | bytearray) -> None:
        written = self.file.write(line)
        while written < len(line):  # a disk that is almost full takes a part, and then refuses
            written += self.file.write(line[written:])
        self.size += len(line)
        self.crc = crc32(line, self.crc)


def _line(fields: Sequence[Any]) -> bytes:
    """Return numbers and plain words as a line of CSV; JSON writes numbers alike, seven times faster than repr."""
    return to_json(fields)[1:-1].replace(b'"', b"") + b"\n"


def as_json(document: Any) -> bytes:
    """Return ``document`` as JSON; NaN and infinity become strings, because JSON has no such numbers."""
    return to_json(document, indent=2, inf_nan_mode="strings", fallback=lambda value: value.tolist())
