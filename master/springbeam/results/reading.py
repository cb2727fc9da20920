"""Results read back from a run directory, also from one whose run was stopped or killed."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from math import inf
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from ..scene import scene_from_dict
from .directory import ResultsUnreadable, RunDirectory
from .recording import trajectory_of
from .steps import steps_of
from .trajectory import EVENT_COLUMNS, PHASES, SHAPE_COLUMNS, Event, Trajectory


def load_trajectory(directory: str | Path) -> Trajectory:
    """Read a run directory, also of a run that was stopped or killed: of that, the steps that it has written.

    Raises
    ------
    ResultsUnreadable
        If a file is missing, is not what a run writes, or not what this one has written.
    """
    run = RunDirectory(directory)
    refuse_cut(run, load_summary(run.path).get("files", {}))
    return read_run(run)


def refuse_cut(run: RunDirectory, written: Mapping[str, int], *, rows: bool = True, longer: bool = False) -> None:
    """Raise ResultsUnreadable if a file is not as long as it was ``written`` [bytes].

    ``rows`` says whether ``trajectory.csv`` counts, which the records can replace, ``longer`` whether files may have
    become longer.
    """
    found = run.sizes()
    for name, size in written.items():
        whole = found.get(name) == size or (longer and found.get(name, 0) > size)
        if not whole and (rows or name != run.trajectory.name):
            remedy = f"; springbeam export {run.path} writes it again" if name == run.trajectory.name else ""
            there = f"{found[name]} bytes" if name in found else "missing"
            raise ResultsUnreadable(f"{run.path / name}: {there}, {size} bytes were written{remedy}")


def read_run(run: RunDirectory) -> Trajectory:
    """Return what the files hold, whole or not. Raises ResultsUnreadable."""
    summary = load_summary(run.path)
    summary.pop("files", None)  # of the directory, not of the run
    scene = scene_from_dict(summary["scene"], source=f"{run.summary}: scene")
    try:
        steps = steps_of(run.steps.read_bytes()) if run.steps.exists() else steps_of(b"")
    except (OSError, ValueError) as error:
        raise ResultsUnreadable(f"{run.steps}: {error}") from error
    events = list(load_events(run.path))
    shapes = None
    if run.shapes.exists():
        shapes = _read_table(run.shapes, SHAPE_COLUMNS).view("f8").reshape(-1, len(SHAPE_COLUMNS))
    if len(steps) == 0 and run.trajectory.exists():  # it left no records: a reference
        table = _read_table(run.trajectory)
        columns = {name: np.ascontiguousarray(table[name]) for name in table.dtype.names or ()}
        return Trajectory(scene, columns, events, summary=summary, shape_table=shapes)
    # A run that was killed may have written what belongs to records that it has not.
    last, known = (steps["time"][-1], int(steps["events"][-1])) if len(steps) else (-inf, 0)
    if known > len(events):
        raise ResultsUnreadable(f"{run.events}: {len(events)} events, {known} belong to {run.steps.name}")
    if shapes is not None:
        shapes = shapes[shapes[:, 0] <= last]
    return trajectory_of(scene, steps, events[:known], shapes, summary)


def load_summary(directory: str | Path) -> dict[str, Any]:
    """Read ``summary.json`` of a run directory."""
    path = RunDirectory(directory).summary
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ResultsUnreadable(f"{path}: missing; {directory} is not a run directory") from None
    except OSError as error:
        raise ResultsUnreadable(f"{path}: {error.strerror}") from error
    except ValueError as error:
        raise ResultsUnreadable(f"{path}: not JSON: {error}") from error
    if not isinstance(summary, dict) or not isinstance(summary.get("scene"), dict):
        raise ResultsUnreadable(f"{path}: no scene in it")
    return summary


def load_events(directory: str | Path) -> Iterator[Event]:
    """Read the events of a run directory, one at a time."""
    path = RunDirectory(directory).events
    for number, line in enumerate(_complete_lines(path, EVENT_COLUMNS)[1:], start=2):
        try:
            fields = zip(EVENT_COLUMNS, line.split(","), strict=True)
            yield msgspec.convert({name: text for name, text in fields if text}, Event, strict=False)
        except ValueError as error:
            said = f"not an event: {line[:60]!r}: {error}"
            raise ResultsUnreadable(f"{path}: line {number}: {said}") from None


def _complete_lines(path: Path, columns: Sequence[str] = ()) -> list[str]:
    """Return the lines that end in a newline, at least the header, which must be ``columns`` if given.

    A byte that is no text makes its line unreadable, not the file.
    """
    try:
        lines = path.read_bytes().decode(errors="replace").split("\n")[:-1]
    except OSError as error:
        raise ResultsUnreadable(f"{path}: {error.strerror}") from error
    if not lines:
        raise ResultsUnreadable(f"{path}: empty")
    if columns and lines[0] != ",".join(columns):
        raise ResultsUnreadable(f"{path}: line 1: not the columns of {path.name}")
    return lines


def _read_table(path: Path, columns: Sequence[str] = ()) -> np.ndarray:
    """Return the rows of a file, shape (n,), as records of its columns."""
    header, *lines = _complete_lines(path, columns)
    if "time" not in (names := header.split(",")):
        raise ResultsUnreadable(f"{path}: line 1: no column time")
    kinds = np.dtype([(name, "U8" if name == "phase" else "f8") for name in names])
    try:
        table = np.loadtxt(lines, kinds, delimiter=",", comments=None, ndmin=1) if lines else np.empty(0, kinds)
    except ValueError as error:
        why, _, _ = str(error).partition(";")  # what follows is for who calls numpy
        raise ResultsUnreadable(f"{path}: after the header: {why}") from None
    for name in names:
        if name != "phase" and not np.isfinite(table[name]).all():
            raise ResultsUnreadable(f"{path}: {name} holds a number that is not finite")
    if "phase" in names and (unknown := set(table["phase"].tolist()).difference(PHASES)):
        raise ResultsUnreadable(f"{path}: {unknown.pop()!r} is no phase; phases are {', '.join(PHASES)}")
    return table
