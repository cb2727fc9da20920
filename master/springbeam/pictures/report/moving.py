"""The charts of the report over x, which the page's script moves."""

from __future__ import annotations

from typing import Any

import plotly.graph_objects as go

from ..drawing import GREY, LEVELS, STONE
from ..frames import COIL_HEIGHTS, Frames, Sketch
from .chart import Chart, height_of, layout, line_style


def moving_chart(sketch: Sketch, frames: Frames) -> Chart:
    """Draw a sketch at the first frame."""
    figure = go.Figure(layout=layout(height_of(sketch.height)))
    figure.update_layout(hovermode="closest", margin_r=30, showlegend=len(sketch.moving) > 1)
    figure.update_xaxes(
        range=list(sketch.x), title_text=f"position along the beam x [{sketch.along.name}]",
        visible=sketch.rest is not None,
    )  # fmt: skip
    figure.update_yaxes(range=list(sketch.y), title_text=f"{sketch.quantity} [{sketch.unit.name}]", zeroline=False)
    for block in sketch.blocks:
        corners = {"x0": block.left, "x1": block.right, "y0": block.bottom, "y1": block.top}
        figure.add_shape(type="rect", **corners, line={"width": 0.0}, fillcolor=STONE, layer="below")
    if sketch.rest is not None:
        dotted = {"color": GREY, "width": 1.0, "dash": "dot"}
        figure.add_shape(type="line", x0=sketch.rest[0], x1=sketch.rest[1], y0=0.0, y1=0.0, line=dotted)
    begin, end = sketch.level_ends
    for symbol, level in sketch.levels.items():
        figure.add_shape(type="line", x0=begin, x1=end, y0=level, y1=level, line=line_style(LEVELS[symbol]))
        figure.add_annotation(x=end, y=level, text=symbol, showarrow=False, xanchor="left", xshift=3)
    for part, x, look in sketch.moving:
        figure.add_scatter(
            x=x, y=sketch.unit.factor * frames.heights(part, 0), mode="lines", meta=part, name=look.words,
            line=line_style(look), hoverinfo="skip" if part == "coil" else None,
            hovertemplate=None if part == "coil" else f"%{{y:.6g}} {sketch.unit.name}",
        )  # fmt: skip
    return Chart(sketch.name, sketch.heading, figure)


def moving_parts(frames: Frames, sketch: Sketch) -> dict[str, Any]:
    """Return what the page's script needs to move the chart of ``sketch``: its traces by part, factor of heights."""
    return {
        "factor": sketch.unit.factor,
        "traces": [moving.part for moving in sketch.moving],
        "foot": frames.foot,
        "heights": COIL_HEIGHTS.tolist(),
    }
