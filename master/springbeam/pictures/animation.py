"""A run as an animation, GIF or MP4: beam and spring above their positions over time."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, PillowWriter
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from ..results.trajectory import Trajectory
from ..scene.statics import SHAPE_POINTS
from .drawing import (
    BLACK,
    BLUE,
    GREY,
    LEVEL_LINES,
    LINES,
    POSITIONS,
    STONE,
    VERMILLION,
    Unit,
    decimated,
    length_along,
    level_side,
    mark,
    much_smaller,
    near_levels,
    present,
    readable_unit,
    shaded_phases,
)
from .frames import COIL_ACROSS, COIL_WIDTH, STOP_WIDTH, Frames, frames_of
from .timeline import STYLE, line_style

SUFFIXES = (".gif", ".mp4")
_SIZE, _DPI = (8.0, 5.0), 100


class AnimationError(RuntimeError):
    """The animation cannot be made; the message says why and what to do."""


def animate(
    trajectory: Trajectory,
    path: Path,
    *,
    seconds: float = 10.0,
    fps: int = 20,
    progress: Callable[[Sequence[float]], Iterable[float]] = iter,
) -> None:
    """Write the whole run as an animation.

    Parameters
    ----------
    trajectory
        Any run of at least two frames.
    path
        ``.gif``, or ``.mp4``, which needs ffmpeg.
    seconds
        How long it plays [s].
    fps
        Frames per second; a GIF counts in hundredths of a second.
    progress
        Gets the times of all frames and hands them on, one when the last is drawn.

    Raises
    ------
    AnimationError
        If there is nothing to animate, or nothing to write it with.
    """
    frames = frames_of(trajectory)
    if frames is None:
        raise AnimationError("the run has no two frames at different times: there is nothing to animate")
    writer = _writer(path, fps)
    times = np.linspace(frames.time[0], frames.time[-1], max(2, round(seconds * fps))).tolist()
    with matplotlib.rc_context(STYLE):
        picture = _Picture(trajectory, frames)
        try:
            with writer.saving(picture.figure, str(path), _DPI):
                for time in progress(times):
                    picture.show(frames.at(time))
                    writer.grab_frame()
        except (subprocess.CalledProcessError, BrokenPipeError) as error:
            path.unlink(missing_ok=True)
            raise AnimationError(f"{path}: ffmpeg could not write it ({error}); a .gif needs no ffmpeg") from error
        except BaseException:
            path.unlink(missing_ok=True)
            raise


def _writer(path: Path, fps: int) -> AbstractMovieWriter:
    if path.suffix == ".gif":
        return PillowWriter(fps=fps)
    if path.suffix != ".mp4":
        raise AnimationError(f"{path}: an animation is a {' or a '.join(SUFFIXES)} file")
    if not FFMpegWriter.isAvailable():
        raise AnimationError(
            f"{path}: an .mp4 needs ffmpeg, which is not installed (Debian, Ubuntu: sudo apt-get install ffmpeg); "
            "or write a .gif"
        )
    return FFMpegWriter(fps=fps, extra_args=["-pix_fmt", "yuv420p"])


class _Picture:
    """The figure, and what moves in it."""

    def __init__(self, trajectory: Trajectory, frames: Frames) -> None:
        self.trajectory, self.frames = trajectory, frames
        lost = frames.deflection is not None and "u_tip" in much_smaller(trajectory, present(trajectory, POSITIONS))
        self.figure = Figure(figsize=_SIZE, dpi=_DPI, layout="constrained")
        heights = [3.0, *[1.5] * lost, 1.5]
        above, *close, below = self.figure.subplots(len(heights), 1, height_ratios=heights)
        self._moving: list[tuple[Line2D, str, float]] = []
        self._bodies(above)
        for ax in close:
            self._beam_enlarged(ax)
        self._clock = readable_unit([trajectory["time"]], "s")
        self._positions(below)
        self._cursor = below.axvline(0.0, color=BLACK, lw=1.0, ls=":")
        self.figure.suptitle(trajectory.scene.title, fontsize=10.0, x=0.01, ha="left")
        self._words = self.figure.text(0.99, 0.985, "", fontsize=9.0, ha="right", va="top", family="monospace")
        if words := mark(trajectory):
            above.set_title(words, fontsize=9.0, loc="right", color=VERMILLION, y=1.0)
        self._freeze()

    def show(self, frame: int) -> None:
        frames = self.frames
        for line, part, factor in self._moving:
            if part == "beam":
                assert frames.deflection is not None
                line.set_ydata(factor * frames.deflection[frame])
            elif part == "coil":
                line.set_ydata(factor * frames.coil(frame))
            else:
                assert frames.y is not None
                line.set_ydata(factor * np.full(2, frames.y[frame]))
        time = self._clock.factor * frames.time[frame]
        self._cursor.set_xdata([time, time])
        phase = str(self.trajectory["phase"][frames.row[frame]])
        self._words.set_text(f"t = {time:.4f} {self._clock.name}  {phase:<7}")

    def _freeze(self) -> None:
        """Make one image of everything that stands still: it is drawn once, not for each frame."""
        moving: list[Artist] = [line for line, _, _ in self._moving]
        moving += [self._cursor, self._words]
        for artist in moving:
            artist.set_visible(False)
        canvas = FigureCanvasAgg(self.figure)
        canvas.draw()  # type: ignore[no-untyped-call]
        self.figure.set_layout_engine("none")
        for artist in [*self.figure.texts, *(child for ax in self.figure.axes for child in ax.get_children())]:
            artist.set_visible(artist in moving)
        still = np.array(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
        self.figure.figimage(still, zorder=-1.0)

    def _bodies(self, ax: Axes) -> None:
        frames = self.frames
        unit = readable_unit([np.array([frames.low, frames.high])], "m")
        low, high = unit.factor * frames.low, unit.factor * frames.high
        along, length = length_along(self.trajectory.scene)
        if self.trajectory.scene.beam is None:
            ax.set_xlim(0.5 * length, 1.5 * length)
            ax.xaxis.set_visible(False)
        else:
            self._wall(ax, along, length, low, high)
        self._stand(ax, length, unit, low)
        ax.set_ylim(low, high)
        ax.set_ylabel(f"height [{unit.name}]")
        if frames.y is not None:
            half = COIL_WIDTH * length
            (coil,) = ax.plot(length + half * COIL_ACROSS, unit.factor * frames.coil(0), color=VERMILLION, lw=1.3)
            (top,) = ax.plot(
                [length - 1.6 * half, length + 1.6 * half], [0.0, 0.0], color=VERMILLION, lw=4.0, solid_capstyle="butt"
            )
            self._moving += [(coil, "coil", unit.factor), (top, "top", unit.factor)]
        if frames.deflection is not None:
            self._beam(ax, length, unit)

    def _stand(self, ax: Axes, length: float, unit: Unit, low: float) -> None:
        """Draw Ψ and φ beside the tip; the foundation as one block, or two with the spring between them."""
        for symbol, value in self.frames.levels.items():
            level = unit.factor * value
            ends = length * (1.0 - STOP_WIDTH), length * (1.0 + STOP_WIDTH)
            if symbol == "φ":
                inner = 1.2 * COIL_WIDTH * length if self.frames.y is not None else 0.0
                for begin, end in ((ends[0], length - inner), (length + inner, ends[1])):
                    ax.add_patch(Rectangle((begin, low), end - begin, level - low, color=STONE, lw=0.0))
            ax.plot(ends, [level, level], color=BLACK, **line_style(LEVEL_LINES[symbol]))
            ax.annotate(symbol, (ends[1], level), xytext=(3.0, 0.0), textcoords="offset points",
                        va=level_side(symbol, self.frames.levels))  # fmt: skip

    def _beam_enlarged(self, ax: Axes) -> None:
        assert self.frames.deflection is not None
        unit = readable_unit([self.frames.deflection], "m")
        along, length = length_along(self.trajectory.scene)
        reach = 1.1 * unit.factor * float(np.max(np.abs(self.frames.deflection)))
        self._wall(ax, along, length, -reach, reach)
        ax.set_ylim(-reach, reach)
        ax.set_ylabel(f"beam alone\nu [{unit.name}]")
        self._beam(ax, length, unit)

    def _beam(self, ax: Axes, length: float, unit: Unit) -> None:
        (beam,) = ax.plot(length * SHAPE_POINTS, np.zeros(len(SHAPE_POINTS)), color=BLUE, lw=3.5)
        self._moving.append((beam, "beam", unit.factor))

    @staticmethod
    def _wall(ax: Axes, along: Unit, length: float, low: float, high: float) -> None:
        ax.add_patch(Rectangle((-0.02 * length, low), 0.02 * length, high - low, color=STONE, lw=0.0))
        ax.plot([0.0, length], [0.0, 0.0], color=GREY, lw=0.6, ls=":")
        ax.set_xlim(-0.02 * length, 1.12 * length)
        ax.set_xlabel(f"position along the beam x [{along.name}]")

    def _positions(self, ax: Axes) -> None:
        trajectory, clock = self.trajectory, self._clock.factor
        time = trajectory["time"]
        names = present(trajectory, POSITIONS)
        unit = readable_unit([trajectory[name] for name in names], "m")
        for look, spans in shaded_phases(trajectory):
            for start, end in spans:
                ax.axvspan(clock * start, clock * end, color=look.colour, lw=0.0, zorder=0)
        for name in names:
            rows = decimated(time, trajectory[name])
            colour, words = POSITIONS[name]
            ax.plot(
                clock * time[rows], unit.factor * trajectory[name][rows], color=colour, label=words,
                **line_style(LINES[name]),
            )  # fmt: skip
        for symbol, height in near_levels(trajectory.scene, [trajectory[name] for name in names]).items():
            ax.axhline(unit.factor * height, color=BLACK, **line_style(LEVEL_LINES[symbol]))
        ax.set_xlim(clock * time[0], clock * time[-1])
        ax.set_xlabel(f"time t [{self._clock.name}]")
        ax.set_ylabel(f"position [{unit.name}]")
        ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, handlelength=1.4)
