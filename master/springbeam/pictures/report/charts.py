"""The charts of the report, figures of plotly: panels over a common time axis, and sketches that the script moves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go

from ...results.trajectory import Trajectory
from ..drawing import (
    BLACK,
    EVENT_LOOKS,
    GREY,
    MANY_EVENTS,
    Look,
    Marker,
    event_marks,
    shaded_phases,
    time_unit,
)
from ..frames import Frames, Sketch
from ..panels import Curve, Panel, panels

_GRID = "#E3E3E3"
#: A curve that varies by less than this share of its values keeps its double precision.
_FINE = 1e-3
#: Pixels of the page for a point of the pictures.
_PIXELS = 1.8
#: Pixels of a chart's height: for each inch of its picture, and for what stands around it.
_PIXELS_PER_INCH = 82
_PIXELS_BESIDE = 110
#: Of a sketch [inch].
_SKETCH_HEIGHT = 3.0


@dataclass
class Chart:
    """A figure with its heading."""

    name: str
    heading: str
    figure: go.Figure


def charts(trajectory: Trajectory) -> list[Chart]:
    """Return the charts over time for which the run has data, in the order of the page."""
    shown = [_of_panel(trajectory, panel) for panel in panels(trajectory)]
    eventful = trajectory.events or set(trajectory["phase"]) != {"free"}
    return [_timeline(trajectory), *shown] if shown and eventful else shown


def backdrop(trajectory: Trajectory) -> list[dict[str, Any]]:
    """Return the layout shapes behind every chart over time: phases shaded, events as lines unless there are many."""
    factor = time_unit(trajectory).factor
    shared: dict[str, Any] = {"type": "path", "xref": "x", "yref": "paper", "layer": "below"}
    shapes = [
        {
            **shared,
            "path": "".join(f"M{factor * start!r},0V1H{factor * end!r}V0Z" for start, end in spans),
            "fillcolor": look.colour,
            "line": {"width": 0.0},
        }
        for look, spans in shaded_phases(trajectory)
    ]
    for mark in event_marks(trajectory) if len(trajectory.events) <= MANY_EVENTS else ():
        path = "".join(f"M{time!r},0V1" for time in (factor * mark.times).tolist())
        shapes.append({**shared, "path": path, "line": {"width": 1.0, "color": mark.look.colour}, "opacity": 0.45})
    return shapes


def _of_panel(trajectory: Trajectory, panel: Panel) -> Chart:
    """Draw a panel."""
    figure = _over_time(trajectory, _height_of(panel.height))
    clock = time_unit(trajectory).factor
    factor = panel.unit.factor
    for curve in panel.curves:
        figure.add_scatter(
            x=_single(clock * curve.time),
            y=_single(factor * curve.values),
            name=curve.look.words,
            meta=curve.name,
            hovertemplate=f"%{{y:.6g}} {panel.unit.name}",
            **_style(curve, panel),
        )
    figure.update_yaxes(title_text=panel.axis)
    if panel.logarithmic is not None:
        begin, end = (float(np.log10(limit)) for limit in panel.logarithmic)
        figure.update_yaxes(
            type="log", range=[begin, end], tick0=0.0, dtick=max(1, round((end - begin) / 4.0)), exponentformat="e",
            zeroline=False,
        )  # fmt: skip
    return Chart(panel.name, panel.heading, figure)


def _timeline(trajectory: Trajectory) -> Chart:
    """Draw each kind of event in a row of its own; the phases are in the backdrop."""
    kinds = event_marks(trajectory)
    figure = _over_time(trajectory, height=76 + 18 * len(kinds))
    for i, mark in enumerate(kinds):
        figure.add_scatter(
            x=time_unit(trajectory).factor * mark.times,
            y=np.full(len(mark.times), -i),
            customdata=np.column_stack([mark.times, mark.losses]),
            mode="markers",
            marker={**_marker_style(mark.marker), "color": mark.look.colour},
            name=EVENT_LOOKS[mark.kind].words,
            meta=mark.kind,
            cliponaxis=False,
            hovertemplate="t = %{customdata[0]:.9g} s, energy lost %{customdata[1]:.3g} J",
        )
    if not kinds:
        figure.add_scatter(x=[], y=[])  # plotly draws no axes without a curve
    figure.update_layout(hovermode="closest", showlegend=False)
    figure.update_yaxes(
        range=[-len(kinds), 1.0], showgrid=False, zeroline=False, showticklabels=False, ticks="", fixedrange=True
    )
    return Chart("timeline", "Phases and events", figure)


def moving_chart(sketch: Sketch, frames: Frames) -> Chart:
    """Draw a sketch at the first frame; the page's script moves it."""
    figure = go.Figure(layout=_layout(_height_of(_SKETCH_HEIGHT)))
    figure.update_layout(hovermode="closest", margin_r=30, showlegend=len(sketch.moving) > 1)
    figure.update_xaxes(range=list(sketch.x), title_text=f"position along the beam x [{sketch.along.name}]")
    figure.update_yaxes(range=list(sketch.y), title_text=f"height [{sketch.unit.name}]", zeroline=False)
    for look, x, y, part, label in sketch.strokes:
        shown = part in ("beam", "top")
        figure.add_scatter(
            x=x, y=sketch.unit.factor * frames.heights(part, 0) if part is not None else y, mode="lines+text",
            text=["", f"\u00a0{label}"] if label else None, textposition="middle right", cliponaxis=False, meta=part,
            name=look.words, line=_line_style(look), showlegend=part is not None, hoverinfo=None if shown else "skip",
            hovertemplate=f"%{{y:.6g}} {sketch.unit.name}" if shown else None,
        )  # fmt: skip
    return Chart(sketch.name, sketch.heading, figure)


