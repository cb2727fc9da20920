"""The charts of the report over x, which the page's script moves: beam and spring, and the beam enlarged."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go

from ...results.trajectory import Trajectory
from ...scene.statics import SHAPE_POINTS
from ..drawing import (
    BLACK,
    BLUE,
    GREY,
    LEVEL_LINES,
    POSITIONS,
    STONE,
    VERMILLION,
    Unit,
    length_along,
    much_smaller,
    present,
    readable_unit,
)
from ..frames import COIL_ACROSS, COIL_HEIGHTS, COIL_WIDTH, STOP_WIDTH, Frames
from .chart import Chart, layout, line_style


def moving_charts(trajectory: Trajectory, frames: Frames) -> list[Chart]:
    """Draw beam and spring at the first frame; the beam once more, enlarged, if it is lost beside the spring's."""
    found = [_whole(trajectory, frames)]
    if frames.deflection is not None and "u_tip" in much_smaller(trajectory, present(trajectory, POSITIONS)):
        found.append(_beam_enlarged(trajectory, frames))
    return found


def _height_units(trajectory: Trajectory, frames: Frames) -> list[Unit]:
    """Return the units of the heights in `moving_charts`."""
    whole = readable_unit([np.array([frames.low, frames.high])], "m")
    return [whole] if frames.deflection is None else [whole, readable_unit([frames.deflection], "m")]


def _whole(trajectory: Trajectory, frames: Frames) -> Chart:
    unit = _height_units(trajectory, frames)[0]
    beam = trajectory.scene.beam
    along, length = length_along(trajectory.scene)
    chart = Chart("motion", "Motion", go.Figure(layout=layout(380)))
    figure = chart.figure
    low, high = unit.factor * frames.low, unit.factor * frames.high
    figure.update_layout(hovermode="closest", margin_r=30)
    figure.update_yaxes(title_text=f"height [{unit.name}]", range=[low, high], zeroline=False)
    figure.update_xaxes(range=[-0.02 * length, 1.12 * length], title_text=f"position along the beam x [{along.name}]")
    if beam is None:
        figure.update_xaxes(visible=False, range=[0.5 * length, 1.5 * length])
    solid = {"type": "rect", "line": {"width": 0.0}, "fillcolor": STONE, "layer": "below"}
    if beam is not None:
        figure.add_shape(**solid, x0=-0.02 * length, x1=0.0, y0=0.0, y1=1.0, yref="paper")
        figure.add_shape(
            type="line", x0=0.0, x1=length, y0=0.0, y1=0.0, line={"color": GREY, "width": 1.0, "dash": "dot"}
        )
    for symbol, value in frames.levels.items():
        level = unit.factor * value
        line = {"color": BLACK, **line_style(LEVEL_LINES[symbol])}
        ends = {"x0": length * (1.0 - STOP_WIDTH), "x1": length * (1.0 + STOP_WIDTH)}
        if symbol == "φ":
            # Two blocks where a spring stands between them.
            inner = 1.2 * COIL_WIDTH * length if frames.y is not None else 0.0
            for side in (-1.0, 1.0):
                edges = {"x0": length + side * inner, "x1": length * (1.0 + side * STOP_WIDTH)}
                figure.add_shape(**solid, **edges, y0=low, y1=level)
        figure.add_shape(type="line", **ends, y0=level, y1=level, line=line)
        figure.add_annotation(x=ends["x1"], y=level, text=symbol, showarrow=False, xanchor="left", xshift=3)
    if frames.y is not None:
        half = COIL_WIDTH * length
        figure.add_scatter(
            x=length + half * COIL_ACROSS, y=unit.factor * frames.coil(0), mode="lines", meta="coil",
            line={"color": VERMILLION, "width": 2.0}, name="spring", hoverinfo="skip",
        )  # fmt: skip
        figure.add_scatter(
            x=[length - 1.6 * half, length + 1.6 * half], y=[unit.factor * frames.y[0]] * 2, mode="lines", meta="top",
            line={"color": VERMILLION, "width": 5.0}, name="its top y", hovertemplate=f"%{{y:.6g}} {unit.name}",
        )  # fmt: skip
    if frames.deflection is not None:
        _add_beam(figure, frames, length, unit)
    return chart


def _beam_enlarged(trajectory: Trajectory, frames: Frames) -> Chart:
    unit = _height_units(trajectory, frames)[1]
    assert frames.deflection is not None
    along, length = length_along(trajectory.scene)
    chart = Chart("motion-beam", "The beam alone, enlarged", go.Figure(layout=layout(240)))
    reach = 1.1 * unit.factor * float(np.max(np.abs(frames.deflection)))
    chart.figure.update_layout(hovermode="closest", margin_r=30, showlegend=False)
    chart.figure.update_xaxes(
        range=[-0.02 * length, 1.12 * length], title_text=f"position along the beam x [{along.name}]"
    )
    chart.figure.update_yaxes(title_text=f"deflection u [{unit.name}]", range=[-reach, reach])
    _add_beam(chart.figure, frames, length, unit)
    return chart


def _add_beam(figure: go.Figure, frames: Frames, length: float, unit: Unit) -> None:
    assert frames.deflection is not None
    figure.add_scatter(
        x=length * SHAPE_POINTS, y=unit.factor * frames.deflection[0], mode="lines", meta="beam",
        line={"color": BLUE, "width": 5.0}, name="beam u", hovertemplate=f"%{{y:.6g}} {unit.name}",
    )  # fmt: skip


def moving_parts(trajectory: Trajectory, frames: Frames, chart: Chart) -> dict[str, Any]:
    """Return what the page's script needs to move a chart of `moving_charts`: its traces by part, factor of heights."""
    units = _height_units(trajectory, frames)
    unit = units[0] if chart.name == "motion" else units[1]
    parts = [trace.meta for trace in chart.figure.data]
    return {
        "factor": unit.factor,
        "traces": parts,
        "foot": frames.foot,
        "heights": COIL_HEIGHTS.tolist(),
    }
