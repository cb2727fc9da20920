"""Co-simulation and reference in one picture."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np

from ...pictures.drawing import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    POSITIONS,
    PURPLE,
    SKY,
    VERMILLION,
    present,
    readable_unit,
)
from ...pictures.timeline import DPI, STYLE, Timeline, put_key
from . import Report


def draw(report: Report, path: Path) -> None:
    """Draw co-simulation and reference, and every error below its bound."""
    trajectory, reference = report.trajectory, report.reference
    with matplotlib.rc_context(STYLE):
        timeline = Timeline.of(trajectory, "Co-simulation and reference", [2.2, 3.0])
        above, below = timeline.axes
        names = present(trajectory, POSITIONS)
        unit = readable_unit([trajectory[name] for name in names], "m")
        for name, colour in zip(names, (BLUE, VERMILLION), strict=False):
            above.plot(
                timeline.unit.factor * trajectory["time"], unit.factor * trajectory[name],
                color=colour, lw=2.5, alpha=0.5, label=f"{name}, co-simulation",
            )  # fmt: skip
            above.plot(
                timeline.unit.factor * reference["time"], unit.factor * reference[name], color=BLACK, lw=0.7,
                label=f"{name}, reference",
            )  # fmt: skip
        above.set_ylabel(f"position [{unit.name}]")
        put_key(above)
        colours = (BLUE, SKY, VERMILLION, ORANGE, GREEN, PURPLE, GREY)
        for row, colour in zip(report.rows, colours, strict=False):
            time = timeline.unit.factor * row.times
            below.semilogy(
                time, np.where(row.errors > 0.0, row.errors, np.nan), color=colour, lw=0.9, label=row.quantity
            )
            below.semilogy(time, row.bounds, color=colour, lw=0.9, ls=":")
        low = min((float(r.errors[r.errors > 0.0].min()) for r in report.rows if (r.errors > 0.0).any()), default=1e-16)
        high = max((float(max(r.errors.max(), r.bounds.max())) for r in report.rows), default=1.0)
        below.set_ylim(max(low, 1e-18), 10.0 * high)
        below.axvline(timeline.unit.factor * report.horizon, color=BLACK, lw=0.8, ls="--")
        below.set_ylabel("error (lines), bound (dots)\n[unit of the quantity]")
        put_key(below)
        timeline.figure.savefig(path, dpi=DPI)
