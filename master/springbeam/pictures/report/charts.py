"""The charts of the report, JSON of plotly.js: panels over a common time axis, and sketches that the script moves.

The look that they share is the script's. They are dictionaries and not the figures of plotly's Python package, which
takes as long to load and to check each key as all the rest of a report.
"""

from __future__ import annotations

from base64 import b64encode
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...results.trajectory import Trajectory
from ..drawing import (
    EVENT_LOOKS,
    MANY_EVENTS,
    Look,
    Marker,
    event_marks,
    shaded_phases,
    time_unit,
)
from ..frames import Frames, Sketch
from ..panels import Curve, Panel, panels

#: A curve that varies by less than this share of its values keeps its double precision.
_FINE = 1e-3
#: Pixels of the page for a point of the pictures.
_PIXELS = 1.8
#: Pixels of a chart's height: for each inch of its picture, and for what stands around it.
_PIXELS_PER_INCH = 82
_PIXELS_BESIDE = 110
#: Height of a sketch [inch].
_SKETCH_HEIGHT = 3.0


@dataclass
class Chart:
    """A figure of plotly.js with its heading."""

    name: str
    heading: str
    layout: dict[str, Any]
    traces: list[dict[str, Any]] = field(default_factory=list)
    #: Most points of a trace.
    points: int = 0

    def add(self, **trace: Any) -> None:
        """Add a curve or points. Arrays become base64, which keeps all digits in little room; ``None`` is left out."""
        self.points = max(self.points, len(trace["x"]))
        given = {key: value for key, value in trace.items() if value is not None}
        arrays = {key: _encoded(value) for key, value in given.items() if isinstance(value, np.ndarray)}
        self.traces.append({"type": "scatter", **given, **arrays})

    def set_axis(self, name: str, title: str = "", **keys: Any) -> None:
        """Set the title of the axis ``name`` and some of its keys."""
        self.layout[name] = {"title": {"text": title}, **keys}


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
    chart = _over_time(trajectory, panel.name, panel.heading, _height_of(panel.height))
    clock = time_unit(trajectory).factor
    factor = panel.unit.factor
    for curve in panel.curves:
        chart.add(
            x=_single(clock * curve.time),
            y=_single(factor * curve.values),
            name=curve.look.words,
            meta=curve.name,
            hovertemplate=f"%{{y:.6g}} {panel.unit.name}",
            **_style(curve, panel),
        )
    scale: dict[str, Any] = {}
    if panel.logarithmic is not None:
        begin, end = (float(np.log10(limit)) for limit in panel.logarithmic)
        scale = {"type": "log", "range": [begin, end], "tick0": 0.0, "dtick": max(1, round((end - begin) / 4.0))}
        scale |= {"exponentformat": "e", "zeroline": False}
    chart.set_axis("yaxis", panel.axis, **scale)
    return chart


def _timeline(trajectory: Trajectory) -> Chart:
    """Draw each kind of event in a row of its own; the phases are in the backdrop."""
    kinds = event_marks(trajectory)
    chart = _over_time(trajectory, "timeline", "Phases and events", 76 + 18 * len(kinds))
    for i, mark in enumerate(kinds):
        chart.add(
            x=time_unit(trajectory).factor * mark.times,
            y=np.full(len(mark.times), -float(i)),
            customdata=np.column_stack([mark.times, mark.losses]),
            mode="markers",
            marker={**_marker_style(mark.marker), "color": mark.look.colour},
            name=EVENT_LOOKS[mark.kind].words,
            meta=mark.kind,
            cliponaxis=False,
            hovertemplate="t = %{customdata[0]:.9g} s, energy lost %{customdata[1]:.3g} J",
        )
    if not kinds:
        chart.add(x=[], y=[])  # plotly draws no axes without a curve
    chart.layout.update(hovermode="closest", showlegend=False)
    chart.set_axis(
        "yaxis",
        range=[-len(kinds), 1.0],
        showgrid=False,
        zeroline=False,
        showticklabels=False,
        ticks="",
        fixedrange=True,
    )
    return chart


def moving_chart(sketch: Sketch, frames: Frames) -> Chart:
    """Draw a sketch at the first frame; the page's script moves it."""
    chart = Chart(sketch.name, sketch.heading, {"height": _height_of(_SKETCH_HEIGHT), "margin": {"r": 30}})
    chart.layout.update(hovermode="closest", showlegend=len(sketch.moving) > 1)
    chart.set_axis("xaxis", f"position along the beam x [{sketch.along.name}]", range=sketch.x)
    chart.set_axis("yaxis", f"height [{sketch.unit.name}]", range=sketch.y, zeroline=False)
    for look, x, y, part, label in sketch.strokes:
        shown = part in ("beam", "top")
        chart.add(
            x=x,
            y=sketch.unit.factor * frames.heights(part, 0) if part is not None else y,
            mode="lines+text",
            text=["", f"\u00a0{label}"] if label else None,
            textposition="middle right",
            cliponaxis=False,
            meta=part,
            name=look.words,
            line=_line_style(look),
            showlegend=part is not None,
            hoverinfo=None if shown else "skip",
            hovertemplate=f"%{{y:.6g}} {sketch.unit.name}" if shown else None,
        )
    return chart


def _encoded(values: np.ndarray) -> dict[str, str]:
    """Return the typed array of plotly.js for ``values``, of any shape."""
    shape = {"shape": ", ".join(map(str, values.shape))} if values.ndim > 1 else {}
    data = b64encode(values.tobytes()).decode("ascii")
    return {"dtype": values.dtype.str[1:], "bdata": data, **shape}


def _single(values: np.ndarray) -> np.ndarray:
    """Return ``values`` in single precision, which is finer than any screen, unless it lacks the room or the digits."""
    with np.errstate(over="ignore", under="ignore"):
        single = values.astype(np.float32)
    kept = np.all(np.isfinite(single)) and not np.any((single == 0.0) & (values != 0.0))
    return single if kept and np.ptp(values) >= _FINE * np.max(np.abs(values), initial=0.0) else values


def _height_of(inches: float) -> int:
    """Return the height of a chart [px] whose picture has ``inches``."""
    return round(_PIXELS_BESIDE + _PIXELS_PER_INCH * inches)


def _over_time(trajectory: Trajectory, name: str, heading: str, height: int) -> Chart:
    """Return a chart of ``height`` [px] over the run's time, without curves."""
    unit = time_unit(trajectory)
    chart = Chart(name, heading, {"height": height})
    ends = (unit.factor * trajectory["time"][[0, -1]]).tolist()
    chart.set_axis("xaxis", f"time t [{unit.name}]", range=ends)
    return chart


def _style(curve: Curve, panel: Panel) -> dict[str, Any]:
    colour, _, line, marker = curve.look
    if curve.stacked:
        return {"mode": "lines", "line": {"width": 0.0}, "stackgroup": "stack", "fillcolor": colour}
    if marker is not None:
        values = panel.unit.factor * curve.values
        foot = 0.0 if panel.logarithmic is None else panel.logarithmic[0]
        stems = {
            "type": "data",
            "symmetric": False,
            "array": _encoded(np.zeros(len(values))),
            "arrayminus": _encoded(values - foot),
        }
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
