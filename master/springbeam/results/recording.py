"""Where a run's results go: into memory, or streamed into the files of a run directory.

A run directory holds ``trajectory.csv`` (a row per accepted step), ``events.csv``, ``shapes.csv`` (the beam's
deflection at `SHAPE_POINTS`), ``summary.json`` and pictures. Numbers are written as the shortest
text that reads back to the same double, so a file holds exactly what was computed. No file ever holds NaN or inf.
"""

from __future__ import annotations

import dataclasses
import json
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from itertools import count
from math import isfinite
from pathlib import Path
from struct import Struct
from types import TracebackType
from typing import Any, BinaryIO, Protocol
from zlib import crc32

import numpy as np
from pydantic_core import to_json

from ..scene import Scene, scene_from_dict
from ..scene.statics import SHAPE_POINTS
from .trajectory import COLUMNS, EVENT_COLUMNS, EVENT_KINDS, Event, Trajectory

try:
    import fcntl
except ImportError:  # Windows: two processes in one directory are not noticed
    fcntl = None  # type: ignore[assignment]

#: Pictures `springbeam.pictures.plots.plot_run` may leave in a run directory.
PICTURES = (
    "a_shapes_after_contact.png",
    "b_shapes_later.png",
    "c_positions.png",
    "d_velocities_and_forces.png",
    "e_gap_and_energy.png",
)

#: What `springbeam report` and `springbeam animate` may leave there.
REPORT = "report.html"
ANIMATIONS = ("animation.gif", "animation.mp4")

_OF_BEAM = frozenset({"u_tip", "v_tip", "e_beam"})
_OF_SPRING = frozenset({"y", "z", "e_spring"})
_OF_PAIR = frozenset(
    {"contact_force", "contact_force_smoothed", "compliance_force", "tie_reaction", "velocity_mismatch", "e_contact"}
)
_TRAJECTORY, _EVENTS, _SHAPES = "trajectory.csv", "events.csv", "shapes.csv"
_SHAPE_HEADER = ("time", *(f"u_{i}" for i in range(len(SHAPE_POINTS))))
#: Of a summary; longer ones are written if the disk has room.
_SUMMARY_ROOM = 16384
_PHASE_WIDTH = 32


class ResultsExist(FileExistsError):
    """The directory already holds results, which are never overwritten unasked."""


class ResultsInUse(RuntimeError):
    """Another process is writing results into the directory."""


class ResultsUnreadable(ValueError):
    """A run directory cannot be read; the message names the file and, where known, the line."""


class NonFiniteValue(ValueError):
    """A NaN or an infinity was about to be recorded, in ``column`` at ``time`` [s]."""

    def __init__(self, column: str, time: float, value: float) -> None:
        super().__init__(f"{column} = {value} at t = {time!r} s: not a finite number")
        self.column = column
        self.time = time
        self.value = value


def columns_of(scene: Scene) -> tuple[str, ...]:
    """The columns of ``scene`` in file order: `COLUMNS` without those of bodies that it does not have.

    ``gap`` is u_tip − y of a pair, u_tip − φ of a beam above a stop.
    """
    beam, spring, stop = scene.beam is not None, scene.spring is not None, scene.stop is not None
    absent: set[str] = set()
    if not beam:
        absent |= _OF_BEAM
    if not spring:
        absent |= _OF_SPRING
    if not (beam and spring):
        absent |= _OF_PAIR
    if not stop:
        absent.add("foundation_force")
    if not (beam and (spring or stop)):
        absent.add("gap")
    return tuple(name for name in COLUMNS if name not in absent)


class Recorder(Protocol):
    """What a run reports to, in this order: any number of rows, events and shapes, then ``finish``."""

    columns: tuple[str, ...]

    def row(self, values: Mapping[str, Any] | Sequence[Any]) -> None:
        """One accepted step: a value per column, by name (further names are ignored) or in column order.

        Raises
        ------
        NonFiniteValue
            If a number is NaN or infinite; nothing of the row is recorded then.
        """

    def event(self, event: Event) -> None: ...

    def shape(self, time: float, deflection: np.ndarray) -> None:
        """The beam's deflection [m] at `SHAPE_POINTS`, shape (21,)."""

    def finish(self, summary: Mapping[str, Any]) -> None:
        """The last call; ``summary`` is JSON-like. The scene as run is added.

        The command line reports ``status`` (``done``, ``stopped``, ``interrupted``), ``macro_steps``, ``wall_time``
        [s], ``max_energy_residual`` (relative) and ``warnings`` (list of str), those that are there.
        """


