"""Functions for Python programs: ``springbeam.simulate`` and the others.

A `Trajectory` is data; what is computed from it by other modules is attached here.
"""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from .results import recording, totals
from .results.contacts import contacts_of
from .results.files import load_trajectory as load
from .results.trajectory import Trajectory
from .run.companion import Check, check
from .run.outcome import RunStopped
from .run.runner import Simulation
from .run.simulate import simulate

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["Check", "RunStopped", "Simulation", "Trajectory", "check", "load", "simulate"]


def _plot(run: Trajectory, picture: str = "positions", ax: Axes | None = None) -> Figure:
    """Return a matplotlib Figure: ``shapes_after_contact``, ``shapes_later``, ``positions``,
    ``velocities_and_forces``, ``gap_and_energy``, ``loads_and_clamp`` or ``moments``.

    In ``ax``, if given, the first panel of a picture over time is drawn.

    Raises ValueError for another name, and if the run has no data for it.
    """
    from .pictures.plots import figure_of  # takes a second to load: only for pictures

    return figure_of(run, picture, ax)


def _save(run: Trajectory, directory: str | Path, *, replace: bool = False) -> Path:
    """Write the files of a run directory, as `springbeam run` does, and return its path.

    Raises ResultsExist if there are results and ``replace`` is false, OSError if it cannot be written to.
    """
    return recording.save(run, directory, replace=replace)


def _html(run: Trajectory) -> str:
    """Return the totals of the run as an HTML table, for notebooks."""
    summary = run.summary
    rows = [
        ("rows, events", f"{len(run)}, {len(run.events)}"),
        ("status", str(summary.get("status", "no summary"))),
        *((words, f"{value} {error}".rstrip()) for words, value, error in totals.in_words(summary)),
        *(("warning", str(warning)) for warning in summary.get("warnings", ())),
    ]
    body = "".join(f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>" for name, value in rows)
    return f"<table><caption>{escape(run.scene.title or 'a run')}</caption>{body}</table>"


for _name, _method in {"plot": _plot, "save": _save, "_repr_html_": _html, "contacts": property(contacts_of)}.items():
    setattr(Trajectory, _name, _method)
