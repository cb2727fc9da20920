"""Checkpoints: all that a run needs to go on after it was killed, in one file of its directory.

The file is a line with SHA-256, then MessagePack. Reading it executes nothing. It is replaced at once or not at all,
after the records it belongs to have reached the disk.
"""

from __future__ import annotations

import dataclasses
import hashlib
import os
from pathlib import Path
from typing import Any

import msgspec

from ..bodies.protocol import RunState
from ..results.files import replaced
from ..scene import Scene, scene_from_dict


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


def _title(content: bytes) -> bytes:
    return b"springbeam checkpoint sha256 " + hashlib.sha256(content).hexdigest().encode()
