"""The charts of the report over a common time axis, and what is drawn behind all of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go

from ...results.trajectory import Trajectory
from ..drawing import EVENT_LOOKS, LEVELS, MANY_EVENTS, event_marks, shaded_phases, time_unit
from ..panels import Curve, Panel, panels
from .chart import Chart, height_of, layout, line_style, marker_style


def charts(trajectory: Trajectory) -> list[Chart]:
    """Return the charts over time that the run has something to show for, in the order of the page.

    Parameters
    ----------
    trajectory
        A run of at least two rows at different times.
    """
    timeline = [_timeline(trajectory)] if trajectory.events or set(trajectory["phase"]) != {"free"} else []
    return [*timeline, *(_of_panel(trajectory, panel) for panel in panels(trajectory))]


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


def _chart(trajectory: Trajectory, name: str, heading: str, height: int) -> Chart:
    """Return a chart without curves over the run's time."""
    unit, time = time_unit(trajectory), trajectory["time"]
    figure = go.Figure(layout=layout(height))
    figure.update_xaxes(
        range=[unit.factor * float(time[0]), unit.factor * float(time[-1])], title_text=f"time t [{unit.name}]"
    )
    return Chart(name, heading, figure)


def _of_panel(trajectory: Trajectory, panel: Panel) -> Chart:
    """Draw a panel."""
    chart = _chart(trajectory, panel.name, panel.heading, height_of(panel.height))
    chart.remarks = panel.remarks
    chart.points = max((len(curve.time) for curve in panel.curves), default=0)
    clock, factor = time_unit(trajectory).factor, panel.unit.factor
    for curve in panel.curves:
        chart.figure.add_scatter(
            x=clock * curve.time,
            y=factor * curve.values,
            name=curve.look.words,
            meta=curve.name,
            hovertemplate=f"%{{y:.6g}} {panel.unit.name}",
            **_style(curve, panel),
        )
    ends = clock * trajectory["time"][[0, -1]]
    for symbol, height in panel.levels.items():
        chart.figure.add_scatter(
            x=ends, y=factor * np.array([height, height]), mode="lines", name=LEVELS[symbol].words,
            line=line_style(LEVELS[symbol]), hoverinfo="skip",
        )  # fmt: skip
    chart.figure.update_yaxes(title_text=panel.axis)
    if panel.logarithmic is not None:
        begin, end = (float(np.log10(limit)) for limit in panel.logarithmic)
        chart.figure.update_yaxes(
            type="log", range=[begin, end], tick0=0.0, dtick=max(1, round((end - begin) / 4.0)), exponentformat="e",
            zeroline=False,
        )  # fmt: skip
    return chart


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
            "marker": {**marker_style(marker), "color": colour},
            "error_y": {**stems, "width": 0, "thickness": 1.5},
            "cliponaxis": False,
        }
    if curve.alternates:
        return {
            "mode": "lines+markers",
            "line": {"color": colour, "width": 0.4},
            "marker": {"size": 2.5, "color": colour},
        }
    return {"mode": "lines", "line": line_style(curve.look), "opacity": line.opacity}


def _timeline(trajectory: Trajectory) -> Chart:
    """Draw each kind of event in a row of its own; the phases are in the backdrop."""
    kinds = event_marks(trajectory)
    chart = _chart(trajectory, "timeline", "Phases and events", height=76 + 18 * len(kinds))
    for i, mark in enumerate(kinds):
        chart.points = max(chart.points, len(mark.times))
        chart.figure.add_scatter(
            x=time_unit(trajectory).factor * mark.times,
            y=np.full(len(mark.times), -i),
            customdata=np.column_stack([mark.times, mark.losses]),
            mode="markers",
            marker={**marker_style(mark.marker), "color": mark.look.colour},
            name=EVENT_LOOKS[mark.kind].words,
            meta=mark.kind,
            cliponaxis=False,
            hovertemplate="t = %{customdata[0]:.9g} s, energy lost %{customdata[1]:.3g} J",
        )
    if not kinds:
        chart.figure.add_scatter(x=[], y=[])  # plotly draws no axes without a curve
    chart.figure.update_layout(hovermode="closest", showlegend=False)
    chart.figure.update_yaxes(
        range=[-len(kinds), 1.0], showgrid=False, zeroline=False, showticklabels=False, ticks="", fixedrange=True
    )
    return chart
