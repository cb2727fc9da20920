"""The charts of the report over a common time axis, and what is drawn behind all of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np
import plotly.graph_objects as go

from ...results.trajectory import Trajectory
from ..drawing import (
    ALTERNATES,
    BLACK,
    ENERGIES,
    EVENT_LOOKS,
    EVENT_MARKERS,
    IMPULSE_MARKERS,
    IMPULSES,
    LEVEL_LINES,
    LEVEL_WORDS,
    LINES,
    MANY_EVENTS,
    POSITIONS,
    VELOCITIES,
    VERMILLION,
    Line,
    Look,
    Unit,
    alternates,
    decimated,
    forces_of,
    gap_look,
    impulses,
    much_smaller,
    near_levels,
    present,
    present_and_not_zero,
    readable_unit,
    relative_residual,
    shaded_phases,
    sizes_beside_the_largest,
    stackable,
    too_small,
)
from .chart import Chart, layout, line_style, marker_style


def time_unit(trajectory: Trajectory) -> Unit:
    """Return the unit of the time axes."""
    return readable_unit([trajectory["time"]], "s")


def charts(trajectory: Trajectory) -> list[Chart]:
    """Return the charts over time that the run has something to show for, in the order of the page.

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
    for name in much_smaller(trajectory, positions):
        heading, look = "The smaller one, enlarged", {name: POSITIONS[name]}
        found.append(_lines(trajectory, f"position-{name}", heading, look, "position", "m", line=Line()))
    found.append(_lines(trajectory, "velocities", "Velocities", VELOCITIES, "velocity", "m/s"))
    if forces := forces_of(trajectory):
        found.append(_lines(trajectory, "forces", "Forces", forces, "force", "N", seen=True))
    if any(event.impulse_contact != 0.0 or event.impulse_foundation != 0.0 for event in events):
        found.append(_impulses(trajectory))
    if "gap" in columns:
        found.append(_lines(trajectory, "gap", "Gap", {"gap": gap_look(trajectory)}, "gap", "m"))
    found += [_energies(trajectory), _residual(trajectory)]
    return found


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
    if len(trajectory.events) <= MANY_EVENTS:
        for kind, look in EVENT_LOOKS.items():
            times = [factor * event.time for event in trajectory.events if event.kind == kind]
            if times:
                path = "".join(f"M{time!r},0V1" for time in times)
                shapes.append({**shared, "path": path, "line": {"width": 1.0, "color": look.colour}, "opacity": 0.45})
    return shapes


def phase_key(trajectory: Trajectory) -> list[Look]:
    """Return shade and words of each phase of the run; none if it is free throughout."""
    return [look for look, _ in shaded_phases(trajectory)]


def event_key(trajectory: Trajectory) -> list[tuple[str, Look]]:
    """Return sign and look of each kind of event that happened, its words with how often."""
    counts = Counter(event.kind for event in trajectory.events)
    return [
        (EVENT_MARKERS[kind].sign, look._replace(words=f"{look.words} ({counts[kind]})"))
        for kind, look in EVENT_LOOKS.items()
        if counts[kind]
    ]


def _chart(trajectory: Trajectory, name: str, heading: str, *, height: int = 230) -> Chart:
    """Return a chart without curves over the run's time."""
    unit = time_unit(trajectory)
    time = trajectory["time"]
    figure = go.Figure(layout=layout(height))
    figure.update_xaxes(
        range=[unit.factor * float(time[0]), unit.factor * float(time[-1])], title_text=f"time t [{unit.name}]"
    )
    return Chart(name, heading, figure)


def _curve(chart: Chart, trajectory: Trajectory, name: str, look: Look, unit: Unit, line: Line | None = None) -> None:
    """Draw a column over time; where it alternates from step to step, as dots on a faint line."""
    values = trajectory[name]
    rows = decimated(trajectory["time"], values)
    chart.points = max(chart.points, len(rows))
    line = line or LINES.get(name, Line())
    style: dict[str, Any] = {
        "mode": "lines",
        "line": {"color": look.colour, **line_style(line)},
        "opacity": line.opacity,
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
    line: Line | None = None,
) -> Chart:
    """Draw columns over time; ``seen``: only those that can be seen beside the largest, the others are named."""
    chart = _chart(trajectory, name, heading)
    names = present(trajectory, looks)
    if seen:
        names, unseen = sizes_beside_the_largest(trajectory, names)
        _remark_too_small(chart, unseen, looks, unit)
    readable = readable_unit([trajectory[name] for name in names], unit)
    for column in names:
        _curve(chart, trajectory, column, looks[column], readable, line)
    chart.figure.update_yaxes(title_text=f"{quantity} [{readable.name}]")
    return chart


