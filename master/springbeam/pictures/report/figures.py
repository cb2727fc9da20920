"""The charts of the report, as plotly figures: one over x that is animated, the others over a common time axis."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import plotly.graph_objects as go

from ...results.trajectory import Trajectory
from ...scene.statics import SHAPE_POINTS
from ..drawing import (
    BLACK,
    BLUE,
    ENERGIES,
    EVENT_LOOKS,
    FORCES,
    GREY,
    IMPULSES,
    OTHER_SHADES,
    PHASE_SHADES,
    PHASE_WORDS,
    POSITIONS,
    STONE,
    VELOCITIES,
    VERMILLION,
    Look,
    Unit,
    alternates,
    decimated,
    energy_scale,
    much_smaller,
    near_levels,
    phase_intervals,
    present,
    readable_unit,
    sizes_beside_the_largest,
    stackable,
    stem_foot,
)
from ..motion import COIL_ACROSS, COIL_HEIGHTS, COIL_WIDTH, STOP_WIDTH, Motion

ALTERNATES = "alternates from step to step"
#: More events than this are not drawn through the charts.
_MANY_EVENTS = 60
#: What tells lines apart besides their colour.
_LINES: dict[str, dict[str, Any]] = {
    "u_tip": {"width": 4.0},
    "y": {"width": 1.6},
    "v_tip": {"width": 2.6},
    "z": {"width": 1.2},
    "contact_force": {"width": 1.0},
    "contact_force_smoothed": {"width": 2.0},
    "compliance_force": {"width": 1.5, "dash": "dash"},
    "foundation_force": {"width": 1.5},
    "e_total": {"width": 2.0, "dash": "dash"},
}
_EVENT_SYMBOLS = {
    "impact": "triangle-down",
    "stop_impact": "triangle-up",
    "release": "circle",
    "retie": "square",
    "separation": "diamond",
    "seated": "triangle-left",
    "unseated": "triangle-right",
}
_EVENT_SIGNS = {
    "triangle-down": "▼",
    "triangle-up": "▲",
    "circle": "●",
    "square": "■",
    "diamond": "◆",
    "triangle-left": "◀",
    "triangle-right": "▶",
}
#: Of a beam on a stop both are equal: one within the other.
_IMPULSE_MARKERS: dict[str, dict[str, Any]] = {
    "impulse_contact": {"symbol": "circle-open", "size": 10},
    "impulse_foundation": {"symbol": "triangle-up", "size": 6},
}
_GRID = "#E3E3E3"


@dataclass
class Chart:
    """A figure with its heading, and remarks to print beside it."""

    name: str
    heading: str
    figure: go.Figure
    remarks: list[str] = field(default_factory=list)
    #: Rows drawn, the most of any curve.
    points: int = 0


def time_unit(trajectory: Trajectory) -> Unit:
    return readable_unit([trajectory["time"]], "s")


def charts(trajectory: Trajectory) -> list[Chart]:
    """The charts over time that the run has something to show for, in the order of the page.

    Parameters
    ----------
    trajectory
        A run of at least two rows at different times.
    """
    columns, events = trajectory.columns, trajectory.events
    found = []
    if events or set(columns["phase"]) != {"free"}:
        found.append(_timeline(trajectory))
    positions = present(trajectory, POSITIONS)
    found.append(_lines(trajectory, "positions", "Positions", POSITIONS, "position", "m"))
    _add_levels(found[-1], trajectory)
    found += [
        _lines(
            trajectory,
            f"position-{name}",
            "The smaller one, enlarged",
            {name: POSITIONS[name]},
            "position",
            "m",
            width=1.5,
        )
        for name in much_smaller(trajectory, positions)
    ]
    found.append(_lines(trajectory, "velocities", "Velocities", VELOCITIES, "velocity", "m/s"))
    forces = {name: look for name, look in FORCES.items() if name in columns and np.any(columns[name] != 0.0)}
    if forces:
        found.append(_lines(trajectory, "forces", "Forces", forces, "force", "N", seen=True))
    if any(event.impulse_contact != 0.0 or event.impulse_foundation != 0.0 for event in events):
        found.append(_impulses(trajectory))
    if "gap" in columns:
        gap = Look(BLUE, "u(t, L) − y" if "y" in columns else "u(t, L) − φ")
        found.append(_lines(trajectory, "gap", "Gap", {"gap": gap}, "gap", "m"))
    found += [_energies(trajectory), _residual(trajectory)]
    return found


# -- over time ----------------------------------------------------------------------------------------------------


def backdrop(trajectory: Trajectory) -> list[dict[str, Any]]:
    """Layout shapes for every chart over time: phases shaded and, unless there are many, events as lines."""
    factor = time_unit(trajectory).factor
    shared: dict[str, Any] = {"type": "path", "xref": "x", "yref": "paper", "layer": "below"}
    shapes = [
        {
            **shared,
            "path": "".join(f"M{factor * start!r},0V1H{factor * end!r}V0Z" for start, end in spans),
            "fillcolor": colour,
            "line": {"width": 0.0},
        }
        for colour, _, spans in _shades(trajectory)
    ]
    if len(trajectory.events) <= _MANY_EVENTS:
        for kind, look in EVENT_LOOKS.items():
            times = [factor * event.time for event in trajectory.events if event.kind == kind]
            if times:
                path = "".join(f"M{time!r},0V1" for time in times)
                shapes.append({**shared, "path": path, "line": {"width": 1.0, "color": look.colour}, "opacity": 0.45})
    return shapes


def phase_key(trajectory: Trajectory) -> list[Look]:
    """Shade and words of each phase of the run; none if it is free throughout."""
    return [Look(colour, PHASE_WORDS.get(phase, phase)) for colour, phase, _ in _shades(trajectory)]


def event_key(trajectory: Trajectory) -> list[tuple[str, Look]]:
    """Mark and look of each kind of event that happened, its words with how often."""
    counts = Counter(event.kind for event in trajectory.events)
    return [
        (_EVENT_SIGNS[_EVENT_SYMBOLS[kind]], look._replace(words=f"{look.words} ({counts[kind]})"))
        for kind, look in EVENT_LOOKS.items()
        if counts[kind]
    ]


def _shades(trajectory: Trajectory) -> list[tuple[str, str, list[tuple[float, float]]]]:
    """Colour, phase and intervals [s] of each phase."""
    spans: dict[str, list[tuple[float, float]]] = {}
    for phase, start, end in phase_intervals(trajectory["time"], trajectory["phase"]):
        spans.setdefault(phase, []).append((start, end))
    if spans.keys() == {"free"}:
        return []
    others = iter(OTHER_SHADES * len(spans))
    return [(PHASE_SHADES.get(phase) or next(others), phase, found) for phase, found in spans.items()]


def _chart(trajectory: Trajectory, name: str, heading: str, *, height: int = 230) -> Chart:
    """A chart without curves over the run's time."""
    unit = time_unit(trajectory)
    time = trajectory["time"]
    figure = go.Figure(layout=_layout(height))
    figure.update_xaxes(
        range=[unit.factor * float(time[0]), unit.factor * float(time[-1])], title_text=f"time t [{unit.name}]"
    )
    return Chart(name, heading, figure)


