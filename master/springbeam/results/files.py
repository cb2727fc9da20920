"""The files of a run directory, each written and read here: three arrays, the summary as JSON, and tables made of them.

The arrays grow as a run goes, and can be read also when it was killed. The others are replaced at once or not at all.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from math import inf
from pathlib import Path
from typing import Any, BinaryIO, Literal

import numpy as np
from pydantic_core import to_json

from ..motion.events import Event
from ..scene import scene_from_dict
from .columns import trajectory_of
from .contacts import contacts_as_array, contacts_of
from .directory import PARQUET, TABLES, ResultsUnreadable, RunDirectory
from .document import as_json
from .records import EVENT, SHAPE, STEP, array_of, events_as_array, events_of
from .trajectory import SHAPE_COLUMNS, Trajectory

#: Records that are written together, to bound the memory for a long run.
_TOGETHER = 4096

# -- written -----------------------------------------------------------------------------------------------------------


def lines(rows: Iterable[Sequence[Any]]) -> bytes:
    """Return numbers and plain words as lines of CSV, NaN left empty.

    JSON writes numbers as the shortest text that reads back.
    """
    text = to_json(list(rows), inf_nan_mode="null")[2:-2].replace(b"],[", b"\n")
    return text.replace(b'"', b"").replace(b"null", b"") + b"\n" if text else b""


def tables_of(run: Trajectory) -> list[np.ndarray]:
    """Return the tables of a run beside its rows: its events, its contacts and, with a beam, its shapes."""
    tables = [events_as_array(run.events), contacts_as_array(contacts_of(run))]
    if run.shape_table is not None:
        tables.append(np.ascontiguousarray(run.shape_table).view(SHAPE)[:, 0])
    return tables


def write_tables(run: RunDirectory, tables: Iterable[Iterable[Mapping[str, np.ndarray]]]) -> list[Path]:
    """Write rows, events, contacts and shapes of a run as CSV, each in blocks of columns, and return their files.

    Raises OSError; a table that was there is then as before.
    """
    files = []
    for name, blocks in zip(TABLES, tables, strict=False):
        files.append(run.path / name)
        with replaced(files[-1]) as file:
            for number, columns in enumerate(blocks):
                if number == 0:
                    file.write(lines([[*columns]]))
                file.write(lines(zip(*(values.tolist() for values in columns.values()), strict=True)))
    return files


def mapped(path: Path, kind: np.dtype) -> np.ndarray:
    """Return the whole records of a file of this run, without reading them."""
    whole = path.stat().st_size // kind.itemsize if path.exists() else 0
    return np.memmap(path, kind, mode="r", shape=whole) if whole else np.empty(0, kind)


def chunks(records: np.ndarray) -> Iterator[dict[str, np.ndarray]]:
    """Yield records by column, some thousand at a time."""
    for some in np.array_split(records, len(records) // _TOGETHER + 1):
        yield {name: some[name] for name in records.dtype.names or ()}


def write_summary(run: RunDirectory, summary: Mapping[str, Any]) -> None:
    """Replace ``summary.json``. Raises OSError; the file is then as before."""
    with replaced(run.summary) as file:
        file.write(as_json(summary) + b"\n")


def write_columns(run: RunDirectory, columns: Mapping[str, np.ndarray]) -> None:
    """Write the columns of a run that has no records. Raises OSError."""
    with replaced(run.rows) as file:
        arrays: Any = dict(columns)
        np.savez(file, **arrays)


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
    sizes = run.sizes()
    for name, size in load_summary(run.path).get("files", {}).items():
        there = sizes.get(name, -1)
        if there < size:
            present = "missing" if there < 0 else f"{there} bytes"
            raise ResultsUnreadable(f"{run.path / name}: {present}, {size} bytes were written")
    return read_run(run)


def read_run(run: RunDirectory) -> Trajectory:
    """Return the content of the files, complete or not. Raises ResultsUnreadable."""
    summary = load_summary(run.path)
    summary.pop("files", None)  # of the directory, not of the run
    scene = scene_from_dict(summary["scene"], source=f"{run.summary}: scene")
    steps = _array(run.steps, STEP)
    rows = _array(run.events, EVENT)
    table = _array(run.shapes, SHAPE)
    shapes = table.view("f8").reshape(-1, len(SHAPE_COLUMNS)) if run.shapes.exists() else None
    if run.rows.exists():
        with np.load(run.rows) as columns:
            return Trajectory(scene, dict(columns), _events(run, rows), shapes, summary)
    # A run that was killed may have written what belongs to records that it has not.
    last, known = (steps["time"][-1], int(steps["events"][-1])) if len(steps) else (-inf, 0)
    if known > len(rows):
        raise ResultsUnreadable(f"{run.events}: {len(rows)} events, {known} belong to {run.steps.name}")
    if shapes is not None:
        shapes = shapes[shapes[:, 0] <= last]
    return trajectory_of(scene, steps, _events(run, rows[:known]), shapes, summary)


def _array(path: Path, kind: np.dtype) -> np.ndarray:
    try:
        return array_of(path.read_bytes() if path.exists() else b"", kind)
    except (OSError, ValueError) as error:
        raise ResultsUnreadable(f"{path}: {error}") from error


def load_events(directory: str | Path) -> list[Event]:
    """Read the events of a run directory. Raises ResultsUnreadable."""
    run = RunDirectory(directory)
    return _events(run, _array(run.events, EVENT))


def _events(run: RunDirectory, rows: np.ndarray) -> list[Event]:
    try:
        return events_of(rows)
    except ValueError as error:
        raise ResultsUnreadable(f"{run.events}: {error}") from error


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


# -- exported ----------------------------------------------------------------------------------------------------------


def export(directory: str | Path, form: Literal["csv", "parquet"]) -> list[Path]:
    """Write the tables of a run anew, as CSV or Parquet, and return their files.

    The run may go on meanwhile, or have been killed.

    Raises
    ------
    ResultsUnreadable
        If the run has made no step yet, or a file was cut.
    """
    run = RunDirectory(directory)
    trajectory = load_trajectory(directory)
    if len(trajectory) == 0:
        raise ResultsUnreadable(f"{run.steps}: no records in it: the run has made no step yet")
    if form == "csv":
        return write_tables(run, [[trajectory.columns], *map(chunks, tables_of(trajectory))])
    from pyarrow import array, parquet, table  # it takes its time to load

    tables = [trajectory.columns, *({name: t[name] for name in t.dtype.names or ()} for t in tables_of(trajectory))]
    files = [run.path / name for name in PARQUET[: len(tables)]]
    for file, columns in zip(files, tables, strict=True):
        parquet.write_table(table({name: array(values, from_pandas=True) for name, values in columns.items()}), file)
    return files
