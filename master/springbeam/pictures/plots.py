"""Pictures of a run: an overview; the sub-figures (A)–(E) of Ahn & Tate's Figures 2–5; loads and inner forces.

Lines differ in colour and in width or dashes, events in shape, so that pictures can be printed in black and white.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from ..results.directory import OVERVIEW, PICTURES
from ..results.trajectory import Trajectory
from ..scene.statics import SHAPE_POINTS
from .drawing import (
    BLACK,
    GREY,
    LEVELS,
    drawable,
    length_along,
    level_side,
    near_levels,
    readable_unit,
    time_unit,
)
from .panels import Panel, panels
from .timeline import COMPRESSION, DPI, REMARK, STYLE, figure_for, line_style, paint, shade, timeline

_SHAPES_EARLY = 20
_SHAPES_LATER = 24
#: Factor of the heights of panels in the overview.
_ON_ONE_PAGE = 0.75
#: Early to late, dark to light, but visible on paper.
_CLOCK = ListedColormap(matplotlib.colormaps["cividis"](np.linspace(0.0, 0.9, 256)), "clock")


@matplotlib.rc_context(STYLE)
def plot_run(trajectory: Trajectory, directory: str | Path, names: Iterable[str] = (OVERVIEW,)) -> list[Path]:
    """Draw pictures of `springbeam.results.directory.PICTURES`, those for which the run has data.

    Parameters
    ----------
    trajectory
        Any run, also one that stopped early; without two rows no picture is drawn.
    directory
        Directory for the PNG files; it must exist.
    names
        Names of the pictures.

    Returns
    -------
    list of Path
        The files written.
    """
    written = []
    for name in names:
        if (figure := _drawn(trajectory, name)) is not None:
            written.append(Path(directory) / PICTURES[name])
            figure.savefig(written[-1], dpi=DPI, pil_kwargs=COMPRESSION)
    return written


@matplotlib.rc_context(STYLE)
def figure_of(trajectory: Trajectory, picture: str, ax: Axes | None = None) -> Figure:
    """Return the picture of that name; see `springbeam.Trajectory.plot`."""
    there = PICTURES if ax is None else _OVER_TIME
    if picture not in there:
        raise ValueError(f"no picture {picture!r}{'' if ax is None else ' for axes'}; there are {', '.join(there)}")
    if ax is None:
        figure = _drawn(trajectory, picture)
    else:
        figure = None
        for panel in _panels(trajectory, picture)[:1]:
            paint(ax, panel, time_unit(trajectory))
            shade(ax, trajectory)
            ax.legend(loc="best")
            figure = ax.get_figure(root=True)
    if figure is None:
        raise ValueError(f"the run has no data for {picture!r}")
    return figure


def _drawn(trajectory: Trajectory, picture: str) -> Figure | None:
    if picture in _ALONG:
        return _ALONG[picture](trajectory) if drawable(trajectory) else None
    title, _ = _OVER_TIME[picture]
    shown = _panels(trajectory, picture)
    if picture == OVERVIEW:  # on one page
        shown = [replace(panel, height=_ON_ONE_PAGE * panel.height) for panel in shown]
    return timeline(trajectory, title, shown) if shown else None


def _panels(trajectory: Trajectory, picture: str) -> list[Panel]:
    _, names = _OVER_TIME[picture]
    return [panel for panel in panels(trajectory) if panel.name.startswith(names)]


def _since_contact(trajectory: Trajectory) -> tuple[np.ndarray, slice]:
    """Return the times [s] of the shapes since the tip first met something, or of all, and which these are."""
    times = np.empty(0) if trajectory.shapes is None else trajectory.shapes[0]
    meetings = (event.time for event in trajectory.events if event.kind.collision)
    since = slice(int(np.searchsorted(times, next(meetings, trajectory.time[0]))), None)
    return times[since], since


def _shapes_after_contact(trajectory: Trajectory) -> Figure | None:
    times, since = _since_contact(trajectory)
    if len(times) < 2 or trajectory.shapes is None:
        return None
    times = times[:_SHAPES_EARLY]
    shapes = trajectory.shapes[1][since][:_SHAPES_EARLY]
    steps = np.diff(times)
    some = steps > 1e-6 * np.max(steps)  # between rows of one event Δu is rounding
    middles = 0.5 * (times[1:] + times[:-1])[some]
    velocities = np.diff(shapes, axis=0)[some] / steps[some, None]
    drawn = {"deflection u": ("m", times, shapes), "mean velocity Δu/Δt": ("m/s", middles, velocities)}
    return _side_by_side(trajectory, "(A) The beam right after first contact", drawn)[0]


def _shapes_later(trajectory: Trajectory) -> Figure | None:
    if trajectory.shapes is None:
        return None
    return _later(trajectory, "(B) Subsequent motion of the beam", {"deflection u": ("m", trajectory.shapes[1])})


def _moments(trajectory: Trajectory) -> Figure | None:
    trajectory = trajectory.without_start()
    if trajectory.bending_moment is None or trajectory.shear_force is None:
        return None
    drawn = {"bending moment": ("N·m", trajectory.bending_moment), "shear force": ("N", trajectory.shear_force)}
    return _later(trajectory, "(G) Bending moment and shear force along the beam", drawn)


def _later(trajectory: Trajectory, title: str, quantities: Mapping[str, tuple[str, np.ndarray]]) -> Figure | None:
    """Draw quantities along the beam side by side: curves at some times, and the envelope of all."""
    times, since = _since_contact(trajectory)
    if len(times) < _SHAPES_EARLY:
        return None
    some = np.unique(np.searchsorted(times, np.linspace(times[0], times[-1], _SHAPES_LATER)))
    drawn = {what: (unit, times[some], values[since][some]) for what, (unit, values) in quantities.items()}
    figure, axes = _side_by_side(trajectory, title, drawn)
    for ax, (_, values) in zip(axes, quantities.values(), strict=True):
        late = values[since]
        ends = np.transpose([late.max(axis=0), late.min(axis=0)])
        factor = readable_unit([late[some]], "").factor
        x = length_along(trajectory.scene)[1] * SHAPE_POINTS
        ax.plot(x, factor * ends, color=BLACK, lw=0.8, ls=":")
        ax.set_title("dotted: envelope of all", **REMARK)
    return figure


def _side_by_side(
    trajectory: Trajectory, title: str, quantities: Mapping[str, tuple[str, np.ndarray, np.ndarray]]
) -> tuple[Figure, list[Axes]]:
    """Draw curves along the beam, unit, times and values of each quantity; the key has the time of each colour."""
    figure = figure_for(trajectory, title, 3.6)
    axes: list[Axes] = list(figure.subplots(1, len(quantities), squeeze=False)[0])
    for ax, (what, (unit, times, values)) in zip(axes, quantities.items(), strict=True):
        lines = _curves(ax, trajectory, times, values, what, unit)
    figure.colorbar(lines, ax=axes[-1], label=lines.get_label(), pad=0.05, aspect=30)
    return figure, axes


def _curves(
    ax: Axes, trajectory: Trajectory, times: np.ndarray, curves: np.ndarray, what: str, unit: str
) -> LineCollection:
    """Draw curves over x, coloured from early (dark) to late; with deflections [m] the levels near them."""
    readable = readable_unit([curves], unit)
    clock = readable_unit([times], "s")
    along, length = length_along(trajectory.scene)
    segments = [np.column_stack([length * SHAPE_POINTS, readable.factor * curve]) for curve in curves]
    label = f"time t [{clock.name}]"
    lines = LineCollection(segments, array=clock.factor * times, cmap=_CLOCK, linewidths=1.0, label=label)
    ax.add_collection(lines)
    ax.axhline(0.0, color=GREY, lw=0.5, zorder=0)
    ax.set(xlim=(0.0, length), xlabel=f"position along the beam x [{along.name}]", ylabel=f"{what} [{readable.name}]")
    ax.autoscale_view(scalex=False)
    near = near_levels(trajectory.scene, [curves]) if unit == "m" else {}
    for symbol, height in near.items():
        ax.axhline(readable.factor * height, xmin=0.93, zorder=1, **line_style(LEVELS[symbol]))
        ax.annotate(symbol, (1.0, readable.factor * height), xycoords=("axes fraction", "data"), fontsize=8.0,
                    xytext=(3.0, 0.0), textcoords="offset points", va=level_side(symbol, near))  # fmt: skip
    return lines


#: Functions of the pictures along the beam, (A), (B) and (G), and titles and panels of those over time.
_ALONG: dict[str, Callable[[Trajectory], Figure | None]] = {
    "shapes_after_contact": _shapes_after_contact,
    "shapes_later": _shapes_later,
    "moments": _moments,
}
_OVER_TIME = {
    "overview": ("", ("positions", "velocities", "forces", "impulses", "energies")),
    "positions": ("(C) Positions", ("positions",)),
    "velocities_and_forces": ("(D) Velocities and forces", ("velocities", "forces", "impulses")),
    "gap_and_energy": ("(E) Gap and energy", ("gap", "energies", "residual")),
    "loads_and_clamp": (
        "(F) Loads, accelerations, and the clamp", ("loads", "accelerations", "clamp", "bending")
    ),
}  # fmt: skip