class _Checks:
    """What both recorders refuse."""

    def __init__(self, scene: Scene, columns: Sequence[str] | None) -> None:
        self.scene = scene
        self.columns = columns_of(scene) if columns is None else tuple(columns)
        self._phase_at = self.columns.index("phase") if "phase" in self.columns else -1
        self._numbers = [name for name in self.columns if name != "phase"]
        self._phases: set[str] = set()

    def _checked_row(self, values: Mapping[str, Any] | Sequence[Any]) -> tuple[list[float], str]:
        """The numbers of the row, and its phase."""
        if not isinstance(values, tuple) and isinstance(values, Mapping):  # the first is the quicker to tell
            try:
                values = [values[name] for name in self.columns]
            except KeyError as missing:
                raise ValueError(f"row without column {missing}") from None
        elif len(values) != len(self.columns):
            raise ValueError(f"row of {len(values)} values for {len(self.columns)} columns")
        values = list(values)
        phase = ""
        if self._phase_at >= 0:
            phase = values.pop(self._phase_at)
            if phase not in self._phases:
                self._check_phase(phase)
        row = list(map(float, values))
        if not isfinite(sum(row)):  # or the sum alone overflows
            for name, value in zip(self._numbers, row, strict=True):
                if not isfinite(value):
                    raise NonFiniteValue(name, row[0], value)
        return row, phase

    def _check_phase(self, phase: str) -> None:
        if not phase.isprintable() or not 0 < len(phase) <= _PHASE_WIDTH or set(phase) & set(',"\\'):
            raise ValueError(f"phase {phase!r} cannot be written to a file")
        self._phases.add(phase)

    @staticmethod
    def _checked_event(event: Event) -> Event:
        if event.kind not in EVENT_KINDS:
            raise ValueError(f"event kind {event.kind!r}; allowed: {', '.join(EVENT_KINDS)}")
        for name in EVENT_COLUMNS:
            value = getattr(event, name)
            if name != "kind" and value is not None and not isfinite(value):
                raise NonFiniteValue(f"{name} of event {event.kind!r}", event.time, value)
        return event

    @staticmethod
    def _checked_shape(time: float, deflection: np.ndarray) -> np.ndarray:
        shape = np.asarray(deflection, dtype=float)
        if shape.shape != SHAPE_POINTS.shape:
            raise ValueError(f"shape of {shape.shape} values for {SHAPE_POINTS.shape} points")
        values = [time, *shape.tolist()]
        if not isfinite(sum(values)):  # or the sum alone overflows
            for name, value in zip(_SHAPE_HEADER, values, strict=True):
                if not isfinite(value):
                    raise NonFiniteValue(name, time, value)
        return shape


def _columns(rows: bytearray, width: int) -> list[np.ndarray]:
    """The columns of rows of doubles."""
    return [column.copy() for column in np.frombuffer(rows).reshape(-1, width).T]


