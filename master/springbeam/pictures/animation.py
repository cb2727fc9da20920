"""A run as an animation, GIF or MP4: beam and spring above their positions over time."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, PillowWriter
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ..results.trajectory import Trajectory
from .drawing import BLACK, VERMILLION, level_side, mark, time_unit
from .frames import Frames, Part, Sketch, frames_of, sketches
from .panels import positions
from .timeline import STYLE, line_style, paint, shade

SUFFIXES = (".gif", ".mp4")
_SIZE = (8.0, 5.0)
_DPI = 100


class AnimationError(RuntimeError):
    """The animation cannot be made; the message names cause and remedy."""


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
        Duration of the animation [s].
    fps
        Frames per second; a GIF counts in hundredths of a second.
    progress
        Takes the times of all frames and yields each when the frame before it is drawn.

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
    """The figure and its moving parts."""

    def __init__(self, trajectory: Trajectory, frames: Frames) -> None:
        self.trajectory = trajectory
        self.frames = frames
        self.figure = Figure(figsize=_SIZE, dpi=_DPI, layout="constrained")
        above, below = self.figure.subplots(2, 1, height_ratios=[2.0, 1.0])
        self._moving: list[tuple[Line2D, Part, float]] = []
        self._sketch(above, sketches(trajectory, frames)[0])
        self._clock = time_unit(trajectory)
        shade(below, trajectory)
        paint(below, positions(trajectory), self._clock)
        self._cursor = below.axvline(0.0, color=BLACK, lw=1.0, ls=":")
        self.figure.suptitle(trajectory.scene.title, fontsize=10.0, x=0.01, ha="left")
        self._words = self.figure.text(0.99, 0.985, "", fontsize=9.0, ha="right", va="top", family="monospace")
        above.set_title(mark(trajectory), fontsize=9.0, loc="right", color=VERMILLION, y=1.0)
        self.figure.draw_without_rendering()
        self.figure.set_layout_engine("none")  # parts at rest stay

    def show(self, frame: int) -> None:
        frames = self.frames
        for line, part, factor in self._moving:
            line.set_ydata(factor * frames.heights(part, frame))
        time = self._clock.factor * frames.time[frame]
        self._cursor.set_xdata([time, time])
        phase = str(self.trajectory["phase"][frames.row[frame]])
        self._words.set_text(f"t = {time:.4f} {self._clock.name}  {phase:<7}")

    def _sketch(self, ax: Axes, sketch: Sketch) -> None:
        labels = [stroke.label for stroke in sketch.strokes if stroke.label]
        for look, x, y, part, label in sketch.strokes:
            heights = np.zeros(len(x)) if y is None else y
            (line,) = ax.plot(x, heights, solid_capstyle="butt", zorder=1.0 + (part is not None), **line_style(look))
            ax.annotate(label, (x[-1], heights[-1]), xytext=(3.0, 0.0), textcoords="offset points",
                        va=level_side(label, labels))  # fmt: skip
            if part is not None:
                self._moving.append((line, part, sketch.unit.factor))
        ax.set(xlim=sketch.x, ylim=sketch.y, xlabel=f"position along the beam x [{sketch.along.name}]",
               ylabel=f"height [{sketch.unit.name}]")  # fmt: skip
