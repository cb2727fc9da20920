"""Checkpoints: all that a run needs to go on after it was killed, in one file of its directory.

The file is a line with format and SHA-256, then MessagePack. Reading it executes nothing. It is replaced at once or not
at all, after the records it belongs to have reached the disk.
"""

from __future__ import annotations

import dataclasses
import hashlib
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import msgpack
import numpy as np

from ..bodies.protocol import Motion
from ..contact.phases import Joint, Phase
from ..results.file_recorder import FileRecorder
from ..scene import Scene, scene_from_dict

if TYPE_CHECKING:  # a command that only reads a checkpoint loads no FMU
    from .master import Master

_FORMAT = 2
_TITLE = b"springbeam checkpoint"


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
    results: dict[str, Any]  #: `springbeam.results.file_recorder.FileRecorder.save`
    simulation: dict[str, Any]  #: `springbeam.bodies.checkpointed.Checkpointed.save`

    def write(self, path: Path) -> None:
        """Replace the file ``path``. Raises OSError; the file is then as before."""
        values = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        values["scene"] = self.scene.model_dump(exclude_none=True)
        content = encoded(values)
        scratch = path.with_name(path.name + ".part")
        try:
            with scratch.open("wb") as file:
                file.write(b"%s %d sha256 %s\n" % (_TITLE, _FORMAT, _digest(content)))
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            os.replace(scratch, path)
        except BaseException:
            with suppress(OSError):
                scratch.unlink()
            raise
        _sync_directory(path.parent)

    @classmethod
    def read(cls, path: Path) -> Checkpoint:
        """Raises CheckpointRefused if the file is missing or not, to the last byte, what was written.

        SceneError if its scene is not one of this version.
        """
        try:
            first, _, content = path.read_bytes().partition(b"\n")
        except OSError as error:
            raise CheckpointRefused(f"{path}: {error.strerror}") from error
        words = first.removeprefix(_TITLE).split()
        if not first.startswith(_TITLE) or len(words) != 3:
            raise CheckpointRefused(f"{path}: not a checkpoint of springbeam")
        if words[0] != b"%d" % _FORMAT:
            raise CheckpointRefused(f"{path}: of format {words[0].decode(errors='replace')}, this is {_FORMAT}")
        if words[2] != _digest(content):
            raise CheckpointRefused(f"{path}: damaged, its checksum is wrong")
        try:
            values = decoded(content)
            scene = scene_from_dict(values.pop("scene"), source=f"{path}: scene")
            return cls(scene=scene, **values)
        except (ValueError, TypeError, AttributeError, LookupError, RecursionError) as error:
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
        scene, results = self._recorder.scene, self._recorder.save()
        wall_time = now - self._began
        checkpoint = Checkpoint(scene, self._version, self._files, self._seconds, wall_time, results, simulation.save())
        checkpoint.write(self._recorder.directory.checkpoint)
        self._due = perf_counter() + self._seconds


def _sync_directory(path: Path) -> None:
    """Make a renamed file's name durable, where the system can."""
    if os.name == "nt":
        return
    folder = os.open(path, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


def _digest(content: bytes) -> bytes:
    return hashlib.sha256(content).hexdigest().encode()


#: Types of values that MessagePack does not tell apart or does not know, by the number in its extension: what a value
#: is made of, and how it is made again.
_KINDS: dict[type, tuple[int, Callable[[Any], Any], Callable[[Any], Any]]] = {
    tuple: (1, list, tuple),
    Joint: (2, lambda joint: joint.value, Joint),
    Phase: (3, lambda phase: [phase.joint, phase.seated], lambda parts: Phase(*parts)),
    Motion: (4, list, lambda parts: Motion(*parts)),
    np.ndarray: (5, np.ndarray.tolist, lambda parts: np.array(parts, dtype=float)),
    np.float64: (6, float, float),
}


def encoded(value: Any) -> bytes:
    """Return ``value`` as MessagePack, numbers to the last bit. Raises TypeError for what a checkpoint cannot hold."""
    packed: bytes = msgpack.packb(value, default=_extension, strict_types=True)
    return packed


def _extension(value: Any) -> msgpack.ExtType:
    if type(value) not in _KINDS or (isinstance(value, np.ndarray) and value.dtype != float):
        raise TypeError(f"a checkpoint cannot hold a {type(value).__name__}: {value!r}")
    number, parts, _ = _KINDS[type(value)]
    return msgpack.ExtType(number, encoded(parts(value)))


def decoded(content: bytes) -> Any:
    """Return what `encoded` was given. Raises ValueError, TypeError or LookupError for anything else."""
    made = {number: make for number, _, make in _KINDS.values()}
    return msgpack.unpackb(content, ext_hook=lambda number, parts: made[number](decoded(parts)), strict_map_key=False)