class MemoryRecorder(_Checks):
    """Keeps everything; `trajectory` is the result.

    Parameters
    ----------
    scene
        The scene as run.
    columns
        Names in row order, starting with ``time``; default `columns_of(scene)`.
    """

    def __init__(self, scene: Scene, columns: Sequence[str] | None = None) -> None:
        super().__init__(scene, columns)
        self._rows = bytearray()
        self._packed = Struct(f"{len(self._numbers)}d").pack
        self._phase_of_row: list[str] = []
        self._events: list[Event] = []
        self._shapes = bytearray()
        self._summary: dict[str, Any] = {}

    def row(self, values: Mapping[str, Any] | Sequence[Any]) -> None:
        row, phase = self._checked_row(values)
        self._rows += self._packed(*row)
        self._phase_of_row.append(phase)

    def event(self, event: Event) -> None:
        self._events.append(self._checked_event(event))

    def shape(self, time: float, deflection: np.ndarray) -> None:
        shape = self._checked_shape(time, deflection)
        self._shapes += np.float64(time).tobytes() + shape.tobytes()

    def finish(self, summary: Mapping[str, Any]) -> None:
        self._summary = _with_scene(summary, self.scene)

    def trajectory(self) -> Trajectory:
        """Everything recorded so far."""
        numbers = iter(_columns(self._rows, len(self._numbers)))
        phases = np.array(self._phase_of_row, dtype=str)
        columns = {name: phases if name == "phase" else next(numbers) for name in self.columns}
        shapes = None
        if self.scene.beam is not None:
            time, *deflection = _columns(self._shapes, len(_SHAPE_HEADER))
            shapes = (time, np.column_stack(deflection))
        return Trajectory(self.scene, columns, list(self._events), shapes, dict(self._summary))


def replay(trajectory: Trajectory, recorder: Recorder) -> None:
    """Record a run that has been made, to its end, as if it were made now."""
    for i in range(len(trajectory)):
        recorder.row({name: values[i] for name, values in trajectory.columns.items()})
    for event in trajectory.events:
        recorder.event(event)
    for time, deflection in zip(*(trajectory.shapes or ((), ())), strict=True):
        recorder.shape(float(time), deflection)
    recorder.finish({key: value for key, value in trajectory.summary.items() if key != "scene"})


@dataclasses.dataclass(frozen=True)
class RunDirectory:
    """The files of one run."""

    path: Path

    @property
    def trajectory(self) -> Path:
        return self.path / _TRAJECTORY

    @property
    def events(self) -> Path:
        return self.path / _EVENTS

    @property
    def shapes(self) -> Path:
        return self.path / _SHAPES

    @property
    def summary(self) -> Path:
        return self.path / "summary.json"

    @property
    def checkpoint(self) -> Path:
        """There as long as the run is not done, if it was to take checkpoints (`springbeam.run.checkpoint`)."""
        return self.path / "run.checkpoint"

    @property
    def pictures(self) -> list[Path]:
        """The pictures that are there."""
        return [self.path / name for name in PICTURES if (self.path / name).exists()]

    def results(self) -> list[Path]:
        """The result files that are there, and what was made from them."""
        files = (self.summary, self.trajectory, self.events, self.shapes, self.checkpoint)
        made = (self.path / name for name in (REPORT, *ANIMATIONS))
        return [file for file in (*files, *self.pictures, *made) if file.exists()]

    def discard(self) -> None:
        """Remove the directory if nothing is in it."""
        with suppress(OSError):
            self.path.rmdir()

    @classmethod
    def create(cls, path: str | Path, *, replace: bool = False) -> RunDirectory:
        """The directory ``path``, made if need be; what is in it stays until a `FileRecorder` begins to write there.

        Parameters
        ----------
        path
            The directory.
        replace
            It may hold results of an earlier run.

        Raises
        ------
        ResultsExist
            If it holds results and ``replace`` is false.
        ResultsInUse
            If another process is writing them.
        OSError
            If the directory cannot be made or written to.
        """
        directory = cls(Path(path))
        directory.path.mkdir(parents=True, exist_ok=True)
        results = directory.results()
        if results and not replace:
            raise ResultsExist(f"{directory.path} already holds results ({results[0].name})")
        if directory.trajectory.exists():
            with directory.trajectory.open("rb") as file:
                _lock(file)
        try:
            tempfile.TemporaryFile(dir=directory.path).close()
        except OSError as error:
            directory.discard()
            raise OSError(error.errno, error.strerror, str(directory.path)) from error
        return directory

    @classmethod
    def create_numbered(cls, path: str | Path) -> RunDirectory:
        """A new directory: ``path``, or ``path-2``, ``path-3``, … when that exists.

        Runs started at the same time get different directories.
        """
        first = Path(path)
        first.parent.mkdir(parents=True, exist_ok=True)
        for number in count(1):
            candidate = first if number == 1 else first.with_name(f"{first.name}-{number}")
            try:
                candidate.mkdir()
            except FileExistsError:
                continue
            return cls(candidate)
        raise AssertionError("unreachable")


