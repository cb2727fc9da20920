"""Checkpoints: all that a run needs to go on after it was killed, in one file of its directory.

The file is a line with format and SHA-256, then JSON: numbers as the shortest text that reads back to the same
double, FMU states in base64. Reading it executes nothing. It is replaced at once or not at all, after the rows it
belongs to have reached the disk.
"""

from __future__ import annotations

import base64
import dataclasses
import hashlib
import json
import os
from collections.abc import Callable
from contextlib import suppress
from enum import Enum
from math import isfinite
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from ..bodies.protocol import Motion
from ..contact.phases import Joint, Phase
from ..results.file_recorder import FileRecorder
from ..scene import Scene, scene_from_dict

if TYPE_CHECKING:  # a command that only reads a checkpoint loads no FMU
    from .master import Master
    from .paper_law import PaperLaw

_FORMAT = 1
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
        content = json.dumps(encoded(values)).encode()
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
            values = decoded(json.loads(content))
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

    def take_when_due(self, simulation: Master | PaperLaw) -> None:
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


# -- values as JSON: lists, and dicts with text for keys, are themselves; the others are {"$type": content} -----------

_DECODERS: dict[str, Callable[[Any], Any]] = {
    "$float": float,
    "$tuple": tuple,
    "$dict": dict,
    "$bytes": lambda text: base64.b64decode(text, validate=True),
    "$array": lambda numbers: np.array(numbers, dtype=float),
    "$Joint": Joint,
    "$Phase": lambda fields: Phase(*fields),
    "$Motion": lambda fields: Motion(*fields),
}


def encoded(value: Any) -> Any:
    """``value`` in what JSON has. Raises TypeError for a type that a checkpoint cannot hold."""
    kind = type(value)
    if value is None or kind in (bool, int, str):
        return value
    if isinstance(value, float):
        return float(value) if isfinite(value) else {"$float": repr(float(value))}
    if kind is list:
        return [encoded(item) for item in value]
    if kind is dict:
        if all(type(key) is str and not key.startswith("$") for key in value):
            return {key: encoded(item) for key, item in value.items()}
        return {"$dict": [[encoded(key), encoded(item)] for key, item in value.items()]}
    if kind is bytes:
        return {"$bytes": base64.b64encode(value).decode()}
    if kind is np.ndarray and value.dtype == float:
        return {"$array": value.tolist()}
    if f"${kind.__name__}" in _DECODERS:
        if isinstance(value, Enum):
            return {f"${kind.__name__}": value.value}
        fields = (
            value if isinstance(value, tuple) else [getattr(value, field.name) for field in dataclasses.fields(value)]
        )
        return {f"${kind.__name__}": [encoded(item) for item in fields]}
    raise TypeError(f"a checkpoint cannot hold a {kind.__name__}: {value!r}")


def decoded(value: Any) -> Any:
    """What `encoded` was given."""
    if isinstance(value, list):
        return [decoded(item) for item in value]
    if not isinstance(value, dict):
        return value
    plain = {key: decoded(item) for key, item in value.items()}
    if len(plain) == 1:
        key, item = next(iter(plain.items()))
        if key in _DECODERS:
            return _DECODERS[key](item)
    return plain