def _single(values: np.ndarray) -> np.ndarray:
    """Return ``values`` in single precision, which is finer than any screen, unless it lacks the room or the digits."""
    with np.errstate(over="ignore", under="ignore"):
        single = values.astype(np.float32)
    kept = np.all(np.isfinite(single)) and not np.any((single == 0.0) & (values != 0.0))
    return single if kept and np.ptp(values) >= _FINE * np.max(np.abs(values), initial=0.0) else values


def _height_of(inches: float) -> int:
    """Return the height of a chart [px] whose picture has ``inches``."""
    return round(_PIXELS_BESIDE + _PIXELS_PER_INCH * inches)


def _over_time(trajectory: Trajectory, height: int) -> go.Figure:
    """Return a figure of ``height`` [px] without curves over the run's time."""
    unit = time_unit(trajectory)
    time = trajectory["time"]
    figure = go.Figure(layout=_layout(height))
    ends = [unit.factor * float(time[0]), unit.factor * float(time[-1])]
    return figure.update_xaxes(range=ends, title_text=f"time t [{unit.name}]")


def _layout(height: int) -> dict[str, Any]:
    """Return the layout that all charts share; ``height`` in pixels."""
    axis = {
        "gridcolor": _GRID, "zeroline": False, "showline": True, "linecolor": BLACK, "ticks": "outside", "ticklen": 4,
        "title": {"standoff": 6}, "exponentformat": "power",
    }  # fmt: skip
    return {
        "template": "none",
        "height": height,
        "margin": {"l": 66, "r": 14, "t": 10, "b": 42},
        "font": {"family": "system-ui, sans-serif", "size": 12, "color": "#222222"},
        "paper_bgcolor": "white",
        "plot_bgcolor": "white",
        "hovermode": "x",
        "showlegend": True,
        "legend": {"orientation": "h", "x": 0.0, "xanchor": "left", "y": 1.0, "yanchor": "bottom"},
        "xaxis": axis,
        "yaxis": {**axis, "zeroline": True, "zerolinecolor": GREY, "zerolinewidth": 1.0},
    }


def _style(curve: Curve, panel: Panel) -> dict[str, Any]:
    colour, _, line, marker = curve.look
    if curve.stacked:
        return {"mode": "lines", "line": {"width": 0.0}, "stackgroup": "stack", "fillcolor": colour}
    if marker is not None:
        values = panel.unit.factor * curve.values
        foot = 0.0 if panel.logarithmic is None else panel.logarithmic[0]
        stems = {"type": "data", "symmetric": False, "array": np.zeros(len(values)), "arrayminus": values - foot}
        return {
            "mode": "markers",
            "marker": {**_marker_style(marker), "color": colour},
            "error_y": {**stems, "width": 0, "thickness": 1.5},
            "cliponaxis": False,
        }
    return {"mode": "lines", "line": _line_style(curve.look), "opacity": line.opacity}


def _line_style(look: Look) -> dict[str, Any]:
    """Return plotly's ``line``."""
    width = round(_PIXELS * look.line.width, 1)
    return {"color": look.colour, "width": width, "dash": "dash" if look.line.dashed else "solid"}


def _marker_style(marker: Marker) -> dict[str, Any]:
    """Return plotly's ``marker`` but for its colour."""
    return {"symbol": marker.plotly, "size": round(_PIXELS * marker.size)}