def _lock(file: BinaryIO) -> None:
    """Hold ``file`` until it is closed or the process ends. Raises ResultsInUse if another process does."""
    if fcntl is None:
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise ResultsInUse(f"{file.name}: another process is writing to it") from None
    except OSError:  # a file system without locks
        return


class _Lines:
    """A result file that grows line by line; each is the operating system's at once, so a killed run loses none."""

    def __init__(self, path: Path, size: int, crc: int) -> None:
        if not path.is_file():
            raise ResultsUnreadable(f"{path}: missing")
        self.path = path
        self.size, self.crc = size, crc  #: of the lines written [bytes], and their CRC-32
        self.file = path.open("ab", buffering=0)

    def check(self) -> None:
        """Raises ResultsUnreadable if the file does not begin with the lines written."""
        found, left = 0, self.size
        with self.path.open("rb") as file:
            while left > 0 and (chunk := file.read(min(left, 1 << 20))):
                found, left = crc32(chunk, found), left - len(chunk)
        if left > 0:
            raise ResultsUnreadable(f"{self.path}: {self.size - left} bytes, fewer than the {self.size} once written")
        if found != self.crc:
            raise ResultsUnreadable(f"{self.path}: changed since it was written")

    def cut(self) -> None:
        """Remove what follows the lines written."""
        self.file.truncate(self.size)

    def write(self, line: bytes) -> None:
        written = self.file.write(line)
        while written < len(line):  # a disk that is almost full takes a part, and then refuses
            written += self.file.write(line[written:])
        self.size += len(line)
        self.crc = crc32(line, self.crc)


