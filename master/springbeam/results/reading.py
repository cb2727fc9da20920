"""Results read back from a run directory, also from one whose run was stopped or killed."""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import chain
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from ..scene import scene_from_dict
from .directory import ResultsUnreadable, RunDirectory
from .recording import trajectory_of
from .steps import steps_of
from .trajectory import EVENT_COLUMNS, PHASES, SHAPE_COLUMNS, Event, EventKind, Trajectory, shapes_of


def load_trajectory(directory: str | Path) -> Trajectory:
    """Read a run directory, also of a run that was stopped or killed: of that, the steps that it has written.

    Raises
    ------
    ResultsUnreadable
        If a file is missing, is not what a run writes, or not what this one has written.
    """
    run = RunDirectory(directory)
    refuse_cut(run, load_summary(run.path))
    return read_run(run)


def refuse_cut(run: RunDirectory, summary: dict[str, Any], *, rows: bool = True) -> None:
    """Raise ResultsUnreadable if a file is not as long as ``summary``, that of a run that has ended, says.

    ``rows`` says whether ``trajectory.csv`` counts, which the records can replace.
    """
    found = run.sizes()
    for name, size in summary.get("files", {}).items():
        if found.get(name) != size and (rows or name != run.trajectory.name):
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
        table = _read_table(run.shapes, SHAPE_COLUMNS)
        shapes = np.column_stack([table[name] for name in SHAPE_COLUMNS])
    if len(steps) == 0 and run.trajectory.exists():  # it left no records: a reference
        return Trajectory(scene, _read_table(run.trajectory), events, summary=summary, **shapes_of(shapes))
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
    _, lines = _complete_lines(path, EVENT_COLUMNS)
    for number, line in enumerate(lines, start=2):
        fields = line.rstrip("\n").split(",")
        try:
            given = {name: text for name, text in zip(EVENT_COLUMNS, fields, strict=True) if text}
            kind = EventKind(given.pop("kind"))
            yield Event(kind=kind, **{name: float(text) for name, text in given.items()})
        except (KeyError, TypeError, ValueError) as error:
            said = f"not an event: {line.strip()[:60]!r}: {error}"
            raise ResultsUnreadable(f"{path}: line {number}: {said}") from None


def _complete_lines(path: Path, columns: tuple[str, ...] | None = None) -> tuple[tuple[str, ...], Iterator[str]]:
    """Return the header, which must be ``columns`` if given, and the lines after it that end in a newline.

    A byte that is no text makes its line unreadable, not the file.
    """

    def lines() -> Iterator[str]:
        with path.open(encoding="utf-8", errors="replace", newline="\n") as file:
            yield from (line for line in file if line.endswith("\n"))

    try:
        everything = lines()
        header = next(everything, None)
    except OSError as error:
        raise ResultsUnreadable(f"{path}: {error.strerror}") from error
    if header is None:
        raise ResultsUnreadable(f"{path}: empty")
    found = tuple(header.rstrip("\n").split(","))
    if columns not in (None, found):
        raise ResultsUnreadable(f"{path}: line 1: not the columns of {path.name}")
    return found, everything


def _read_table(path: Path, columns: tuple[str, ...] | None = None) -> dict[str, np.ndarray]:
    header, lines = _complete_lines(path, columns)
    if "time" not in header:
        raise ResultsUnreadable(f"{path}: line 1: no column time")
    kinds = [(name, "U8" if name == "phase" else "f8") for name in header]
    first = next(lines, None)
    if first is None:
        table = np.empty(0, dtype=kinds)
    else:
        try:
            table = np.loadtxt(chain([first], lines), dtype=kinds, delimiter=",", comments=None, ndmin=1)
        except ValueError as error:
            why, _, _ = str(error).partition(";")  # what follows is for who calls numpy
            raise ResultsUnreadable(f"{path}: after the header: {why}") from None
    found = {name: np.ascontiguousarray(table[name]) for name in header}
    for name, values in found.items():
        if name == "phase":
            if unknown := set(values.tolist()).difference(PHASES):
                raise ResultsUnreadable(f"{path}: {unknown.pop()!r} is no phase; phases are {', '.join(PHASES)}")
        elif not np.isfinite(values).all():
            raise ResultsUnreadable(f"{path}: {name} holds a number that is not finite")
    return found
