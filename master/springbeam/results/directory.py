"""A run directory: its files, the lock on it, and the errors of one that cannot be read.

It holds ``trajectory.csv`` (a row per accepted step), ``events.csv``, ``shapes.csv`` (the beam's deflection at
`SHAPE_POINTS`), ``steps.bin`` (what lies between rows), ``summary.json`` and pictures. ``file_recorder`` writes it,
``reading`` reads it.
"""

from __future__ import annotations

import tempfile
from contextlib import suppress
from itertools import count
from pathlib import Path
from typing import BinaryIO

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


class ResultsExist(FileExistsError):
    """The directory already holds results, which are never overwritten unasked."""


class ResultsInUse(RuntimeError):
    """Another process is writing results into the directory."""


class ResultsUnreadable(ValueError):
    """A run directory cannot be read; the message names the file and, where known, the line."""


class RunDirectory:
    """The files of one run in the directory ``path``, whether they exist or not."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.trajectory = self.path / "trajectory.csv"
        self.events = self.path / "events.csv"
        self.shapes = self.path / "shapes.csv"
        self.steps = self.path / "steps.bin"  #: what `springbeam.results.steps` says of each step, as doubles
        self.summary = self.path / "summary.json"
        #: It exists until the run is done (`springbeam.run.checkpoint`).
        self.checkpoint = self.path / "run.checkpoint"

    def results(self) -> list[Path]:
        """Return the result files that exist, and the files made from them."""
        files = (self.summary, self.trajectory, self.events, self.shapes, self.steps, self.checkpoint)
        made = (self.path / name for name in (*PICTURES, REPORT, *ANIMATIONS))
        return [file for file in (*files, *made) if file.exists()]

    def discard(self) -> None:
        """Remove the directory if nothing is in it."""
        with suppress(OSError):
            self.path.rmdir()

    @classmethod
    def create(cls, path: str | Path, *, replace: bool = False) -> RunDirectory:
        """Return the directory ``path``, made if need be; its files stay until a `FileRecorder` begins to write there.

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
        directory = cls(path)
        directory.path.mkdir(parents=True, exist_ok=True)
        results = directory.results()
        if results and not replace:
            raise ResultsExist(f"{directory.path} already holds results ({results[0].name})")
        if directory.trajectory.exists():
            with directory.trajectory.open("rb") as file:
                lock(file)
        try:
            tempfile.TemporaryFile(dir=directory.path).close()
        except OSError as error:
            directory.discard()
            raise OSError(error.errno, error.strerror, str(directory.path)) from error
        return directory

    @classmethod
    def create_numbered(cls, path: str | Path) -> RunDirectory:
        """Make a new directory: ``path``, or ``path-2``, ``path-3``, … when that exists.

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


def lock(file: BinaryIO) -> None:
    """Hold ``file`` until it is closed or the process ends. Raises ResultsInUse if another process does."""
    if fcntl is None:
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise ResultsInUse(f"{file.name}: another process is writing to it") from None
    except OSError:  # a file system without locks
        return
