"""Tables of a run written from its records, whatever its other files hold."""

from __future__ import annotations

from importlib import import_module
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
    ImportError
        If pandas or pyarrow is missing.
    """
    run = RunDirectory(directory)
    summary = load_summary(run.path)
    refuse_cut(run, summary, rows=False)
    trajectory = read_run(run)
    if not run.steps.exists() or run.steps.stat().st_size < 8 * len(STEP_COLUMNS):
        raise ResultsUnreadable(f"{run.steps}: no records in it: of a reference, or of a run that has made no step yet")
    if form == "csv":
        write_rows(run, [trajectory.columns])
        if "files" in summary:
            write_summary(run, {**summary, "files": run.sizes()})
        return [run.trajectory]
    pandas = import_module("pandas")
    events = pandas.DataFrame([vars(event) for event in trajectory.events], columns=EVENT_COLUMNS)
    tables = {PARQUET[0]: pandas.DataFrame(trajectory.columns), PARQUET[1]: events}
    if trajectory.shapes is not None:
        tables[PARQUET[2]] = pandas.DataFrame(trajectory.shape_table(), columns=SHAPE_COLUMNS)
    for name, table in tables.items():
        table.to_parquet(run.path / name, engine="pyarrow", index=False)
    return [run.path / name for name in tables]
