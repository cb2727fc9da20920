"""Runs over each other: positions, velocities and contact forces of several runs in one picture."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..results.trajectory import Trajectory
from .drawing import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION, Line, Look, decimated, present, readable_unit
from .timeline import line_style

_COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK)
#: How the first column of a panel is drawn, and the second.
_LINES = (Line(1.4), Line(0.8, dashed=True))
#: Fields of events that are drawn as stems, and the label of their panel.
_IMPULSES = {"impulse_contact": "impulses on the tip", "impulse_foundation": "impulses of the foundation"}
#: Columns of a panel, its label and its SI unit.
_PANELS = (
    (("u_tip", "y"), "tip, spring top (dashed)", "m"),
    (("v_tip", "z"), "velocities", "m/s"),
    (("contact_force",), "contact force", "N"),
    (("foundation_force",), "foundation force", "N"),
)


def draw(runs: Mapping[str, Trajectory], path: Path) -> None:
    """Draw runs by their names to ``path``: positions, and of the other panels those that any run has values for.

    What strikes leaves impulses, and no force: they have panels of their own.
    """
    panels = [
        (columns, label, unit)
        for columns, label, unit in _PANELS
        if unit == "m" or any(run[name].any() for run in runs.values() for name in present(run, columns))
    ]
    struck = [name for name in _IMPULSES if any(getattr(e, name) for run in runs.values() for e in run.events)]
    rows_of_panels = len(panels) + len(struck)
    figure = Figure(figsize=(9.0, 2.6 * rows_of_panels), layout="constrained")
    axes = figure.subplots(rows_of_panels, 1, sharex=True, squeeze=False)[:, 0]
    for ax, name in zip(axes[len(panels) :], struck, strict=True):
        _draw_impulses(ax, runs, name)
    for ax, (columns, label, si) in zip(axes[: len(panels)], panels, strict=True):
        unit = readable_unit([run[name] for run in runs.values() for name in present(run, columns)], si)
        for colour, (title, run) in zip(_COLOURS * len(runs), runs.items(), strict=False):
            shown = present(run, columns)
            for name in shown:
                rows = decimated(run.time, run[name])
                look = Look(colour, title, _LINES[columns.index(name)])
                words = title if name == shown[0] else None
                ax.plot(run.time[rows], unit.factor * run[name][rows], label=words, **line_style(look))
        ax.set_ylabel(f"{label} [{unit.name}]")
        ax.grid(alpha=0.3)
    axes[0].legend(fontsize="small")
    axes[-1].set_xlabel("time t [s]")
    figure.savefig(path, dpi=110)


def _draw_impulses(ax: Axes, runs: Mapping[str, Trajectory], name: str) -> None:
    """Draw the impulses of one kind, a stem each; those of later runs on narrower stems."""
    found = [[(e.time, getattr(e, name)) for e in run.events if getattr(e, name)] for run in runs.values()]
    unit = readable_unit([np.array([value for _, value in points]) for points in found if points], "N·s")
    for number, (colour, points) in enumerate(zip(_COLOURS * len(runs), found, strict=False)):
        if points:
            time, values = np.transpose(points)
            width = max(2.4 - 0.8 * number, 0.8)
            ax.vlines(time, 0.0, unit.factor * values, colors=colour, linewidth=width)
            ax.plot(time, unit.factor * values, "o", color=colour, markersize=2.0 + width)
    ax.set_ylabel(f"{_IMPULSES[name]} [{unit.name}]")
    ax.grid(alpha=0.3)