def _layout(height: int) -> dict[str, Any]:
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


def _curve(chart: Chart, trajectory: Trajectory, name: str, look: Look, unit: Unit, **line: Any) -> None:
    """A column over time; where it alternates from step to step, as dots on a faint line."""
    values = trajectory[name]
    rows = decimated(trajectory["time"], values)
    chart.points = max(chart.points, len(rows))
    style: dict[str, Any] = {
        "mode": "lines",
        "line": {"color": look.colour, **_LINES.get(name, {"width": 1.6}), **line},
    }
    if alternates(values):
        style = {
            "mode": "lines+markers",
            "line": {"color": look.colour, "width": 0.4},
            "marker": {"size": 2.5, "color": look.colour},
        }
        remark = f"{look.words} {ALTERNATES}"
        chart.remarks += [remark] if remark not in chart.remarks else []
    chart.figure.add_scatter(
        x=time_unit(trajectory).factor * trajectory["time"][rows],
        y=unit.factor * values[rows],
        name=look.words,
        meta=name,
        hovertemplate=f"%{{y:.6g}} {unit.name}",
        **style,
    )


def _lines(
    trajectory: Trajectory,
    name: str,
    heading: str,
    looks: Mapping[str, Look],
    quantity: str,
    unit: str,
    *,
    seen: bool = False,
    **style: Any,
) -> Chart:
    """Columns over time; ``seen``: only those that can be seen beside the largest, the others are named."""
    chart = _chart(trajectory, name, heading)
    names = present(trajectory, looks)
    if seen:
        names, unseen = sizes_beside_the_largest(trajectory, names)
        chart.remarks += _too_small(unseen, looks, unit)
    readable = readable_unit([trajectory[name] for name in names], unit)
    for column in names:
        _curve(chart, trajectory, column, looks[column], readable, **style)
    chart.figure.update_yaxes(title_text=f"{quantity} [{readable.name}]")
    return chart