def _add_levels(chart: Chart, trajectory: Trajectory) -> None:
    """Draw Ψ and φ as lines over time, those that are near what moves."""
    values = [trajectory[name] for name in present(trajectory, POSITIONS)]
    unit = readable_unit(values, "m")
    time = time_unit(trajectory).factor * trajectory["time"][[0, -1]]
    for symbol, height in near_levels(trajectory.scene, values).items():
        chart.figure.add_scatter(
            x=time, y=unit.factor * np.array([height, height]), mode="lines", name=LEVEL_WORDS[symbol],
            line={"color": BLACK, **line_style(LEVEL_LINES[symbol])}, hoverinfo="skip",
        )  # fmt: skip


def _remark_too_small(chart: Chart, unseen: Mapping[str, float], looks: Mapping[str, Look], unit: str) -> None:
    if unseen:
        chart.remarks.append("too small to draw: " + ", ".join(too_small(unseen, looks, unit)))


def _timeline(trajectory: Trajectory) -> Chart:
    """Draw each kind of event in a row of its own; the phases are in the backdrop."""
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
            marker={**marker_style(EVENT_MARKERS[kind]), "color": look.colour},
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
    found, unit, foot = impulses(trajectory)
    for name, every in found.items():
        look, points = IMPULSES[name], every[decimated(every[:, 0], every[:, 1])]
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
            marker={**marker_style(IMPULSE_MARKERS[name]), "color": look.colour},
            cliponaxis=False,
            name=look.words,
            meta=name,
            hovertemplate=f"%{{y:.6g}} {unit.name}",
        )  # fmt: skip
    if foot is not None:
        _logarithmic(chart, foot, 3.0 * max(float(np.max(points[:, 1])) for points in found.values()))
    chart.figure.update_yaxes(title_text=f"impulse [{unit.name}]")
    return chart


def _logarithmic(chart: Chart, low: float, high: float) -> None:
    """Make the axis logarithmic from ``low`` to ``high`` with a handful of whole decades."""
    begin, end = float(np.log10(low)), float(np.log10(high))
    chart.figure.update_yaxes(
        type="log", range=[begin, end], tick0=0.0, dtick=max(1, round((end - begin) / 4.0)), exponentformat="e",
        zeroline=False,
    )  # fmt: skip


def _energies(trajectory: Trajectory) -> Chart:
    """Draw the energies stacked where no part is negative, else as lines."""
    chart = _chart(trajectory, "energies", "Energy ledger", height=290)
    there = present_and_not_zero(trajectory, ENERGIES)
    parts, unseen = sizes_beside_the_largest(trajectory, there) if there else ([], {})
    _remark_too_small(chart, unseen, ENERGIES, "J")
    unit = readable_unit([trajectory[name] for name in ["e_total", *parts]], "J")
    time = trajectory["time"]
    if stackable(trajectory, parts):
        rows = np.unique(np.concatenate([decimated(time, trajectory[name]) for name in [*parts, "e_total"]]))
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


def _residual(trajectory: Trajectory) -> Chart:
    chart = _chart(trajectory, "residual", "Energy residual", height=190)
    chart.remarks.append("what the sum of all energies has changed by since the start, relative to the largest energy")
    rows, relative = relative_residual(trajectory)
    chart.points = len(rows)
    chart.figure.add_scatter(
        x=time_unit(trajectory).factor * trajectory["time"][rows],
        y=relative,
        mode="lines",
        line={"color": VERMILLION, "width": 1.2},
        name="residual",
        meta="energy_residual",
        hovertemplate="%{y:.3g}",
    )
    if len(rows):
        _logarithmic(chart, 0.3 * max(float(np.min(relative)), 1e-18), 3.0 * float(np.max(relative)))
    else:
        chart.remarks.append("zero throughout")
    chart.figure.update_layout(showlegend=False)
    chart.figure.update_yaxes(title_text="relative [–]")
    return chart
