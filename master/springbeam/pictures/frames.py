"""The run as a sequence of frames: where beam and spring are, and how the spring is drawn. For report and animation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..results.trajectory import Trajectory
from ..scene.statics import SHAPE_POINTS
from .drawing import near_levels

#: More frames than this are thinned.
MOST_FRAMES = 600
_TURNS = 6
#: Room around what moves, and height of a coil that nothing carries, as parts of the range of motion.
_ROOM, _COIL = 0.08, 0.4
#: A coil of unit height and half-width, from its foot up; only the heights follow the spring.
COIL_ACROSS = np.array([0.0, 0.0, *(-1.0, 1.0) * _TURNS, 0.0, 0.0])
#: Half-widths of coil and stop, as parts of the beam's length.
COIL_WIDTH, STOP_WIDTH = 0.035, 0.08
COIL_HEIGHTS = np.array([0.0, 0.12, *np.linspace(0.12, 0.92, 2 * _TURNS + 2)[1:-1], 0.92, 1.0])


@dataclass(frozen=True)
class Frames:
    """Frames at ``time`` [s], shape (n,): recorded values, without interpolation.

    ``deflection`` [m], shape (n, 21), and ``y`` [m], shape (n,), are ``None`` for a body that is not there. ``row`` is
    each frame's row of the trajectory. ``low`` and ``high`` [m] hold all of it with room around, and the heights of
    ``levels`` that are near; ``foot`` [m] is where the coil stands, below the stop.
    """

    time: np.ndarray
    row: np.ndarray
    deflection: np.ndarray | None
    y: np.ndarray | None
    levels: dict[str, float]
    low: float
    high: float
    foot: float

    def at(self, time: float) -> int:
        """Return the last frame not after ``time`` [s]; the first, before it."""
        return max(0, int(np.searchsorted(self.time, time, side="right")) - 1)

    def coil(self, frame: int) -> np.ndarray:
        """Return the heights [m] of the coil's corners."""
        assert self.y is not None
        return self.foot + float(self.y[frame] - self.foot) * COIL_HEIGHTS


def frames_of(trajectory: Trajectory) -> Frames | None:
    """Return the frames of a run; ``None`` if it has fewer than two."""
    rows = trajectory["time"]
    deflection: np.ndarray | None
    if trajectory.shapes is not None:
        time, deflection = trajectory.shapes
        # A killed run may have a shape more than it has rows.
        known = time <= rows[-1] if len(rows) else np.zeros(len(time), dtype=bool)
        time, deflection = time[known], deflection[known]
    elif trajectory.scene.beam is None:
        # A body that is not our beam is a level bar at the height of its end.
        ends = trajectory["u_tip"] if "u_tip" in trajectory.columns else None
        time, deflection = rows, None if ends is None else np.repeat(ends[:, None], len(SHAPE_POINTS), axis=1)
    else:
        return None
    if len(time) < 2 or time[-1] <= time[0]:
        return None
    some = _thinned(time)
    time, deflection = time[some], None if deflection is None else deflection[some]
    row = np.searchsorted(rows, time, side="right") - 1
    y = trajectory["y"][row] if "y" in trajectory.columns else None
    moving = [part for part in (deflection, y) if part is not None]
    near = near_levels(trajectory.scene, moving)
    heights = np.concatenate([*(part.ravel() for part in moving), list(near.values())])
    low, high = float(np.min(heights)), float(np.max(heights))
    span = high - low or 1.0
    foot = low - _COIL * span if y is not None else low - 2.0 * _ROOM * span
    return Frames(time, row, deflection, y, near, foot, high + _ROOM * span, foot)


def _thinned(time: np.ndarray) -> np.ndarray:
    """Return the indices of at most `MOST_FRAMES`: pairs at evenly spaced times, since every second one of frames that
    alternate would hide it."""
    if len(time) <= MOST_FRAMES:
        return np.arange(len(time))
    first = np.searchsorted(time, np.linspace(time[0], time[-1], MOST_FRAMES // 2))
    return np.unique(np.append(first, first + 1).clip(max=len(time) - 1))
