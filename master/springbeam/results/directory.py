"""A run directory: its files, the claim on it, and the errors of one that cannot be read.

Three arrays are the run, ``steps.bin``, ``events.bin`` and ``shapes.bin`` (`springbeam.results.records`); its scene is
in ``summary.json``. Tables and pictures are made of them, and not read again. ``files`` writes and reads them.
"""

from __future__ import annotations

import os
from contextlib import suppress
from itertools import chain, count
from pathlib import Path
from typing import BinaryIO
from weakref import finalize

try:
    import fcntl
except ImportError:  # Windows: two processes in one directory are not noticed
    fcntl = None  # type: ignore[assignment]

#: Pictures that `springbeam run` (the first) and `springbeam plot` may leave in a run directory, by name.
PICTURES = {
    "overview": "overview.png",
    "shapes_after_contact": "a_shapes_after_contact.png",
    "shapes_later": "b_shapes_later.png",
    "positions": "c_positions.png",
    "velocities_and_forces": "d_velocities_and_forces.png",
    "gap_and_energy": "e_gap_and_energy.png",
    "loads_and_clamp": "f_loads_and_clamp.png",
    "moments": "g_moments.png",
}
OVERVIEW = "overview"
#: The tables: rows, events, contacts and shapes, as CSV, and as `springbeam export --format parquet` leaves them there.
TABLES = ("trajectory.csv", "events.csv", "contacts.csv", "shapes.csv")
PARQUET = ("trajectory.parquet", "events.parquet", "contacts.parquet", "shapes.parquet")
#: What `springbeam report` and `springbeam animate` may leave there.
REPORT = "report.html"
ANIMATIONS = ("animation.gif", "animation.mp4")


class ResultsExist(FileExistsError):
    """The directory already holds results, which only ``replace`` overwrites."""


class ResultsInUse(RuntimeError):
    """Another process is writing results into the directory."""


class ResultsUnreadable(ValueError):
    """A run directory cannot be read; the message names the file and, where known, the line."""


class RunDirectory:
    """The files of one run in the directory ``path``, whether they exist or not."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.steps = self.path / "steps.bin"
        self.events = self.path / "events.bin"
        self.shapes = self.path / "shapes.bin"
        self.rows = self.path / "rows.npz"  #: of a run without records: that of a reference, or of Algorithm 1
        self.summary = self.path / "summary.json"
        self._claim: finalize[..., RunDirectory] | None = None
        self._made = [folder for folder in (self.path, *self.path.parents) if not folder.exists()]

    def results(self) -> list[Path]:
        """Return the result files that exist, and the files made from them."""
        files = (self.summary, self.events, self.shapes, self.steps, self.rows)
        derived = (self.path / name for name in (*TABLES, *PARQUET, *PICTURES.values(), REPORT, *ANIMATIONS))
        return [file for file in (*files, *derived) if file.exists()]

    def sizes(self) -> dict[str, int]:
        """Return the sizes of the files that hold the run [bytes], of those that exist."""
        files = (self.steps, self.events, self.shapes, self.rows)
        return {file.name: file.stat().st_size for file in files if file.exists()}

    def claim(self) -> None:
        """Keep other processes out until `release`, or until this one ends. Raises ResultsInUse if another is in."""
        if self._claim is None and fcntl is not None:
            folder = os.open(self.path, os.O_RDONLY)
            claim = finalize(self, os.close, folder)
            lock(folder, self.path)
            self._claim = claim

    def release(self) -> None:
        """Let other processes in."""
        if self._claim is not None:
            self._claim()
            self._claim = None

    def discard(self) -> None:
        """Let other processes in, and remove the folders that were made for it, if nothing is in them."""
        self.release()
        with suppress(OSError):
            for folder in self._made:
                folder.rmdir()

    @classmethod
    def create(cls, path: str | Path, *, replace: bool = False) -> RunDirectory:
        """Claim the directory ``path``, made if need be; its files stay until a `FileRecorder` begins to write there.

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
            If the directory cannot be made.
        """
        directory = cls(path)
        directory.path.mkdir(parents=True, exist_ok=True)
        directory.claim()
        results = directory.results()
        if results and not replace:
            directory.release()
            raise ResultsExist(f"{directory.path} already holds results ({results[0].name})")
        return directory

    @classmethod
    def create_numbered(cls, path: str | Path) -> RunDirectory:
        """Make and claim a new directory: ``path``, or ``path-2``, ``path-3``, … when that exists.

        Runs started at the same time get different directories.
        """
        first = Path(path)
        for candidate in chain([first], (first.with_name(f"{first.name}-{number}") for number in count(2))):
            with suppress(FileExistsError):
                directory = cls(candidate)
                candidate.mkdir(parents=True)
                directory.claim()
                return directory
        raise AssertionError("unreachable")


def lock(file: BinaryIO | int, path: Path) -> None:
    """Hold the open ``file`` of this ``path`` until it is closed. Raises ResultsInUse if another process does."""
    if fcntl is None:
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise ResultsInUse(f"{path}: another process is writing to it") from None
    except OSError:  # a file system without locks
        return
