"""The files of a run directory, each written and read here: records, tables as CSV, the summary as JSON.

``steps.bin`` (the records), ``events.csv`` and ``shapes.csv`` grow as a run goes, and can be read also when it was
killed. ``trajectory.csv`` and ``summary.json`` are replaced at once or not at all.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from math import inf
from pathlib import Path
from typing import Any, BinaryIO, Literal

import msgspec
import numpy as np
from pydantic_core import to_json

from ..motion.events import EVENT_COLUMNS, Event
from ..scene import scene_from_dict
from .columns import trajectory_of
from .directory import PARQUET, ResultsUnreadable, RunDirectory
from .document import as_json
from .records import STEP, steps_of
from .trajectory import PHASES, SHAPE_COLUMNS, Trajectory

# -- written -----------------------------------------------------------------------------------------------------------


def lines(rows: Iterable[Sequence[Any]]) -> bytes:
    """Return numbers and plain words as lines of CSV; JSON writes numbers as the shortest text that reads back."""
    text = to_json(list(rows))[2:-2].replace(b"],[", b"\n").replace(b'"', b"")
    return text + b"\n" if text else b""


def event_lines(events: Iterable[Event]) -> bytes:
    """Return ``events`` as lines of ``events.csv``; values of absent bodies are empty."""
    rows = ([getattr(event, name) for name in EVENT_COLUMNS] for event in events)
    return lines(["" if v is None else v if isinstance(v, str | bool) else float(v) for v in row] for row in rows)


def write_rows(run: RunDirectory, blocks: Iterable[Mapping[str, np.ndarray]]) -> None:
    """Replace ``trajectory.csv`` by columns, block after block. Raises OSError; the file is then as before."""
    with replaced(run.trajectory) as file:
        for number, columns in enumerate(blocks):
            if number == 0:
                file.write(lines([list(columns)]))
            file.write(lines(zip(*(values.tolist() for values in columns.values()), strict=True)))


def write_summary(run: RunDirectory, summary: Mapping[str, Any]) -> None:
    """Replace ``summary.json``. Raises OSError; the file is then as before."""
    with replaced(run.summary) as file:
        file.write(as_json(summary) + b"\n")


@contextmanager
def replaced(path: Path) -> Iterator[BinaryIO]:
    """Open a file that replaces ``path`` once it is written; if that fails, the old file stays."""
    part = path.with_name(f"{path.name}.part")
    try:
        with part.open("wb") as file:
            yield file
        os.replace(part, path)
    except BaseException:
        with suppress(OSError):
            part.unlink()
        raise


# -- read --------------------------------------------------------------------------------------------------------------


def load_trajectory(directory: str | Path) -> Trajectory:
    """Read a run directory, also of a run that was stopped or killed, with the steps that it has written.

    Raises
    ------
    ResultsUnreadable
        If a file is missing, was cut, or is not what a run writes.
    """
    run = RunDirectory(directory)
    refuse_cut(run, load_summary(run.path).get("files", {}))
    return read_run(run)


def refuse_cut(run: RunDirectory, written: Mapping[str, int]) -> None:
    """Raise ResultsUnreadable if a file is missing or shorter than it was ``written`` [bytes]."""
    found = run.sizes()
    for name, size in written.items():
        there = found.get(name, -1)
        if there < size:
            remedy = f"; springbeam export {run.path} writes it again" if name == run.trajectory.name else ""
            said = "missing" if there < 0 else f"{there} bytes"
            raise ResultsUnreadable(f"{run.path / name}: {said}, {size} bytes were written{remedy}")


def read_run(run: RunDirectory) -> Trajectory:
    """Return the content of the files, complete or not. Raises ResultsUnreadable."""
    summary = load_summary(run.path)
    summary.pop("files", None)  # of the directory, not of the run
    scene = scene_from_dict(summary["scene"], source=f"{run.summary}: scene")
    try:
        steps = steps_of(run.steps.read_bytes() if run.steps.exists() else b"")
    except (OSError, ValueError) as error:
        raise ResultsUnreadable(f"{run.steps}: {error}") from error
    events = load_events(run.path)
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
    """Read ``summary.json`` of a run directory. Raises ResultsUnreadable."""
    path = RunDirectory(directory).summary
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ResultsUnreadable(f"{path}: {error.strerror}; {directory} is not a run directory") from error
    except ValueError as error:
        raise ResultsUnreadable(f"{path}: not JSON: {error}") from error
    if not isinstance(summary, dict) or not isinstance(summary.get("scene"), dict):
        raise ResultsUnreadable(f"{path}: no scene in it")
    return summary


def load_events(directory: str | Path) -> list[Event]:
    """Read ``events.csv`` of a run directory. Raises ResultsUnreadable."""
    path = RunDirectory(directory).events
    events = []
    for number, line in enumerate(_complete_lines(path, EVENT_COLUMNS)[1:], start=2):
        try:
            fields = zip(EVENT_COLUMNS, line.split(","), strict=True)
            events.append(msgspec.convert({name: text for name, text in fields if text}, Event, strict=False))
        except ValueError as error:
            raise ResultsUnreadable(f"{path}: line {number}: not an event: {line[:60]!r}: {error}") from None
    return events


def _complete_lines(path: Path, columns: Sequence[str] = ()) -> list[str]:
    """Return the lines that end in a newline, at least the header, which must be ``columns`` if given.

    A byte that is no text makes its line unreadable, not the file.
    """
    try:
        found = path.read_bytes().decode(errors="replace").split("\n")[:-1]
    except OSError as error:
        raise ResultsUnreadable(f"{path}: {error.strerror}") from error
    if not found:
        raise ResultsUnreadable(f"{path}: empty")
    if columns and found[0] != ",".join(columns):
        raise ResultsUnreadable(f"{path}: line 1: not the columns of {path.name}")
    return found


def _read_table(path: Path, columns: Sequence[str] = ()) -> np.ndarray:
    """Return the rows of a file, shape (n,), as records of its columns."""
    header, *rows = _complete_lines(path, columns)
    if not header.startswith("time,"):
        raise ResultsUnreadable(f"{path}: line 1: no column time")
    kinds = np.dtype([(name, "U8" if name == "phase" else "f8") for name in header.split(",")])
    try:
        table = np.loadtxt(rows, kinds, delimiter=",", comments=None, ndmin=1) if rows else np.empty(0, kinds)
    except ValueError as error:
        why, _, _ = str(error).partition(";")  # the rest is for callers of numpy
        raise ResultsUnreadable(f"{path}: after the header: {why}") from None
    for name in kinds.names or ():
        good = np.isin(table[name], PHASES) if name == "phase" else np.isfinite(table[name])
        if not good.all():
            kind = f"no phase; phases are {', '.join(PHASES)}" if name == "phase" else "not finite"
            raise ResultsUnreadable(f"{path}: {name} = {table[name][~good][0]}: {kind}")
    return table


# -- written from what was read ----------------------------------------------------------------------------------------


def export(directory: str | Path, form: Literal["csv", "parquet"]) -> list[Path]:
    """Write the tables of a run anew and return their files: ``trajectory.csv``, or all tables as Parquet.

    The run may go on meanwhile, or have been killed.

    Raises
    ------
    ResultsUnreadable
        If the run left no records, or another file than ``trajectory.csv`` was cut.
    """
    run = RunDirectory(directory)
    summary = load_summary(run.path)
    written = summary.get("files", {})
    refuse_cut(run, {name: size for name, size in written.items() if name != run.trajectory.name})
    trajectory = read_run(run)
    if run.sizes().get(run.steps.name, 0) < STEP.itemsize:
        raise ResultsUnreadable(f"{run.steps}: no records in it: of a reference, or of a run that has made no step yet")
    if form == "csv":
        write_rows(run, [trajectory.columns])
        if written:
            write_summary(run, {**summary, "files": run.sizes()})
        return [run.trajectory]
    from pyarrow import Table, bool_, float64, parquet, schema, string, table  # it takes its time to load

    of_words = {"kind": string(), "joint": string(), "seated": bool_()}
    kinds = schema([(name, of_words.get(name, float64())) for name in EVENT_COLUMNS])
    tables = [table(trajectory.columns), Table.from_pylist([vars(event) for event in trajectory.events], kinds)]
    if trajectory.shape_table is not None:
        tables.append(table(dict(zip(SHAPE_COLUMNS, trajectory.shape_table.T, strict=True))))
    files = [run.path / name for name in PARQUET[: len(tables)]]
    for file, rows in zip(files, tables, strict=True):
        parquet.write_table(rows, file)
    return files
