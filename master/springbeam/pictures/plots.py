"""Pictures of a run, after the sub-figures (A)–(E) of Ahn & Tate's Figures 2–5.

Besides colours, lines differ in width or dashes and events in shape, so that the pictures survive a black-and-white
printer.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from ..results.directory import PICTURES
from ..results.trajectory import Trajectory
from ..scene.statics import SHAPE_POINTS
from .drawing import (
    BLACK,
    ENERGIES,
    GREY,
    IMPULSE_MARKERS,
    IMPULSES,
    LEVEL_LINES,
    POSITIONS,
    VELOCITIES,
    VERMILLION,
    Look,
    Unit,
    alternates,
    decimated,
    first_contact_time,
    forces_of,
    gap_look,
    impulses,
    length_along,
    level_side,
    levels,
    much_smaller,
    present,
    present_and_not_zero,
    readable_unit,
    relative_residual,
    sizes_beside_the_largest,
    stackable,
    too_small,
)
from .timeline import DPI, REMARK, STYLE, Timeline, figure_for, key, line_style, note

_SHAPES_EARLY, _SHAPES_LATER = 20, 24
#: Early to late, dark to light, but not so light that a line is lost on paper.
_CLOCK = ListedColormap(matplotlib.colormaps["cividis"](np.linspace(0.0, 0.9, 256)), "clock")


def plot_run(trajectory: Trajectory, directory: str | Path) -> list[Path]:
    """Draw the pictures `springbeam.results.directory.PICTURES` that the scene has something to show for.

    Parameters
    ----------
    trajectory
        Any run, also one that stopped early; with fewer than two rows there is nothing to draw.
    directory
        Where the PNG files go; it must exist.

    Returns
    -------
    list of Path
        The files written.
    """
    written = []
    with matplotlib.rc_context(STYLE):
        for name, file in zip(_drawings(), PICTURES, strict=True):
            figure = _drawn(trajectory, name)
            if figure is not None:
                path = Path(directory) / file
                figure.savefig(path, dpi=DPI)
                written.append(path)
    return written


def figure_of(trajectory: Trajectory, picture: str) -> Figure:
    """Return the picture of that name; see `springbeam.Trajectory.plot`."""
    if picture not in _drawings():
        raise ValueError(f"no picture {picture!r}; there are {', '.join(_drawings())}")
    with matplotlib.rc_context(STYLE):
        figure = _drawn(trajectory, picture)
    if figure is None:
        raise ValueError(f"the run has nothing to show of {picture!r}")
    return figure


def _drawings() -> dict[str, Callable[[Trajectory], Figure | None]]:
    """Return what draws each picture, in the order of `PICTURES`."""
    return {
        "shapes_after_contact": _shapes_after_contact,
        "shapes_later": _shapes_later,
        "positions": _positions,
        "velocities_and_forces": _velocities_and_forces,
        "gap_and_energy": _gap_and_energy,
    }


def _drawn(trajectory: Trajectory, picture: str) -> Figure | None:
    if len(trajectory) < 2 or trajectory["time"][-1] <= trajectory["time"][0]:
        return None
    return _drawings()[picture](trajectory)


def _visible(ax: Axes, trajectory: Trajectory, looks: Mapping[str, Look], unit: str) -> list[str]:
    """Return the columns that can be seen beside the largest; the others are named beside the panel."""
    seen, unseen = sizes_beside_the_largest(trajectory, looks)
    if unseen:
        note(ax, "too small to draw:\n" + "\n".join(too_small(unseen, looks, unit)))
    return seen


# -- (A), (B): the beam's shape -----------------------------------------------------------------------------------


def _shapes_after_contact(trajectory: Trajectory) -> Figure | None:
    if trajectory.shapes is None:
        return None
    times, shapes = trajectory.shapes
    first = int(np.searchsorted(times, first_contact_time(trajectory)))
    times, shapes = times[first : first + _SHAPES_EARLY], shapes[first : first + _SHAPES_EARLY]
    if len(times) < 2:
        return None
    figure = figure_for(trajectory, "(A) The beam right after first contact", 3.6)
    left, right = figure.subplots(1, 2)
    steps = np.diff(times)
    some = steps > 1e-6 * np.max(steps, initial=0.0)  # between rows of one event Δu is rounding
    velocities = np.diff(shapes, axis=0)[some] / steps[some, None]
    _curves(figure, left, trajectory, times, shapes, "deflection u", "m", bar=False)
    _levels(left, trajectory, readable_unit([shapes], "m"))
    middles = 0.5 * (times[1:] + times[:-1])[some]
    _curves(figure, right, trajectory, middles, velocities, "mean velocity Δu/Δt", "m/s", bar=True)
    seen = (trajectory["time"] >= times[0]) & (trajectory["time"] <= times[-1])
    fastest = float(np.max(np.abs(trajectory["v_tip"][seen]), initial=0.0))
    if fastest > 3.0 * float(np.max(np.abs(velocities))):
        unit = readable_unit([np.array([fastest])], "m/s")
        right.set_title(
            f"mean from shape to shape; the tip's own velocity reaches {unit.factor * fastest:.2g} {unit.name}:\n"
            "the motion is faster than the steps",
            **REMARK,
        )
    return figure


def _shapes_later(trajectory: Trajectory) -> Figure | None:
    if trajectory.shapes is None:
        return None
    times, shapes = trajectory.shapes
    first = int(np.searchsorted(times, first_contact_time(trajectory)))
    times, shapes = times[first:], shapes[first:]
    if len(times) < _SHAPES_EARLY:
        return None
    figure = figure_for(trajectory, "(B) Subsequent motion of the beam", 3.6)
    left, right = figure.subplots(1, 2, gridspec_kw={"wspace": 0.06})
    jumpy = alternates(shapes[:, -1])
    # Of shapes that alternate, evenly spaced ones may all be of one kind: pairs show both.
    wanted = np.linspace(times[0], times[-1], _SHAPES_LATER // 2 if jumpy else _SHAPES_LATER)
    some = np.searchsorted(times, wanted)
    some = np.unique((np.append(some, some + 1) if jumpy else some).clip(max=len(times) - 1))
    _curves(figure, left, trajectory, times[some], shapes[some], "deflection u", "m", bar=True)
    _levels(left, trajectory, readable_unit([shapes[some]], "m"))
    _map(figure, right, trajectory, times, shapes)
    if jumpy:
        left.set_title("pairs of successive shapes: they alternate\nfrom step to step", **REMARK)
    return figure


def _curves(
    figure: Figure,
    ax: Axes,
    trajectory: Trajectory,
    times: np.ndarray,
    curves: np.ndarray,
    what: str,
    unit: str,
    *,
    bar: bool,
) -> None:
    """Draw curves over x, coloured from early (dark) to late."""
    readable, clock = readable_unit([curves], unit), readable_unit([times], "s")
    x, length = _positions_along(trajectory)
    norm = Normalize(clock.factor * times[0], clock.factor * times[-1])
    lines = [np.column_stack([x, readable.factor * curve]) for curve in curves]
    ax.add_collection(LineCollection(lines, array=clock.factor * times, cmap=_CLOCK, norm=norm, linewidths=1.0))
    ax.axhline(0.0, color=GREY, lw=0.5, zorder=0)
    ax.set_xlim(x[0], x[-1])
    ax.set_xlabel(f"position along the beam x [{length.name}]")
    ax.set_ylabel(f"{what} [{readable.name}]")
    ax.autoscale_view(scalex=False)
    if bar:
        mappable = ScalarMappable(norm, _CLOCK)
        figure.colorbar(mappable, ax=ax, label=f"time t [{clock.name}]", pad=0.05, aspect=30)


def _map(figure: Figure, ax: Axes, trajectory: Trajectory, times: np.ndarray, shapes: np.ndarray) -> None:
    """Draw the deflection over x and t."""
    readable, clock = readable_unit([shapes], "m"), readable_unit([times], "s")
    x, length = _positions_along(trajectory)
    distinct = np.r_[True, np.diff(times) > 0.0]
    times, shapes = times[distinct], shapes[distinct]
    largest = readable.factor * float(np.max(np.abs(shapes))) or 1.0
    mesh = ax.pcolormesh(x, clock.factor * times, readable.factor * shapes, cmap="PuOr", vmin=-largest, vmax=largest,
                         shading="gouraud", rasterized=True)  # fmt: skip
    ax.set_xlabel(f"position along the beam x [{length.name}]")
    ax.set_ylabel(f"time t [{clock.name}]")
    figure.colorbar(mesh, ax=ax, label=f"deflection u [{readable.name}]", pad=0.02, aspect=30)


def _positions_along(trajectory: Trajectory) -> tuple[np.ndarray, Unit]:
    unit, length = length_along(trajectory.scene)
    return length * SHAPE_POINTS, unit


def _levels(ax: Axes, trajectory: Trajectory, unit: Unit, *, whole_width: bool = False) -> None:
    """Draw Ψ and φ, across the panel or as ticks at the tip, unless what moves is tiny beside their distance."""
    low, high = ax.get_ylim()
    reach = 1.5 * (high - low)
    seen = {
        symbol: unit.factor * value
        for symbol, value in levels(trajectory.scene).items()
        if low - reach <= unit.factor * value <= high + reach
    }
    for symbol, level in seen.items():
        ax.axhline(level, xmin=0.0 if whole_width else 0.93, color=BLACK, zorder=1, **line_style(LEVEL_LINES[symbol]))
        # One above and one below: however near the two levels are, their names are apart.
        side: str = level_side(symbol, seen)
        place: dict[str, Any] = {"xytext": (3.0, 0.0), "va": side}
        if whole_width:  # beside the panel is the key
            place = {
                "xytext": (-2.0, -1.5 if side == "top" else 1.5),
                "ha": "right",
                "va": side.replace("center", "bottom"),
            }
        ax.annotate(symbol, (1.0, level), xycoords=("axes fraction", "data"), textcoords="offset points", fontsize=8.0,
                    **place)  # fmt: skip


# -- (C), (D), (E): over time -------------------------------------------------------------------------------------


def _positions(trajectory: Trajectory) -> Figure | None:
    positions = present(trajectory, POSITIONS)
    speeds = present(trajectory, VELOCITIES)[:1]
    whose = "beam's tip" if "v_tip" in speeds else "spring's top"
    title = "(C) Positions, and velocity" if len(positions) > 1 else "(C) Position and velocity"
    hidden = much_smaller(trajectory, positions)
    timeline = Timeline.of(trajectory, f"{title} of the {whose}", [2.4] + [1.2] * bool(hidden) + [1.6])
    above, *close, below = timeline.axes
    unit = readable_unit([trajectory[name] for name in positions], "m")
    for name in positions:
        timeline.line(above, unit, name, POSITIONS[name])
    _levels(above, trajectory, unit, whole_width=True)
    above.set_ylabel(f"position [{unit.name}]")
    for ax, name in zip(close, hidden, strict=True):
        unit = readable_unit([trajectory[name]], "m")
        look = POSITIONS[name]
        timeline.line(ax, unit, name, look._replace(words=f"{look.words}, enlarged"), linewidth=1.0)
        ax.set_ylabel(f"position [{unit.name}]")
    _velocity_panel(timeline, below, speeds)
    for ax in timeline.axes:
        key(ax)
    return timeline.figure


def _velocity_panel(timeline: Timeline, ax: Axes, names: list[str]) -> None:
    unit = readable_unit([timeline.trajectory[name] for name in names], "m/s")
    ax.axhline(0.0, color=GREY, lw=0.5)
    for name in names:
        timeline.line(ax, unit, name, VELOCITIES[name])
    ax.set_ylabel(f"velocity [{unit.name}]")
    key(ax)


def _velocities_and_forces(trajectory: Trajectory) -> Figure | None:
    forces = list(forces_of(trajectory))
    speeds = present(trajectory, ["z"])
    struck = any(e.impulse_contact != 0.0 or e.impulse_foundation != 0.0 for e in trajectory.events)
    panels = [1.6] * bool(speeds) + [2.0] * bool(forces) + [1.2] * struck
    if not forces and not struck:
        return None
    title = "(D) Velocity of the spring's top, and forces" if speeds else "(D) Forces"
    timeline = Timeline.of(trajectory, title, panels)
    axes = iter(timeline.axes)
    if speeds:
        _velocity_panel(timeline, next(axes), speeds)
    if forces:
        _force_panel(timeline, next(axes), forces)
    if struck:
        _impulse_panel(timeline, next(axes))
    return timeline.figure


def _force_panel(timeline: Timeline, ax: Axes, names: list[str]) -> None:
    trajectory = timeline.trajectory
    unit = readable_unit([trajectory[name] for name in names], "N")
    ax.axhline(0.0, color=GREY, lw=0.5)
    looks = forces_of(trajectory)
    for name in _visible(ax, trajectory, {name: looks[name] for name in names}, "N"):
        timeline.line(ax, unit, name, looks[name])
    ax.set_ylabel(f"force [{unit.name}]")
    key(ax)


def _impulse_panel(timeline: Timeline, ax: Axes) -> None:
    found, unit, foot = impulses(timeline.trajectory)
    for name, points in found.items():
        (colour, label), marker = IMPULSES[name], IMPULSE_MARKERS[name]
        t, j = timeline.unit.factor * points[:, 0], unit.factor * points[:, 1]
        ax.vlines(t, foot or 0.0, j, color=colour, lw=1.0)
        face = "none" if marker.sign == "○" else colour
        ax.plot(t, j, color=colour, linestyle="none", label=label, marker=marker.matplotlib, markersize=marker.size,
                markerfacecolor=face)  # fmt: skip
    if foot is None:
        ax.axhline(0.0, color=GREY, lw=0.5)
    else:
        ax.set_yscale("log")
        ax.set_ylim(foot, 2.0 * max(float(np.max(points[:, 1])) for points in found.values()))
    ax.set_ylabel(f"impulse [{unit.name}]")
    key(ax)


def _gap_and_energy(trajectory: Trajectory) -> Figure | None:
    gap = present(trajectory, ["gap"])
    title = "(E) Gap and energy" if gap else "(E) Energy"
    timeline = Timeline.of(trajectory, title, [1.5] * bool(gap) + [2.2, 1.4])
    *above, energies, residual = timeline.axes
    if gap:
        unit = readable_unit([trajectory["gap"]], "m")
        above[0].axhline(0.0, color=GREY, lw=0.5)
        timeline.line(above[0], unit, "gap", gap_look(trajectory))
        above[0].set_ylabel(f"gap [{unit.name}]")
        key(above[0])
    _energy_panel(timeline, energies)
    _residual_panel(timeline, residual)
    return timeline.figure


def _energy_panel(timeline: Timeline, ax: Axes) -> None:
    """Draw the energies stacked where no part is negative, else as lines."""
    trajectory = timeline.trajectory
    there = {name: ENERGIES[name] for name in present_and_not_zero(trajectory, ENERGIES)}
    parts = _visible(ax, trajectory, there, "J") if there else []
    unit = readable_unit([trajectory["e_total"], *(trajectory[name] for name in parts)], "J")
    if stackable(trajectory, parts):
        rows = decimated(trajectory["time"], trajectory[parts[0]])
        ax.stackplot(
            timeline.unit.factor * trajectory["time"][rows],
            *(unit.factor * np.maximum(trajectory[name][rows], 0.0) for name in parts),
            colors=[ENERGIES[name].colour for name in parts],
            labels=[ENERGIES[name].words for name in parts],
            linewidth=0.0,
        )
        ax.set_ylim(bottom=0.0)
    else:
        for name in parts:
            timeline.line(ax, unit, name, ENERGIES[name])
    timeline.line(ax, unit, "e_total", Look(BLACK, "total"))
    ax.set_ylabel(f"energy [{unit.name}]")
    key(ax)


def _residual_panel(timeline: Timeline, ax: Axes) -> None:
    rows, relative = relative_residual(timeline.trajectory)
    ax.plot(timeline.unit.factor * timeline.trajectory["time"][rows], relative, color=VERMILLION, lw=0.8)
    if len(rows):
        ax.set_yscale("log")
        ax.set_ylim(0.3 * max(float(np.min(relative)), 1e-18), 5.0 * float(np.max(relative)))
        ax.yaxis.set_major_locator(LogLocator(numticks=6))
    else:
        note(ax, "zero throughout")
    ax.set_ylabel("energy residual\n/ largest energy [–]")