class FileRecorder(_Checks):
    """Streams into a `RunDirectory` and keeps nothing, so that memory does not grow with the run.

    A row is in its file when `row` returns, and ``summary.json`` says from the start which scene it belongs to: the
    results of a run that was killed can be loaded. Results of an earlier run stay until this one has something to
    record, and are gone then.

    Parameters
    ----------
    scene
        The scene as run.
    directory
        Where the results go (`RunDirectory.create`).
    columns
        Names in row order, starting with ``time``; default `columns_of(scene)`.
    """

    def __init__(self, scene: Scene, directory: RunDirectory, columns: Sequence[str] | None = None) -> None:
        super().__init__(scene, columns)
        self.directory = directory
        self.finished = False
        #: Of the last row [s]; ``None`` before the first.
        self.time: float | None = None
        self._headers = {_TRAJECTORY: self.columns, _EVENTS: EVENT_COLUMNS}
        if scene.beam is not None:
            self._headers[_SHAPES] = _SHAPE_HEADER
        self._files: dict[str, _Lines] = {}

    def __enter__(self) -> FileRecorder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self.begun and not self.finished and error is not None:
            self.finish({"status": "stopped", "cause": f"{type(error).__name__}: {error}", "time": self.time})
        self.close()

    @property
    def begun(self) -> bool:
        """Whether the directory holds results of this run."""
        return bool(self._files)

    def row(self, values: Mapping[str, Any] | Sequence[Any]) -> None:
        row, phase = self._checked_row(values)
        fields: list[float | str] = [*row]
        if self._phase_at >= 0:
            fields.insert(self._phase_at, phase)
        self._file(_TRAJECTORY).write(_line(fields))
        self.time = row[0]

    def event(self, event: Event) -> None:
        values = [getattr(self._checked_event(event), name) for name in EVENT_COLUMNS]
        fields = ["" if v is None else v if isinstance(v, str) else repr(float(v)) for v in values]
        self._file(_EVENTS).write((",".join(fields) + "\n").encode())

    def shape(self, time: float, deflection: np.ndarray) -> None:
        shape = self._checked_shape(time, deflection)
        if self.scene.beam is None:
            raise ValueError("a beam's shape in a scene without a beam")
        self._file(_SHAPES).write(_line([float(time), *shape.tolist()]))

    def finish(self, summary: Mapping[str, Any]) -> None:
        self._begin()
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
        """Put what was recorded on the disk, and return what `restore` needs."""
        self._begin()
        for lines in self._files.values():
            os.fsync(lines.file.fileno())
        return {"time": self.time, "files": {name: (f.size, f.crc) for name, f in self._files.items()}}

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
            files: dict[str, _Lines] = {}
            for name in self._headers:
                files[name] = _Lines(self.directory.path / name, *saved["files"][name])
                opened.callback(files[name].file.close)
            _lock(files[_TRAJECTORY].file)
            for lines in files.values():
                lines.check()
            opened.pop_all()
        self._files = files
        for lines in files.values():
            lines.cut()
        self.time = saved["time"]
        self._write_summary({"status": "running"})
        self._reserve_summary()

    def _file(self, name: str) -> _Lines:
        if not self._files:
            self._begin()
        return self._files[name]

    def _begin(self) -> None:
        """The files with their headers, in place of earlier results once they are written."""
        if self._files:
            return
        headers = {name: (",".join(columns) + "\n").encode() for name, columns in self._headers.items()}
        parts = {name: self.directory.path / f"{name}.part" for name in headers}
        try:
            for name, header in headers.items():
                parts[name].write_bytes(header)
            self._reserve_summary()
        except OSError:
            for part in (*parts.values(), self._summary_part):
                with suppress(OSError):
                    part.unlink()
            raise
        for file in self.directory.results():
            file.unlink()
        for name, part in parts.items():
            path = self.directory.path / name
            os.replace(part, path)
            self._files[name] = _Lines(path, len(headers[name]), crc32(headers[name]))
        _lock(self._files[_TRAJECTORY].file)
        # Last: where there is a summary, there is a run that can be loaded.
        self._write_summary({"status": "running"})
        self._reserve_summary()

    @property
    def _summary_part(self) -> Path:
        return self.directory.summary.with_suffix(".json.part")

    def _reserve_summary(self) -> None:
        """Room on the disk for the last summary, which has to say so when the disk is full."""
        self._summary_part.write_bytes(b" " * _SUMMARY_ROOM)

    def _write_summary(self, summary: Mapping[str, Any]) -> None:
        text = json.dumps(json_ready(_with_scene(summary, self.scene)), indent=2, allow_nan=False, ensure_ascii=False)
        # A reader, or a run killed at this moment, finds the old summary or the new one, never half of it.
        with self._summary_part.open("r+b" if self._summary_part.exists() else "wb") as file:
            file.write(text.encode() + b"\n")
            file.truncate()
        os.replace(self._summary_part, self.directory.summary)


def load_trajectory(directory: str | Path) -> Trajectory:
    """Read a run directory, also of a run that was stopped or killed: an incomplete last line is left out.

    Raises
    ------
    ResultsUnreadable
        If a file is missing or is not what a run writes.
    """
    run = RunDirectory(Path(directory))
    summary = load_summary(run.path)
    header, lines = _complete_lines(run.trajectory)
    columns = _read_table(run.trajectory, header, lines)
    shapes = None
    if run.shapes.exists():
        header, lines = _complete_lines(run.shapes)
        if header != _SHAPE_HEADER:
            raise ResultsUnreadable(f"{run.shapes}: line 1: not the columns of shapes.csv")
        table = _read_table(run.shapes, header, lines)
        shapes = (table["time"], np.column_stack([table[name] for name in header[1:]]))
    scene = scene_from_dict(summary["scene"], source=f"{run.summary}: scene")
    return Trajectory(scene, columns, list(load_events(run.path)), shapes, summary)


def load_summary(directory: str | Path) -> dict[str, Any]:
    """``summary.json`` of a run directory."""
    path = RunDirectory(Path(directory)).summary
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ResultsUnreadable(f"{path}: missing; {directory} is not a run directory") from None
    except (OSError, ValueError) as error:
        raise ResultsUnreadable(f"{path}: {error}") from error
    if not isinstance(summary, dict) or not isinstance(summary.get("scene"), dict):
        raise ResultsUnreadable(f"{path}: no scene in it")
    return summary


