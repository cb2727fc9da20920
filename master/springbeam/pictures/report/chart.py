"""A chart of the report: a plotly figure with its heading, and how lines and markers look in it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import plotly.graph_objects as go

from ..drawing import BLACK, GREY, Look, Marker

_GRID = "#E3E3E3"
#: Pixels of the page for a point of the pictures.
_PIXELS = 1.8
#: Pixels of a chart's height: for each inch of its picture, and for what stands around it.
_PIXELS_PER_INCH, _PIXELS_BESIDE = 82, 110


def line_style(look: Look) -> dict[str, Any]:
    """Return plotly's ``line``."""
    width = round(_PIXELS * look.line.width, 1)
    return {"color": look.colour, "width": width, "dash": "dash" if look.line.dashed else "solid"}


def marker_style(marker: Marker) -> dict[str, Any]:
    """Return plotly's ``marker`` but for its colour."""
    return {"symbol": marker.plotly, "size": round(_PIXELS * marker.size)}


@dataclass
class Chart:
    """A figure with its heading, and remarks to print beside it."""

    name: str
    heading: str
    figure: go.Figure
    remarks: list[str] = field(default_factory=list)
    #: Rows drawn, the most of any curve.
    points: int = 0


def height_of(inches: float) -> int:
    """Return the height of a chart [px] whose picture has ``inches``."""
    return round(_PIXELS_BESIDE + _PIXELS_PER_INCH * inches)


def layout(height: int) -> dict[str, Any]:
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
