"""Co-simulation and reference in one picture."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

from ..pictures import drawing
from ..pictures.drawing import BLACK, POSITIONS, Line, Look
from ..pictures.panels import Curve, Panel
from ..pictures.timeline import DPI, STYLE, timeline
from ..results.trajectory import Trajectory

_COLOURS = (
    *(drawing.BLUE, drawing.SKY, drawing.VERMILLION, drawing.ORANGE, drawing.GREEN, drawing.PURPLE, drawing.GREY),
)


def draw(run: Trajectory, reference: Mapping[str, np.ndarray], record: Mapping[str, Any], path: Path) -> Path:
    """Draw to ``path`` co-simulation and reference, and every error of the ``record`` below its bound."""
    with matplotlib.rc_context(STYLE):
        figure = timeline(run, "Co-simulation and reference", [_positions(run, reference), _errors(record)])
        horizon = drawing.time_unit(run).factor * record["horizon"]
        figure.axes[1].axvline(horizon, color=BLACK, lw=0.8, ls="--")
        figure.savefig(path, dpi=DPI)
    return path


def _positions(run: Trajectory, reference: Mapping[str, np.ndarray]) -> Panel:
    names = [name for name in POSITIONS if name in reference]
    curves = []
    for name in names:
        ours = Look(POSITIONS[name].colour, f"{name}, co-simulation", Line(2.5, opacity=0.5))
        theirs = Look(BLACK, f"{name}, reference", Line(0.7))
        curves.append(Curve(name, ours, run["time"], run[name]))
        curves.append(Curve(name, theirs, reference["time"], reference[name]))
    return Panel("positions", "Positions", "position", "m", curves, 2.2)


def _errors(record: Mapping[str, Any]) -> Panel:
    curves, lowest, highest = [], [], []
    for row, colour in zip(record["quantities"], _COLOURS, strict=False):
        name = row["quantity"]
        time, errors, bounds = (np.array(row[part]) for part in ("times", "errors", "bounds"))
        drawn = np.where(errors > 0.0, errors, np.nan)
        curves.append(Curve(name, Look(colour, name, Line(0.9)), time, drawn))
        curves.append(Curve(name, Look(colour, "", Line(0.9, dashed=True)), time, bounds))
        lowest.append(np.min(errors, where=errors > 0.0, initial=bounds.max()))
        highest.append(max(errors.max(), bounds.max()))
    limits = max(min(lowest, default=1e-16), 1e-18), 10.0 * max(highest, default=1.0)
    quantity = "error (lines), bound (dashed)\n"
    return Panel("errors", "Errors", quantity, "unit of the quantity", curves, 3.0, logarithmic=limits)