def load_events(directory: str | Path) -> Iterator[Event]:
    """The events of a run directory, one at a time."""
    path = RunDirectory(Path(directory)).events
    header, lines = _complete_lines(path)
    if header != EVENT_COLUMNS:
        raise ResultsUnreadable(f"{path}: line 1: not the columns of events.csv")
    for number, line in enumerate(lines, start=2):
        fields = line.rstrip("\n").split(",")
        if len(fields) != len(EVENT_COLUMNS) or fields[1] not in EVENT_KINDS:
            raise ResultsUnreadable(f"{path}: line {number}: not an event: {line.strip()[:60]!r}")
        named = dict(zip(EVENT_COLUMNS, fields, strict=True))
        kind = named.pop("kind")
        try:
            values = {name: float(text) for name, text in named.items() if text}
            yield Event(kind=kind, **values)
        except (TypeError, ValueError) as error:
            raise ResultsUnreadable(f"{path}: line {number}: {error}") from None


def _line(fields: list[Any]) -> bytes:
    """Numbers and plain words as a line of CSV; JSON writes numbers the same way, seven times faster than repr."""
    return to_json(fields)[1:-1].replace(b'"', b"") + b"\n"


def _complete_lines(path: Path) -> tuple[tuple[str, ...], Iterator[str]]:
    """Header and an iterator over the lines after it that end in a newline."""

    def lines() -> Iterator[str]:
        with path.open(encoding="utf-8", newline="\n") as file:
            yield from (line for line in file if line.endswith("\n"))

    try:
        everything = lines()
        header = next(everything, None)
    except (OSError, UnicodeDecodeError) as error:
        raise ResultsUnreadable(f"{path}: {error}") from error
    if header is None:
        raise ResultsUnreadable(f"{path}: empty")
    return tuple(header.rstrip("\n").split(",")), everything


def _read_table(path: Path, header: tuple[str, ...], lines: Iterator[str]) -> dict[str, np.ndarray]:
    kinds = [(name, f"U{_PHASE_WIDTH}" if name == "phase" else "f8") for name in header]
    first = next(lines, None)
    if first is None:
        table = np.empty(0, dtype=kinds)
    else:
        try:
            table = np.loadtxt(_chain(first, lines), dtype=kinds, delimiter=",", comments=None, ndmin=1)
        except ValueError as error:
            raise ResultsUnreadable(f"{path}: after the header: {error}") from None
    columns = {name: np.ascontiguousarray(table[name]) for name in header}
    if "phase" in columns:
        phase = columns["phase"]
        columns["phase"] = phase.astype(f"U{max(1, int(np.char.str_len(phase).max(initial=1)))}")
    for name, values in columns.items():
        if name != "phase" and not np.isfinite(values).all():
            raise ResultsUnreadable(f"{path}: {name} holds a number that is not finite")
    return columns


def _chain(first: str, rest: Iterable[str]) -> Iterator[str]:
    yield first
    yield from rest


def _with_scene(summary: Mapping[str, Any], scene: Scene) -> dict[str, Any]:
    return {**summary, "scene": scene.model_dump(exclude_none=True)}


_PLAIN: tuple[tuple[type, Callable[[Any], Any]], ...] = (
    (np.bool_, bool),
    (np.integer, int),
    (np.floating, float),
    (np.ndarray, np.ndarray.tolist),
    (Path, str),
)


def json_ready(value: Any) -> Any:
    """Plain JSON types; a number that is not finite becomes its name: JSON has none, a stopped run may."""
    for kind, plain in _PLAIN:
        if isinstance(value, kind):
            value = plain(value)
    if isinstance(value, float) and not isfinite(value):
        return repr(value)
    if isinstance(value, Mapping):
        return {str(key): json_ready(item) for key, item in value.items()}
    if isinstance(value, (list, tuple, set, frozenset)):
        return [json_ready(item) for item in value]
    return value
