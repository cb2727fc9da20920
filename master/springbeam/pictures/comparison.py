"""Runs over each other: positions, velocities and contact forces of several runs in one picture."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import matplotlib.pyplot as plt

from ..results.trajectory import Trajectory
from .drawing import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION, decimated, present, readable_unit

_COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK)
#: Columns of a panel, its label and its SI unit; the first is drawn thick, the second thin and dashed.
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
    figure, axes = plt.subplots(
        len(panels), 1, sharex=True, squeeze=False, figsize=(9.0, 2.6 * len(panels)), layout="constrained"
    )
    for ax, (columns, label, si) in zip(axes.flat, panels, strict=True):
        unit = readable_unit([run[name] for run in runs.values() for name in present(run, columns)], si)
        for colour, (title, run) in zip(_COLOURS * len(runs), runs.items(), strict=False):
            for name in present(run, columns):
                rows = decimated(run.time, run[name])
                first = name == columns[0]
                ax.plot(
                    run.time[rows],
                    unit.factor * run[name][rows],
                    color=colour,
                    linewidth=1.4 if first else 0.8,
                    linestyle="-" if first else "--",
                    label=title if first or columns[0] not in run.columns else None,
                )
        ax.set_ylabel(f"{label} [{unit.name}]")
        ax.grid(alpha=0.3)
    axes.flat[0].legend(fontsize="small")
    axes.flat[-1].set_xlabel("time t [s]")
    figure.savefig(path, dpi=110)
    plt.close(figure)
