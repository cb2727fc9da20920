"""Axes over time: one panel below the other, phases shaded, events marked; and the common look of all pictures."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from ..results.trajectory import Trajectory
from .drawing import (
    GREY,
    MANY_EVENTS,
    VERMILLION,
    EventMark,
    Look,
    Unit,
    event_marks,
    mark,
    power_of_ten,
    readable_unit,
    shaded_phases,
    time_unit,
)
from .panels import Panel, compared

_DASHES = (0, (4, 2))

STYLE: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "axes.labelsize": 9.0,
    "legend.fontsize": 8.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "lines.linewidth": 1.1,
    "lines.solid_joinstyle": "round",
    "axes.formatter.useoffset": False,
    "agg.path.chunksize": 10000,
}
REMARK: dict[str, Any] = {"fontsize": 7.0, "style": "italic", "color": GREY}
DPI = 120
#: Compression of the PNGs: four times as fast as by default, and a few percent larger.
COMPRESSION = {"compress_level": 2}
_TITLE_WIDTH = 105  # characters
_BESIDE_MARK = 60
_KEY_COLUMNS = 4
#: Sizes of a figure, and of what surrounds its panels [inch]: labels to the left, keys to the right; between two
#: panels; the labels of the time axis; a row of a title or of the key; a row of marks of events; free room.
_WIDTH = 8.2
_LEFT = 0.75
_RIGHT = 1.85
_GAP = 0.12
_AXIS = 0.45
_LINE = 0.19
_MARK_ROW = 0.11
_ROOM = 0.12
#: Most characters in a line of a panel's key, and the height of a line [inch].
_KEY_WIDTH = 24
_KEY_LINE = 0.16


def timeline(trajectory: Trajectory, title: str, panels: Sequence[Panel]) -> Figure:
    """Return the figure of ``panels``, one below the other over a common time axis; phases shaded, events marked."""
    phases = [look for look, _ in shaded_phases(trajectory)]
    marks = event_marks(trajectory)
    heading = _heading(title, trajectory)
    above = _LINE * len(heading.splitlines()) + _MARK_ROW * len(marks) + 2.0 * _ROOM
    below = _LINE * -(-(len(phases) + len(marks)) // _KEY_COLUMNS)
    figure, axes = _painted(panels, time_unit(trajectory), above, below)
    _title(figure, heading, trajectory)
    shade(axes[0], trajectory, _reach(axes, 0)[0])
    shades = [Patch(facecolor=look.colour, edgecolor=GREY, linewidth=0.5, label=look.words) for look in phases]
    keys = [*shades, *_mark_events(figure, axes, marks, trajectory)]
    # Legends fill column by column; these read row by row.
    keys = [key for column in range(_KEY_COLUMNS) for key in keys[column::_KEY_COLUMNS]]
    if keys:
        figure.legend(handles=keys, loc="lower left", ncols=_KEY_COLUMNS, frameon=False, columnspacing=1.4)
    return figure


def _painted(panels: Sequence[Panel], clock: Unit, above: float, below: float) -> tuple[Figure, list[Axes]]:
    """Return a figure with ``panels`` one below the other over a common time axis in the unit ``clock``.

    There is room [inch] ``above`` and ``below`` them. Every place is known before anything is drawn: a layout that
    looks for room draws all texts several times.
    """
    heights = [max(panel.height, _KEY_LINE * sum(len(key.splitlines()) for key in _keys(panel))) for panel in panels]
    height = above + sum(heights) + _GAP * len(panels) + _AXIS + below
    figure = Figure(figsize=(_WIDTH, height))
    FigureCanvasAgg(figure)
    axes = list[Axes]()
    top = height - above
    across = _WIDTH - _LEFT - _RIGHT
    for panel, own in zip(panels, heights, strict=True):
        top -= own
        place = (_LEFT / _WIDTH, top / height, across / _WIDTH, own / height)
        axes.append(figure.add_axes(place, sharex=axes[0] if axes else None))
        paint(axes[-1], panel, clock)
        axes[-1].yaxis.set_label_coords((0.15 - _LEFT) / across, 0.5)
        top -= _GAP
    for ax in axes[:-1]:
        ax.xaxis.set_visible(False)  # its ticks would take as long as all else
    for ax in axes[1:]:
        ax.patch.set_visible(False)  # phases are shaded across all panels
    return figure, axes


def _reach(axes: Sequence[Axes], k: int) -> tuple[float, float]:
    """Return where the lowest of ``axes`` begins and the highest ends, in fractions of the height of number ``k``."""
    own = axes[k].get_position()
    return (axes[-1].get_position().y0 - own.y0) / own.height, (axes[0].get_position().y1 - own.y0) / own.height


def _mark_events(figure: Figure, axes: list[Axes], marks: Sequence[EventMark], trajectory: Trajectory) -> list[Line2D]:
    """Mark events above the first panel, in a row for each kind, and by lines through all unless they are many.

    Returns the entries of the key.
    """
    factor = time_unit(trajectory).factor
    inch = figure.get_figheight() * axes[0].get_position().height
    handles: list[Line2D] = []
    across = axes[0].get_xaxis_transform()
    for row, event in enumerate(marks):
        times = factor * event.times
        height = 1.0 + (row + 0.9) * _MARK_ROW / inch
        look: dict[str, Any] = {
            "color": event.look.colour, "marker": event.marker.matplotlib, "markersize": event.marker.size, "ls": "none"
        }  # fmt: skip
        handles.append(Line2D([], [], label=event.look.words, **look))
        axes[0].plot(times, np.full(len(times), height), transform=across, clip_on=False, **look)
        if len(trajectory.events) <= MANY_EVENTS:
            axes[-1].vlines(times, *_reach(axes, -1), transform=axes[-1].get_xaxis_transform(), clip_on=False,
                            color=event.look.colour, lw=0.4, alpha=0.6)  # fmt: skip
    return handles


def shade(ax: Axes, trajectory: Trajectory, low: float = 0.0) -> None:
    """Give the axes the time of the run, and its phases as shades from ``low``, in fractions of its height, upwards."""
    factor = time_unit(trajectory).factor
    for look, spans in shaded_phases(trajectory):
        intervals = [(factor * start, factor * (end - start)) for start, end in spans]
        ax.broken_barh(intervals, (low, 1.0 - low), transform=ax.get_xaxis_transform(), color=look.colour, lw=0.0,
                       zorder=0, clip_on=False)  # fmt: skip
    ax.set_xlim(*(factor * trajectory["time"][[0, -1]]))


def paint(ax: Axes, panel: Panel, clock: Unit) -> None:
    """Draw ``panel`` over time in the unit ``clock``."""
    ax.set(xlabel=f"time t [{clock.name}]", ylabel=panel.axis)
    below = np.zeros(1)
    for curve, key in zip(panel.curves, _keys(panel), strict=True):
        time = clock.factor * curve.time
        values = panel.unit.factor * curve.values
        colour = curve.look.colour
        marker = curve.look.marker
        if curve.stacked:
            ax.fill_between(time, below, below + values, color=colour, label=key, linewidth=0.0)
            below = below + values
        elif marker is not None:
            ax.vlines(time, 0.0 if panel.logarithmic is None else panel.logarithmic[0], values, color=colour, lw=1.0)
            face = "none" if marker.sign == "○" else colour
            ax.plot(time, values, marker.matplotlib, color=colour, label=key, ms=marker.size, mfc=face)
        else:
            ax.plot(time, values, label=key, **line_style(curve.look))
    if panel.logarithmic is not None:
        ax.set(yscale="log", ylim=panel.logarithmic)
        ax.yaxis.set_major_locator(LogLocator(numticks=6))
        ax.yaxis.set_minor_locator(NullLocator())
        ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: power_of_ten(value)))
    elif np.any(below):
        ax.set_ylim(bottom=0.0)
    elif ax.get_ylim()[0] < 0.0 < ax.get_ylim()[1]:
        ax.axhline(0.0, color=GREY, lw=0.5, zorder=1)
    # The key stands beside the panel.
    ax.legend(
        loc="upper left",
        bbox_to_anchor=(1.005, 1.0),
        frameon=False,
        borderaxespad=0.0,
        handlelength=1.6,
        labelspacing=0.3,
    )


def _keys(panel: Panel) -> list[str]:
    """Return the words of each curve, in lines that fit beside the panel."""
    return [textwrap.fill(curve.look.words.replace(", L", ",\u00a0L"), _KEY_WIDTH) for curve in panel.curves]


def line_style(look: Look) -> dict[str, Any]:
    """Return matplotlib's arguments for a line."""
    line = look.line
    return {
        "color": look.colour,
        "linewidth": line.width,
        "linestyle": _DASHES if line.dashed else "-",
        "alpha": line.opacity,
    }


