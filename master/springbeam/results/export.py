"""Tables of a run written from its records, whatever its other files hold."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from .directory import PARQUET, ResultsUnreadable, RunDirectory
from .file_recorder import write_rows, write_summary
from .reading import load_summary, read_run, refuse_cut
from .steps import STEP_COLUMNS
from .trajectory import EVENT_COLUMNS, SHAPE_COLUMNS


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
    refuse_cut(run, summary.get("files", {}), rows=False)
    trajectory = read_run(run)
    if not run.steps.exists() or run.steps.stat().st_size < 8 * len(STEP_COLUMNS):
        raise ResultsUnreadable(f"{run.steps}: no records in it: of a reference, or of a run that has made no step yet")
    if form == "csv":
        write_rows(run, [trajectory.columns])
        if "files" in summary:
            write_summary(run, {**summary, "files": run.sizes()})
        return [run.trajectory]
    from pyarrow import Table, float64, parquet, schema, string, table  # it takes its time to load

    kinds = schema([(name, string() if name == "kind" else float64()) for name in EVENT_COLUMNS])
    events = Table.from_pylist([vars(event) for event in trajectory.events], kinds)
    tables = {PARQUET[0]: table(trajectory.columns), PARQUET[1]: events}
    if trajectory.shape_table is not None:
        tables[PARQUET[2]] = table(dict(zip(SHAPE_COLUMNS, trajectory.shape_table.T, strict=True)))
    for name, rows in tables.items():
        parquet.write_table(rows, run.path / name)
    return [run.path / name for name in tables]
