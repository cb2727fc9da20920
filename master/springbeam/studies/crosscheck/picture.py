"""Co-simulation and reference in one picture."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

from ...pictures.drawing import BLACK, BLUE, GREEN, GREY, ORANGE, POSITIONS, PURPLE, SKY, VERMILLION, readable_unit
from ...pictures.timeline import DPI, STYLE, Timeline, put_key
from ...results.trajectory import Trajectory


def draw(run: Trajectory, reference: Mapping[str, np.ndarray], record: Mapping[str, Any], path: Path) -> Path:
    """Draw to ``path`` co-simulation and reference, and every error of the ``record`` below its bound."""
    with matplotlib.rc_context(STYLE):
        timeline = Timeline.of(run, "Co-simulation and reference", [2.2, 3.0])
        clock = timeline.unit.factor
        above, below = timeline.axes
        names = [name for name in POSITIONS if name in reference]
        unit = readable_unit([run[name] for name in names], "m")
        for name, colour in zip(names, (BLUE, VERMILLION), strict=False):
            above.plot(
                clock * run["time"], unit.factor * run[name],
                color=colour, lw=2.5, alpha=0.5, label=f"{name}, co-simulation",
            )  # fmt: skip
            above.plot(
                clock * reference["time"], unit.factor * reference[name], color=BLACK, lw=0.7,
                label=f"{name}, reference",
            )  # fmt: skip
        above.set_ylabel(f"position [{unit.name}]")
        put_key(above)
        lowest, highest = [], []
        for row, colour in zip(
            record["quantities"], (BLUE, SKY, VERMILLION, ORANGE, GREEN, PURPLE, GREY), strict=False
        ):
            time, errors, bounds = (np.array(row[name]) for name in ("times", "errors", "bounds"))
            drawn = np.where(errors > 0.0, errors, np.nan)
            below.semilogy(clock * time, drawn, color=colour, lw=0.9, label=row["quantity"])
            below.semilogy(clock * time, bounds, color=colour, lw=0.9, ls=":")
            lowest.append(np.min(errors, where=errors > 0.0, initial=bounds.max()))
            highest.append(max(errors.max(), bounds.max()))
        below.set_ylim(max(min(lowest, default=1e-16), 1e-18), 10.0 * max(highest, default=1.0))
        below.axvline(clock * record["horizon"], color=BLACK, lw=0.8, ls="--")
        below.set_ylabel("error (lines), bound (dots)\n[unit of the quantity]")
        put_key(below)
        timeline.figure.savefig(path, dpi=DPI)
    return path
