"""The run as a sequence of frames, and the sketches of beam and spring that move with it. For report and animation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from ..results.trajectory import Trajectory
from ..scene.statics import SHAPE_POINTS
from .drawing import (
    BLUE,
    GREY,
    LEVELS,
    POSITIONS,
    STONE,
    VERMILLION,
    Line,
    Look,
    Unit,
    length_along,
    near_levels,
    present,
    readable_unit,
)

Part = Literal["beam", "coil", "top"]

#: More frames than this are thinned.
MOST_FRAMES = 600
_TURNS = 6
#: Room around the motion, and height of an unloaded coil, as parts of the range of motion.
_ROOM = 0.08
_COIL = 0.4
#: A coil of unit height and half-width, from its foot up; only the heights follow the spring.
_COIL_ACROSS = np.array([0.0, 0.0, *(-1.0, 1.0) * _TURNS, 0.0, 0.0])
#: Half-widths of coil and stop, as parts of the beam's length.
_COIL_WIDTH = 0.035
_STOP_WIDTH = 0.08
#: The contact is drawn once more where its heights are a smaller part than this of the whole picture's, with as much
#: room around; from so far along the beam.
_SMALL = 0.2
_ROOM_AROUND = 0.3
_NEAR_TIP = 0.8
COIL_HEIGHTS = np.array([0.0, 0.12, *np.linspace(0.12, 0.92, 2 * _TURNS + 2)[1:-1], 0.92, 1.0])


@dataclass(frozen=True)
class Frames:
    """Frames at ``time`` [s], shape (n,): recorded values, without interpolation.

    ``deflection`` [m], shape (n, 21), and ``y`` [m], shape (n,), are ``None`` for an absent body. ``row`` is each
    frame's row of the trajectory. ``low`` and ``high`` [m] enclose the motion and ``levels`` near it, with room around;
    ``foot`` [m] is the lower end of the coil, below the stop.
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

    def heights(self, part: Part, frame: int) -> np.ndarray:
        """Return the heights [m] of the corners of a part."""
        if part == "beam" and self.deflection is not None:
            return self.deflection[frame]
        assert self.y is not None
        return np.full(2, self.y[frame]) if part == "top" else self.foot + (self.y[frame] - self.foot) * COIL_HEIGHTS


class Stroke(NamedTuple):
    """A line of a sketch, in its units; one without heights moves up and down with a part."""

    look: Look
    x: np.ndarray
    y: np.ndarray | None = None
    part: Part | None = None
    label: str = ""  #: at its right end


@dataclass
class Sketch:
    """Beam and spring as a picture shows them; heights in ``unit``, positions along the beam in ``along``."""

    name: str
    heading: str
    unit: Unit
    along: Unit
    x: tuple[float, float]
    y: tuple[float, float]
    strokes: list[Stroke]  #: what moves first

    @property
    def moving(self) -> list[Part]:
        """The parts that move."""
        return [stroke.part for stroke in self.strokes if stroke.part is not None]


def sketches(trajectory: Trajectory, frames: Frames) -> list[Sketch]:
    """Return beam and spring; once more, enlarged, a contact that is too small to be seen in that picture."""
    drawn = [_sketch("motion", "Motion", trajectory, frames, (frames.low, frames.high))]
    if contact := _contact_heights(trajectory, frames):
        drawn.append(_sketch("motion-contact", "The contact, enlarged", trajectory, frames, contact, _NEAR_TIP))
    return drawn


def _contact_heights(trajectory: Trajectory, frames: Frames) -> tuple[float, float] | None:
    """Return the heights [m] between which tip and spring touch, with room; ``None`` if the whole picture shows it."""
    touching = trajectory["phase"] != "free"
    heights = [trajectory[name][touching] for name in present(trajectory, POSITIONS)]
    if len(heights) < 2 or not touching.any():
        return None
    low = float(np.min(heights))
    high = float(np.max(heights))
    room = _ROOM_AROUND * (high - low)
    return (low - room, high + room) if 0.0 < high - low < _SMALL * (frames.high - frames.low) else None


def _sketch(
    name: str, heading: str, trajectory: Trajectory, frames: Frames, heights: tuple[float, float], begin: float = -0.02
) -> Sketch:
    """Return what there is between ``heights`` [m], from ``begin`` (a part of the beam's length) on."""
    unit = readable_unit([np.array(heights)], "m")
    along, length = length_along(trajectory.scene)
    low = unit.factor * heights[0]
    high = unit.factor * heights[1]
    ends = length * np.array([1.0 - _STOP_WIDTH, 1.0 + _STOP_WIDTH])
    half = _COIL_WIDTH * length
    strokes = []
    if frames.y is not None:
        strokes.append(Stroke(Look(VERMILLION, "spring", Line(1.2)), length + half * _COIL_ACROSS, part="coil"))
        across = length + 1.6 * half * np.array([-1.0, 1.0])
        strokes.append(Stroke(Look(VERMILLION, "its top y", Line(3.5)), across, part="top"))
    if frames.deflection is not None:
        strokes.append(Stroke(Look(BLUE, "beam u", Line(3.0)), length * SHAPE_POINTS, part="beam"))
    begin_at = begin * length
    end_at = 1.12 * length
    if trajectory.scene.beam is None:
        begin_at = 0.5 * length
        end_at = 1.5 * length
    else:
        strokes.append(Stroke(Look(STONE, "clamp", Line(7.0)), np.zeros(2), np.array([low, high])))
        strokes.append(Stroke(Look(GREY, "undeformed", Line(0.6, dashed=True)), np.array([0.0, length]), np.zeros(2)))
    for symbol, height in ((symbol, unit.factor * height) for symbol, height in frames.levels.items()):
        if low <= height <= high:
            if symbol == "φ":
                strokes.append(Stroke(Look(STONE, "foundation", Line(7.0)), ends, np.full(2, height)))
            strokes.append(Stroke(LEVELS[symbol], ends, np.full(2, height), label=symbol))
    return Sketch(name, heading, unit, along, (begin_at, end_at), (low, high), strokes)


def frames_of(trajectory: Trajectory) -> Frames | None:
    """Return the frames of a run; ``None`` if it has fewer than two."""
    rows = trajectory["time"]
    time = rows
    deflection = None
    if trajectory.shapes is not None:
        time, deflection = trajectory.shapes
    elif trajectory.scene.beam is not None:
        return None
    elif "u_tip" in trajectory.columns:
        # A body that is not our beam is a level bar at the height of its end.
        deflection = np.repeat(trajectory["u_tip"][:, None], len(SHAPE_POINTS), axis=1)
    known = time[: np.searchsorted(time, rows[-1:].max(initial=-np.inf), side="right")]  # one killed may have one more
    if len(known) < 2 or known[-1] <= known[0]:
        return None
    some = np.arange(len(known))
    if len(known) > MOST_FRAMES:
        some = np.unique(np.searchsorted(known, np.linspace(known[0], known[-1], MOST_FRAMES)))
    time = time[some]
    deflection = None if deflection is None else deflection[some]
    row = np.searchsorted(rows, time, side="right") - 1
    y = trajectory["y"][row] if "y" in trajectory.columns else None
    moving = [part for part in (deflection, y) if part is not None]
    near = near_levels(trajectory.scene, moving)
    heights = np.concatenate([*(part.ravel() for part in moving), list(near.values())])
    low = float(np.min(heights))
    high = float(np.max(heights))
    span = high - low or 1.0
    foot = low - _COIL * span if y is not None else low - 2.0 * _ROOM * span
    return Frames(time, row, deflection, y, near, foot, high + _ROOM * span, foot)