def _add_levels(chart: Chart, trajectory: Trajectory) -> None:
    """Ψ and φ as lines over time, those that are near what moves."""
    values = [trajectory[name] for name in present(trajectory, POSITIONS)]
    unit = readable_unit(values, "m")
    time = time_unit(trajectory).factor * trajectory["time"][[0, -1]]
    for symbol, height in near_levels(trajectory.scene, values).items():
        line = {"color": BLACK, "width": 1.2 if symbol == "φ" else 1.0, "dash": "solid" if symbol == "φ" else "dash"}
        words = "foundation φ" if symbol == "φ" else "rest of the spring Ψ"
        chart.figure.add_scatter(
            x=time, y=unit.factor * np.array([height, height]), mode="lines", line=line, name=words, hoverinfo="skip"
        )


def _too_small(unseen: Mapping[str, float], looks: Mapping[str, Look], unit: str) -> list[str]:
    words = ", ".join(f"{looks[name].words} ≤ {size:.2g} {unit}" for name, size in unseen.items())
    return [f"too small to draw: {words}"] if words else []


def _timeline(trajectory: Trajectory) -> Chart:
    """Each kind of event in a row of its own; the phases are in the backdrop."""
    factor = time_unit(trajectory).factor
    kinds = [kind for kind in EVENT_LOOKS if any(event.kind == kind for event in trajectory.events)]
    chart = _chart(trajectory, "timeline", "Phases and events", height=76 + 18 * len(kinds))
    for i, kind in enumerate(kinds):
        events = [event for event in trajectory.events if event.kind == kind]
        times = np.array([event.time for event in events])
        rows = decimated(times, times)
        chart.points = max(chart.points, len(rows))
        losses = np.array([event.energy_loss for event in events])
        look = EVENT_LOOKS[kind]
        chart.figure.add_scatter(
            x=factor * times[rows],
            y=np.full(len(rows), -i),
            customdata=np.column_stack([times[rows], losses[rows]]),
            mode="markers",
            marker={"symbol": _EVENT_SYMBOLS[kind], "size": 8, "color": look.colour},
            name=look.words,
            meta=kind,
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


def _impulses(trajectory: Trajectory) -> Chart:
    chart = _chart(trajectory, "impulses", "Impulses", height=200)
    events = trajectory.events
    sizes = np.array([getattr(e, name) for e in events for name in IMPULSES if getattr(e, name) != 0.0])
    foot = stem_foot(sizes)
    unit = readable_unit([sizes], "N·s") if foot is None else Unit(1.0, "N·s")
    for name, look in IMPULSES.items():
        points = np.array([(e.time, getattr(e, name)) for e in events if getattr(e, name) != 0.0])
        if not len(points):
            continue
        points = points[decimated(points[:, 0], points[:, 1])]
        chart.points = max(chart.points, len(points))
        values = unit.factor * points[:, 1]
        chart.figure.add_scatter(
            x=time_unit(trajectory).factor * points[:, 0],
            y=values,
            error_y={
                "type": "data",
                "symmetric": False,
                "array": np.zeros(len(values)),
                "arrayminus": values - (foot or 0.0),
                "width": 0,
                "thickness": 1.5,
            },
            mode="markers",
            marker={**_IMPULSE_MARKERS[name], "color": look.colour},
            cliponaxis=False,
            name=look.words,
            meta=name,
            hovertemplate=f"%{{y:.6g}} {unit.name}",
        )  # fmt: skip
    if foot is not None:
        _logarithmic(chart, foot, 3.0 * float(np.max(sizes)))
    chart.figure.update_yaxes(title_text=f"impulse [{unit.name}]")
    return chart


def _logarithmic(chart: Chart, low: float, high: float) -> None:
    """A logarithmic axis from ``low`` to ``high`` with a handful of whole decades."""
    begin, end = float(np.log10(low)), float(np.log10(high))
    chart.figure.update_yaxes(
        type="log", range=[begin, end], tick0=0.0, dtick=max(1, round((end - begin) / 4.0)), exponentformat="e",
        zeroline=False,
    )  # fmt: skip


def _energies(trajectory: Trajectory) -> Chart:
    """Stacked where no part is negative, else lines."""
    chart = _chart(trajectory, "energies", "Energy ledger", height=290)
    there = [name for name in present(trajectory, ENERGIES) if np.any(trajectory[name] != 0.0)]
    parts, unseen = sizes_beside_the_largest(trajectory, there) if there else ([], {})
    chart.remarks += _too_small(unseen, ENERGIES, "J")
    unit = readable_unit([trajectory[name] for name in ["e_total", *parts]], "J")
    time = trajectory["time"]
    if stackable(trajectory, parts):
        rows = _rows_for_all([trajectory[name] for name in [*parts, "e_total"]], time)
        chart.points = len(rows)
        for name in parts:
            chart.figure.add_scatter(
                x=time_unit(trajectory).factor * time[rows],
                y=unit.factor * trajectory[name][rows],
                stackgroup="energy",
                mode="lines",
                line={"width": 0.0},
                fillcolor=ENERGIES[name].colour,
                name=ENERGIES[name].words,
                meta=name,
                hovertemplate=f"%{{y:.6g}} {unit.name}",
            )
    else:
        chart.heading += " (lines: a part is negative)"
        for name in parts:
            _curve(chart, trajectory, name, ENERGIES[name], unit)
    _curve(chart, trajectory, "e_total", Look(BLACK, "total"), unit)
    chart.figure.update_yaxes(title_text=f"energy [{unit.name}]")
    return chart


def _rows_for_all(columns: Iterable[np.ndarray], time: np.ndarray) -> np.ndarray:
    return np.unique(np.concatenate([decimated(time, values) for values in columns]))


def _residual(trajectory: Trajectory) -> Chart:
    chart = _chart(trajectory, "residual", "Energy residual", height=190)
    chart.remarks.append("what the sum of all energies has changed by since the start, relative to the largest energy")
    relative = np.abs(trajectory["energy_residual"]) / energy_scale(trajectory)
    rows = decimated(trajectory["time"], relative)
    rows = rows[relative[rows] > 0.0]
    chart.points = len(rows)
    chart.figure.add_scatter(
        x=time_unit(trajectory).factor * trajectory["time"][rows],
        y=relative[rows],
        mode="lines",
        line={"color": VERMILLION, "width": 1.2},
        name="residual",
        meta="energy_residual",
        hovertemplate="%{y:.3g}",
    )
    if len(rows):
        _logarithmic(chart, 0.3 * max(float(np.min(relative[rows])), 1e-18), 3.0 * float(np.max(relative[rows])))
    else:
        chart.remarks.append("zero throughout")
    chart.figure.update_layout(showlegend=False)
    chart.figure.update_yaxes(title_text="relative [–]")
    return chart


# -- over x, animated ---------------------------------------------------------------------------------------------


def motions(trajectory: Trajectory, motion: Motion) -> list[Chart]:
    """Beam and spring at the first frame; the beam once more, enlarged, where its motion is lost in the spring's."""
    found = [_motion(trajectory, motion)]
    if motion.deflection is not None and "u_tip" in much_smaller(trajectory, present(trajectory, POSITIONS)):
        found.append(_beam_enlarged(trajectory, motion))
    return found


def motion_units(trajectory: Trajectory, motion: Motion) -> list[Unit]:
    """Units of the heights in `motions`."""
    whole = readable_unit([np.array([motion.low, motion.high])], "m")
    return [whole] if motion.deflection is None else [whole, readable_unit([motion.deflection], "m")]


def _motion(trajectory: Trajectory, motion: Motion) -> Chart:
    unit = motion_units(trajectory, motion)[0]
    beam = trajectory.scene.beam
    along = readable_unit([np.array([beam.length])], "m") if beam is not None else Unit(1.0, "m")
    length = along.factor * (beam.length if beam is not None else 1.0)
    chart = Chart("motion", "Motion", go.Figure(layout=_layout(380)))
    figure = chart.figure
    low, high = unit.factor * motion.low, unit.factor * motion.high
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
    for symbol, value in motion.levels.items():
        level = unit.factor * value
        where = {"x0": length * (1.0 - STOP_WIDTH), "x1": length * (1.0 + STOP_WIDTH), "y1": level}
        if symbol == "φ":
            # Two blocks where a spring stands between them.
            inner = 1.2 * COIL_WIDTH * length if motion.y is not None else 0.0
            for side in (-1.0, 1.0):
                edges = {"x0": length + side * inner, "x1": length * (1.0 + side * STOP_WIDTH)}
                figure.add_shape(**solid, **edges, y0=low, y1=level)
            figure.add_shape(type="line", **where, y0=level, line={"color": BLACK, "width": 1.0})
        else:
            figure.add_shape(type="line", **where, y0=level, line={"color": BLACK, "width": 1.0, "dash": "dash"})
        figure.add_annotation(x=where["x1"], y=level, text=symbol, showarrow=False, xanchor="left", xshift=3)
    if motion.y is not None:
        half = COIL_WIDTH * length
        figure.add_scatter(
            x=length + half * COIL_ACROSS, y=unit.factor * motion.coil(0), mode="lines", meta="coil",
            line={"color": VERMILLION, "width": 2.0}, name="spring", hoverinfo="skip",
        )  # fmt: skip
        figure.add_scatter(
            x=[length - 1.6 * half, length + 1.6 * half], y=[unit.factor * motion.y[0]] * 2, mode="lines", meta="top",
            line={"color": VERMILLION, "width": 5.0}, name="its top y", hovertemplate=f"%{{y:.6g}} {unit.name}",
        )  # fmt: skip
    if motion.deflection is not None:
        _add_beam(figure, motion, length, unit)
    return chart


def _beam_enlarged(trajectory: Trajectory, motion: Motion) -> Chart:
    unit = motion_units(trajectory, motion)[1]
    assert trajectory.scene.beam is not None
    assert motion.deflection is not None
    along = readable_unit([np.array([trajectory.scene.beam.length])], "m")
    length = along.factor * trajectory.scene.beam.length
    chart = Chart("motion-beam", "The beam alone, enlarged", go.Figure(layout=_layout(240)))
    reach = 1.1 * unit.factor * float(np.max(np.abs(motion.deflection)))
    chart.figure.update_layout(hovermode="closest", margin_r=30, showlegend=False)
    chart.figure.update_xaxes(
        range=[-0.02 * length, 1.12 * length], title_text=f"position along the beam x [{along.name}]"
    )
    chart.figure.update_yaxes(title_text=f"deflection u [{unit.name}]", range=[-reach, reach])
    _add_beam(chart.figure, motion, length, unit)
    return chart


def _add_beam(figure: go.Figure, motion: Motion, length: float, unit: Unit) -> None:
    assert motion.deflection is not None
    figure.add_scatter(
        x=length * SHAPE_POINTS, y=unit.factor * motion.deflection[0], mode="lines", meta="beam",
        line={"color": BLUE, "width": 5.0}, name="beam u", hovertemplate=f"%{{y:.6g}} {unit.name}",
    )  # fmt: skip


def moving_parts(trajectory: Trajectory, motion: Motion, chart: Chart) -> dict[str, Any]:
    """What the page's script needs to move a chart of `motions`: traces by part, and how heights become drawn ones."""
    units = motion_units(trajectory, motion)
    unit = units[0] if chart.name == "motion" else units[1]
    parts = [trace.meta for trace in chart.figure.data]
    return {
        "factor": unit.factor,
        "traces": parts,
        "foot": motion.foot,
        "heights": COIL_HEIGHTS.tolist(),
    }
