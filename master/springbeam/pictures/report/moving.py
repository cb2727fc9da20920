"""The charts of the report over x, which the page's script moves: beam and spring, and what of them is small."""

from __future__ import annotations

from dataclasses import dataclass
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

#: The contact is drawn once more where its heights are a smaller part than this of the whole picture's, with as much
#: room around; from so far along the beam.
_SMALL, _ROOM, _NEAR_TIP = 0.2, 0.3, 0.8


@dataclass
class MovingChart(Chart):
    """A chart that the page's script moves."""

    factor: float = 1.0  #: from metres to the unit of its heights


def moving_charts(trajectory: Trajectory, frames: Frames) -> list[MovingChart]:
    """Draw beam and spring at the first frame; once more, enlarged, what is too small to be seen in that picture."""
    found = [_bodies("motion", "Motion", trajectory, frames, frames.low, frames.high, -0.02)]
    if contact := _contact_heights(trajectory, frames):
        found.append(_bodies("motion-contact", "The contact, enlarged", trajectory, frames, *contact, _NEAR_TIP))
    if frames.deflection is not None and "u_tip" in much_smaller(trajectory, present(trajectory, POSITIONS)):
        found.append(_beam_enlarged(trajectory, frames))
    return found


def _contact_heights(trajectory: Trajectory, frames: Frames) -> tuple[float, float] | None:
    """Return the heights [m] between which tip and spring touch, with room; ``None`` if the whole picture shows it."""
    touching = trajectory["phase"] != "free"
    heights = [trajectory[name][touching] for name in present(trajectory, POSITIONS)]
    if len(heights) < 2 or not touching.any():
        return None
    low, high = min(float(part.min()) for part in heights), max(float(part.max()) for part in heights)
    room = _ROOM * (high - low)
    return (low - room, high + room) if 0.0 < high - low < _SMALL * (frames.high - frames.low) else None


def _bodies(
    name: str, heading: str, trajectory: Trajectory, frames: Frames, low: float, high: float, begin: float
) -> MovingChart:
    """Draw both bodies between the heights ``low`` and ``high`` [m], from ``begin`` (a part of its length) on."""
    unit = readable_unit([np.array([low, high])], "m")
    beam = trajectory.scene.beam
    along, length = length_along(trajectory.scene)
    chart = MovingChart(name, heading, go.Figure(layout=layout(380)), factor=unit.factor)
    figure = chart.figure
    low, high = unit.factor * low, unit.factor * high
    figure.update_layout(hovermode="closest", margin_r=30)
    figure.update_yaxes(title_text=f"height [{unit.name}]", range=[low, high], zeroline=False)
    figure.update_xaxes(range=[begin * length, 1.12 * length], title_text=f"position along the beam x [{along.name}]")
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
        if not low <= level <= high:
            continue
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


def _beam_enlarged(trajectory: Trajectory, frames: Frames) -> MovingChart:
    assert frames.deflection is not None
    unit = readable_unit([frames.deflection], "m")
    along, length = length_along(trajectory.scene)
    figure = go.Figure(layout=layout(240))
    reach = 1.1 * unit.factor * float(np.max(np.abs(frames.deflection)))
    figure.update_layout(hovermode="closest", margin_r=30, showlegend=False)
    figure.update_xaxes(range=[-0.02 * length, 1.12 * length], title_text=f"position along the beam x [{along.name}]")
    figure.update_yaxes(title_text=f"deflection u [{unit.name}]", range=[-reach, reach])
    _add_beam(figure, frames, length, unit)
    return MovingChart("motion-beam", "The beam alone, enlarged", figure, factor=unit.factor)


def _add_beam(figure: go.Figure, frames: Frames, length: float, unit: Unit) -> None:
    assert frames.deflection is not None
    figure.add_scatter(
        x=length * SHAPE_POINTS, y=unit.factor * frames.deflection[0], mode="lines", meta="beam",
        line={"color": BLUE, "width": 5.0}, name="beam u", hovertemplate=f"%{{y:.6g}} {unit.name}",
    )  # fmt: skip


def moving_parts(frames: Frames, chart: MovingChart) -> dict[str, Any]:
    """Return what the page's script needs to move ``chart``: its traces by part, factor of heights."""
    return {
        "factor": chart.factor,
        "traces": [trace.meta for trace in chart.figure.data],
        "foot": frames.foot,
        "heights": COIL_HEIGHTS.tolist(),
    }