def figure_for(trajectory: Trajectory, title: str, height: float) -> Figure:
    """Return an empty figure, ``height`` [inch] below title, scene and the mark of a motion that is not resolved."""
    heading = _heading(title, trajectory)
    whole = height + _LINE * len(heading.splitlines()) + _ROOM
    # The title has a place of its own, which the layout does not know.
    layout = ConstrainedLayoutEngine(rect=(0.0, 0.0, 1.0, height / whole))
    figure = Figure(figsize=(_WIDTH, whole), layout=layout)
    FigureCanvasAgg(figure)
    _title(figure, heading, trajectory)
    return figure


def _title(figure: Figure, heading: str, trajectory: Trajectory) -> None:
    height = figure.get_figheight()
    figure.suptitle(heading, fontsize=10.0, x=0.01, y=1.0 - 0.5 * _ROOM / height, ha="left", va="top")
    figure.text(0.99, 1.0 - 0.5 * _ROOM / height, mark(trajectory), fontsize=8.0, weight="bold", color=VERMILLION,
                ha="right", va="top")  # fmt: skip


def _heading(title: str, trajectory: Trajectory) -> str:
    """Return title and scene, wrapped beside the mark if there is one."""
    width = _BESIDE_MARK if mark(trajectory) else _TITLE_WIDTH
    return "\n".join(textwrap.fill(line, width) for line in (title, trajectory.scene.title) if line)


@matplotlib.rc_context(STYLE)
def draw_compared(runs: Mapping[str, Trajectory]) -> Figure:
    """Return the figure of runs by their names, in the panels for which any of them has data."""
    clock = readable_unit([run["time"] for run in runs.values()], "s")
    return _painted(compared(runs), clock, _ROOM, 0.0)[0]
