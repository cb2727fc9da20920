"""Inner forces of the beam between the rows: a cubic through the values of both rows and the slopes there.

Rows alone miss the largest value by up to (ω H)²/8 of it. The slope at a row is that of the parabola through it and
both its neighbours, so that the error between rows is of order 4, (ω H)⁴/48; where a row has an event, slopes are those
of the parabolas on either side.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..motion.curves import Curve
from .spans import Extremes
from .trajectory import Trajectory

#: Columns that have such curves: those of `springbeam.results.trajectory.BODY_COLUMNS` that are no acceleration.
INNER = ("clamp_force", "clamp_moment", "bending_stress")
#: The one that is a magnitude.
MAGNITUDE = "bending_stress"


def curves_of(steps: np.ndarray, name: str) -> tuple[np.ndarray, Curve]:
    """Return the numbers of the records that end a step, shape (n,), and the curve of a column over each.

    Parameters
    ----------
    steps
        Consecutive records of dtype `springbeam.results.records.STEP`.
    name
        One of `INNER`.
    """
    made = np.flatnonzero(steps["size"][1:] > 0.0) + 1
    if not len(made):
        return made, Curve(np.zeros((4, 0)), np.zeros(0))
    size: Any = steps["size"][made]
    start = steps[name][made - 1]
    end = steps[name][made]
    rate = (end - start) / size
    # A step goes on smoothly where the one before ends without an event: at the row where it begins.
    smooth = (made[1:] == made[:-1] + 1) & (steps["events"][made[:-1]] == steps["events"][made[:-1] - 1])
    between = (rate[:-1] * size[1:] + rate[1:] * size[:-1]) / (size[1:] + size[:-1])
    first = rate.copy()
    last = rate.copy()
    first[1:][smooth] = between[smooth]
    last[:-1][smooth] = between[smooth]
    # At an end of a smooth stretch the parabola of its other end: the mean of both slopes is that of the step.
    begins = np.append(True, ~smooth)
    ends = np.append(~smooth, True)
    only = begins & ~ends
    first[only] = 2.0 * rate[only] - last[only]
    only = ends & ~begins
    last[only] = 2.0 * rate[only] - first[only]
    return made, Curve.cubic((start, first), (end, last), size)


def largest(run: Trajectory, name: str) -> Extremes:
    """Return the extremes of a column of a body in ``run``, on its curve where it has one.

    The first row is left out where it contradicts the clamp (`Trajectory.without_start`).
    """
    later = run.without_start()
    extremes = Extremes.of_rows(later.time, later[name])
    if name not in INNER or run.steps is None:
        return extremes
    steps = run.steps[-len(later) :]
    made, curve = curves_of(steps, name)
    if len(made):
        extremes = extremes.along(curve, steps["time"][made - 1])
    return extremes._replace(lowest=max(extremes.lowest, 0.0)) if name == MAGNITUDE else extremes
