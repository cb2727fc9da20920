"""Checkpoints: all that a run needs to go on after it was killed, in one file of its directory.

The file is a line with SHA-256, then MessagePack. Reading it executes nothing. It is replaced at once or not at all,
after the records it belongs to have reached the disk.
"""

from __future__ import annotations

import dataclasses
import hashlib
import os
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import msgspec

from ..bodies.stateful import RunState
from ..results.file_recorder import FileRecorder, replaced
from ..scene import Scene, scene_from_dict

if TYPE_CHECKING:  # a command that only reads a checkpoint loads no FMU
    from .master import Master


class CheckpointRefused(ValueError):
    """A checkpoint is missing, damaged, or of another run; the message names the file and the cause."""


@dataclasses.dataclass(frozen=True)
class Checkpoint:
    """A run between two steps."""

    scene: Scene  #: as run
    version: str  #: of springbeam
    files: dict[str, str]  #: SHA-256 of the FMUs and tables, by name
    seconds: float  #: between checkpoints [s]
    wall_time: float  #: so far [s]
    interval: float | None  #: of the rows [s], as of `FileRecorder`
    results: dict[str, int]  #: what the files of the run have [bytes], by name
    state: RunState

    def write(self, path: Path) -> None:
        """Replace the file ``path``. Raises OSError; the file is then as before."""
        content = msgspec.msgpack.encode(self, enc_hook=lambda scene: scene.model_dump(exclude_none=True))
        with replaced(path) as file:
            file.write(_title(content) + b"\n" + content)
            file.flush()
            os.fsync(file.fileno())

    @classmethod
    def read(cls, path: Path) -> Checkpoint:
        """Raises CheckpointRefused if the file is missing or not, to the last byte, what this version writes."""

        def scene_of(_: type, data: Any) -> Scene:
            return scene_from_dict(data, source=f"{path}: scene")

        try:
            first, _, content = path.read_bytes().partition(b"\n")
        except OSError as error:
            raise CheckpointRefused(f"{path}: {error.strerror}") from error
        if first != _title(content):
            raise CheckpointRefused(f"{path}: not a checkpoint of springbeam, or damaged")
        try:
            return msgspec.msgpack.decode(content, type=cls, dec_hook=scene_of)
        except (ValueError, RecursionError) as error:
            raise CheckpointRefused(f"{path}: not what this version writes: {error!r}") from error


class Checkpoints:
    """Takes the checkpoints of a run into the directory of its results.

    Parameters
    ----------
    recorder
        Of the run.
    seconds
        Of the clock between checkpoints [s]; the first is taken at once.
    version, files
        As in `Checkpoint`.
    wall_time
        That the run took before now [s].
    """

    def __init__(
        self, recorder: FileRecorder, seconds: float, version: str, files: dict[str, str], wall_time: float
    ) -> None:
        self._recorder, self._seconds, self._version, self._files = recorder, seconds, version, files
        self._began = perf_counter() - wall_time
        self._due = self._began + wall_time

    def take_when_due(self, simulation: Master) -> None:
        """To be called between two steps. Raises OSError if the disk refuses; the last checkpoint stays then."""
        now = perf_counter()
        if now < self._due:
            return
        simulation.hand_over()
        recorder = self._recorder
        begun = recorder.scene, self._version, self._files, self._seconds, now - self._began
        checkpoint = Checkpoint(*begun, recorder.interval, recorder.save(), simulation.run_state())
        checkpoint.write(self._recorder.directory.checkpoint)
        self._due = perf_counter() + self._seconds


def _title(content: bytes) -> bytes:
    return b"springbeam checkpoint sha256 " + hashlib.sha256(content).hexdigest().encode()
