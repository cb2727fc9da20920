"""Axes over time: one panel below the other, phases shaded, events marked; and what all pictures look like."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ..results.trajectory import Trajectory
from .drawing import (
    ALTERNATES,
    EVENT_LOOKS,
    EVENT_MARKERS,
    GREY,
    LINES,
    MANY_EVENTS,
    VERMILLION,
    Line,
    Look,
    Unit,
    alternates,
    decimated,
    mark,
    readable_unit,
    shaded_phases,
)

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
DPI = 160
WIDTH = 8.2  # inches
_MARK_HEIGHT, _MARK_ROW = 1.045, 0.04
_KEY_COLUMNS = 4


@dataclass
class Timeline:
    """A figure of panels over a common time axis, phases shaded and events marked."""

    trajectory: Trajectory
    figure: Figure
    axes: list[Axes]
    unit: Unit

    @classmethod
    def of(cls, trajectory: Trajectory, title: str, heights: Sequence[float]) -> Timeline:
        """Make the figure with a panel of each of ``heights`` [inch], empty but for phases and events."""
        figure = figure_for(trajectory, title, 1.0 + sum(heights))
        axes = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0].tolist()
        unit = readable_unit([trajectory["time"]], "s")
        timeline = cls(trajectory, figure, axes, unit)
        axes[-1].set_xlabel(f"time t [{unit.name}]")
        axes[0].set_xlim(unit.factor * trajectory["time"][0], unit.factor * trajectory["time"][-1])
        keys: list[Patch | Line2D] = [*timeline._shade(), *timeline._mark_events()]
        # Legends fill column by column; these read row by row.
        keys = [key for column in range(_KEY_COLUMNS) for key in keys[column::_KEY_COLUMNS]]
        if keys:
            figure.legend(handles=keys, loc="outside lower left", ncols=_KEY_COLUMNS, frameon=False, columnspacing=1.4)
        return timeline

    def line(self, ax: Axes, unit: Unit, name: str, look: Look, **style: Any) -> None:
        """Draw a column over time; where it alternates from step to step, as dots on a faint line."""
        style = {"color": look.colour, "label": look.words, **line_style(LINES.get(name, Line())), **style}
        values = self.trajectory[name]
        rows = decimated(self.trajectory["time"], values)
        t, v = self.unit.factor * self.trajectory["time"][rows], unit.factor * values[rows]
        if alternates(values):
            style = {**style, "linewidth": 0.25, "marker": ".", "markersize": 1.6, "markeredgewidth": 0.0}
            note(ax, ALTERNATES.replace(" to", "\nto"))
        ax.plot(t, v, **style)

    def _shade(self) -> list[Patch]:
        patches = []
        for look, spans in shaded_phases(self.trajectory):
            intervals = [(self.unit.factor * start, self.unit.factor * (end - start)) for start, end in spans]
            for ax in self.axes:
                ax.broken_barh(
                    intervals, (0.0, 1.0), transform=ax.get_xaxis_transform(), color=look.colour, lw=0.0, zorder=0
                )
            patches.append(Patch(facecolor=look.colour, edgecolor=GREY, linewidth=0.5, label=look.words))
        return patches

    def _mark_events(self) -> list[Line2D]:
        """Mark events above the first panel and by lines through all; many only by ticks, a row for each kind."""
        events = self.trajectory.events
        many = len(events) > MANY_EVENTS
        handles: list[Line2D] = []
        for kind, (colour, words) in EVENT_LOOKS.items():
            times = self.unit.factor * np.array([event.time for event in events if event.kind == kind])
            if not len(times):
                continue
            height = _MARK_HEIGHT + (_MARK_ROW * len(handles) if many else 0.0)
            shape, size = ("|", 4.0) if many else (EVENT_MARKERS[kind].matplotlib, EVENT_MARKERS[kind].size)
            look: dict[str, Any] = {"color": colour, "marker": shape, "markersize": size, "ls": "none"}
            visible = times[decimated(times, times)]
            first = self.axes[0]
            first.plot(
                visible, np.full(len(visible), height), transform=first.get_xaxis_transform(), clip_on=False, **look
            )
            for ax in [] if many else self.axes:
                ax.vlines(
                    visible, 0.0, 1.0, transform=ax.get_xaxis_transform(), color=colour, lw=0.4, alpha=0.6, zorder=1
                )
            key = {"markersize": 8.0, "markeredgewidth": 1.5} if many else {}
            handles.append(Line2D([], [], label=f"{words} ({len(times)})", **(look | key)))
        return handles


def line_style(line: Line) -> dict[str, Any]:
    """Return matplotlib's arguments for a line."""
    return {"linewidth": line.width, "linestyle": _DASHES if line.dashed else "-", "alpha": line.opacity}


def figure_for(trajectory: Trajectory, title: str, height: float) -> Figure:
    """Return an empty figure of ``height`` [inch] with title, scene and, where the motion is not resolved, its mark."""
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    FigureCanvasAgg(figure)
    scene = trajectory.scene.title
    figure.suptitle(f"{title}\n{scene}" if scene else title, fontsize=10.0, x=0.01, ha="left")
    figure.text(0.99, 0.985, mark(trajectory), fontsize=8.0, weight="bold", color=VERMILLION, ha="right", va="top")
    return figure


def key(ax: Axes) -> None:
    """Put the key beside the panel."""
    ax.legend(loc="upper left", bbox_to_anchor=(1.005, 1.0), frameon=False, borderaxespad=0.0, handlelength=1.6)


def note(ax: Axes, text: str) -> None:
    """Put a remark beside the panel, under its key; once, however often it is made."""
    notes = [note for note in ax.texts if note.get_gid() == "note"]
    if not notes:
        ax.text(1.012, 0.0, text, transform=ax.transAxes, va="bottom", gid="note", **REMARK)
    elif text not in notes[0].get_text():
        notes[0].set_text(f"{notes[0].get_text()}\n{text}")
