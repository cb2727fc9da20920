"""Convert a trajectory into a table of pandas, a dataset of xarray, or HTML for a notebook."""

from __future__ import annotations

from html import escape
from importlib import import_module
from typing import TYPE_CHECKING, Any

from ..scene.statics import SHAPE_POINTS
from .totals import in_words
from .trajectory import Trajectory, units_of

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset


class MissingExtra(ImportError):
    """A package that is not installed is needed; the message names the extra that brings it."""


def _optional(package: str) -> Any:
    try:
        return import_module(package)
    except ImportError as error:
        raise MissingExtra(
            f"{package} cannot be imported ({error}); the extra 'data' brings it: pip install -e '.[data]' in the "
            "checkout of springbeam"
        ) from error


def to_pandas(run: Trajectory) -> DataFrame:
    """Return the columns as a DataFrame. Times of rows at an event repeat, so ``time`` is a column."""
    table: DataFrame = _optional("pandas").DataFrame(run.columns)
    table.attrs["title"] = run.scene.title
    table.attrs["units"] = {name: unit for name, unit in units_of(run.scene).items() if name in run.columns}
    return table


def to_xarray(run: Trajectory) -> Dataset:
    """Return the columns over ``time`` and the shapes over ``shape_time`` and ``x`` [m], with units."""
    units = units_of(run.scene)
    variables: dict[str, Any] = {
        name: ("time", values, {"units": units[name]} if name in units else {}) for name, values in run.columns.items()
    }
    time = variables.pop("time")
    coordinates = {"time": time}
    if run.shapes is not None and run.scene.beam is not None:
        variables["deflection"] = (("shape_time", "x"), run.shapes[1], {"units": "m"})
        coordinates["shape_time"] = ("shape_time", run.shapes[0], {"units": "s"})
        coordinates["x"] = ("x", SHAPE_POINTS * run.scene.beam.length, {"units": "m"})
    dataset: Dataset = _optional("xarray").Dataset(variables, coordinates, {"title": run.scene.title})
    return dataset


def as_html(run: Trajectory) -> str:
    """Return the totals of a run as an HTML table."""
    summary = run.summary
    rows = [
        ("rows, events", f"{len(run)}, {len(run.events)}"),
        ("status", str(summary.get("status", "no summary"))),
        *in_words(summary),
        *(("warning", str(warning)) for warning in summary.get("warnings", ())),
    ]
    body = "".join(f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>" for name, value in rows)
    return f"<table><caption>{escape(run.scene.title or 'a run')}</caption>{body}</table>"
