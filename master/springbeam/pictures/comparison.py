"""Runs over each other: positions, velocities, contact forces and impulses of several runs in one picture."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import matplotlib
from matplotlib.figure import Figure

from ..results.trajectory import Trajectory
from .drawing import Unit
from .panels import compared
from .timeline import DPI, STYLE, WIDTH, paint


def draw(runs: Mapping[str, Trajectory], path: Path) -> None:
    """Draw runs by their names to ``path``, in the panels that any of them has something to show for."""
    panels = compared(runs)
    heights = [panel.height for panel in panels]
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH, 0.6 + sum(heights)), layout="constrained")
        axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
        for ax, panel in zip(axes, panels, strict=True):
            paint(ax, panel, Unit(1.0, "s"))
            ax.label_outer()
        figure.savefig(path, dpi=DPI)
