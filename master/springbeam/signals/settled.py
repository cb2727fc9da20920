"""Whether a driven motion has settled, since when, and with which period: its points once a period of the drive."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..results.dense import rows_at
from ..results.trajectory import Trajectory
from ..scene import Load

#: A motion has settled where its points repeat themselves within this share of the range of the motion …
_ALIKE = 0.01
#: … for so many periods of the motion, each of at most so many periods of the drive.
_PERIODS, _LONGEST = 8, 8


class Settled(NamedTuple):
    """The settled part of a driven run."""

    since: float  #: [s]
    drive: float  #: period of the drive [s]
    multiple: int  #: periods of the drive in a period of the motion

    @property
    def period(self) -> float:
        """Period of the motion [s]."""
        return self.multiple * self.drive

    def amplitude(self, run: Trajectory, column: str) -> float:
        """Return half the range of a column over the last 8 periods, where the transient has faded further."""
        return 0.5 * float(np.ptp(run[column][run.time >= run.time[-1] - _PERIODS * self.period]))


def drive_of(run: Trajectory) -> Load | None:
    """Return the first harmonic load, ``None`` if there is none."""
    return next((load for load in run.scene.loads if load.signal == "harmonic"), None)


def poincare(run: Trajectory, period: float, start: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return the motion once a ``period`` [s], from ``start`` [s] on: times (n,), and position and velocity (n, 2).

    The point is the tip, or the spring's top where there is no beam.
    """
    names = ("u_tip", "v_tip") if "u_tip" in run.columns else ("y", "z")
    first = np.ceil((run.time[0] - start) / period - 1e-9)
    last = np.floor((run.time[-1] - start) / period + 1e-9)
    times = start + period * np.arange(first, last + 1.0)
    found = rows_at(run, np.clip(times, run.time[0], run.time[-1]))
    return times, np.column_stack([found[name] for name in names])


def settled(run: Trajectory) -> Settled | None:
    """Return the settled part of a driven run, ``None`` if it is not driven, or has not settled.

    It has settled where its points once a period of the drive lie within 1 % of the range of position and velocity
    of its last ones, in turn, for 8 periods of the motion at least. Those of a chaotic motion never do.
    """
    drive = drive_of(run)
    if drive is None or drive.frequency is None or run.steps is None:
        return None
    period = 1.0 / drive.frequency
    times, points = poincare(run, period, drive.start)
    names = ("u_tip", "v_tip") if "u_tip" in run.columns else ("y", "z")
    late = run.time >= 0.5 * (run.time[0] + run.time[-1])
    scale = np.array([float(np.ptp(run[name][late])) for name in names])
    if len(times) <= _PERIODS or not (scale > 0.0).all():
        return None
    for multiple in range(1, _LONGEST + 1):
        last = points[len(points) - multiple :]
        turns = (np.arange(len(points)) - len(points)) % multiple
        off = (np.abs(points - last[turns]) > _ALIKE * scale).any(axis=1)
        since = int(np.flatnonzero(off)[-1]) + 1 if off.any() else 0
        if len(times) - 1 - since >= _PERIODS * multiple:
            return Settled(float(times[since]), period, multiple)
    return None
