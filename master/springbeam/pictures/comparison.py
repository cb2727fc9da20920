"""Runs over each other: positions, velocities and contact forces of several runs in one picture."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from matplotlib.figure import Figure

from ..results.trajectory import Trajectory
from .drawing import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION, Line, Look, decimated, present, readable_unit
from .timeline import line_style

_COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK)
#: How the first column of a panel is drawn, and the second.
_LINES = (Line(1.4), Line(0.8, dashed=True))
#: Columns of a panel, its label and its SI unit.
_PANELS = (
    (("u_tip", "y"), "tip, spring top (dashed)", "m"),
    (("v_tip", "z"), "velocities", "m/s"),
    (("contact_force",), "contact force", "N"),
    (("foundation_force",), "foundation force", "N"),
)


def draw(runs: Mapping[str, Trajectory], path: Path) -> None:
    """Draw runs by their names to ``path``: positions, and of the other panels those that any run has values for."""
    panels = [
        (columns, label, unit)
        for columns, label, unit in _PANELS
        if unit == "m" or any(run[name].any() for run in runs.values() for name in present(run, columns))
    ]
    figure = Figure(figsize=(9.0, 2.6 * len(panels)), layout="constrained")
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    for ax, (columns, label, si) in zip(axes, panels, strict=True):
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
