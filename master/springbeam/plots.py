"""Pictures of a run, after the sub-figures (A)–(E) of Ahn & Tate's Figures 2–5.

Colours are those of Okabe and Ito, told apart with any colour vision; lines also differ in width or dashes, events in
shape, so that the pictures survive a black-and-white printer.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator

from .recording import PICTURES
from .trajectory import EVENT_KINDS, SHAPE_POINTS, Trajectory

if TYPE_CHECKING:
    from .crosscheck import Report

BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
YELLOW, BLUE, VERMILLION, PURPLE = "#F0E442", "#0072B2", "#D55E00", "#CC79A7"
GREY = "#777777"

_PHASE_SHADES = {"free": "#FFFFFF", "tied": "#D6EAF7", "touch": "#FFF1B8", "seated": "#CFE8DD"}
_OTHER_SHADES = ("#EADCE7", "#E4E4E4", "#F7DCC8")
_PHASE_WORDS = {
    "free": "free",
    "tied": "tied (u = y < Ψ)",
    "touch": "touch (y ≥ Ψ)",
    "seated": "seated (at φ)",
}
#: Colour, marker and words of each kind of event.
_EVENT_MARKS: dict[str, tuple[str, str, str]] = {
    "impact": (VERMILLION, "v", "impact tip–spring"),
    "stop_impact": (BLACK, "^", "impact on foundation"),
    "release": (BLUE, "o", "release"),
    "retie": (PURPLE, "s", "retie"),
    "separation": (GREEN, "D", "separation"),
    "seated": (GREY, "<", "seated"),
    "unseated": (GREY, ">", "unseated"),
}
assert tuple(_EVENT_MARKS) == EVENT_KINDS

_STYLE: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "axes.labelsize": 9.0,
    "legend.fontsize": 8.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "lines.linewidth": 1.1,
    "lines.solid_joinstyle": "round",
    "axes.formatter.useoffset": False,
    "agg.path.chunksize": 10000,
}
_REMARK: dict[str, Any] = {"fontsize": 7.0, "style": "italic", "color": GREY}
_DPI = 160
_WIDTH = 8.2  # inches
#: Columns of pixels of a time axis, roughly; more points than a few per column cannot be seen.
_PIXEL_COLUMNS = 1000
_MANY_EVENTS = 60
_SHAPES_EARLY, _SHAPES_LATER = 20, 24
_MARK_HEIGHT, _MARK_ROW = 1.045, 0.04
_KEY_COLUMNS = 4
#: Forces and energies below this part of the largest one are not seen beside it.
_INVISIBLE = 5e-3
#: Early to late, dark to light, but not so light that a line is lost on paper.
_CLOCK = ListedColormap(matplotlib.colormaps["cividis"](np.linspace(0.0, 0.9, 256)), "clock")


def plot_run(trajectory: Trajectory, directory: str | Path) -> list[Path]:
    """Draw the pictures `springbeam.recording.PICTURES` that the scene has something to show for.

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
    if len(trajectory) < 2 or trajectory["time"][-1] <= trajectory["time"][0]:
        return []
    drawings: tuple[Callable[[Trajectory], Figure | None], ...] = (
        _shapes_after_contact,
        _shapes_later,
        _positions,
        _velocities_and_forces,
        _gap_and_energy,
    )
    written = []
    with matplotlib.rc_context(_STYLE):
        for name, draw in zip(PICTURES, drawings, strict=True):
            figure = draw(trajectory)
            if figure is not None:
                path = Path(directory) / name
                figure.savefig(path, dpi=_DPI)
                written.append(path)
    return written


def plot_crosscheck(report: Report, path: Path) -> None:
    """Co-simulation and reference in one picture, and every error below its bound."""
    trajectory, reference = report.trajectory, report.reference
    with matplotlib.rc_context(_STYLE):
        timeline = _Timeline.of(trajectory, "Co-simulation and reference", [2.2, 3.0])
        above, below = timeline.axes
        names = _present(trajectory, "u_tip", "y")
        unit = readable_unit([trajectory[name] for name in names], "m")
        for name, colour in zip(names, (BLUE, VERMILLION), strict=False):
            above.plot(
                timeline.unit.factor * trajectory["time"], unit.factor * trajectory[name],
                color=colour, lw=2.5, alpha=0.5, label=f"{name}, co-simulation",
            )  # fmt: skip
            above.plot(
                timeline.unit.factor * reference["time"], unit.factor * reference[name], color=BLACK, lw=0.7,
                label=f"{name}, reference",
            )  # fmt: skip
        above.set_ylabel(f"position [{unit.name}]")
        _key(above)
        colours = (BLUE, SKY, VERMILLION, ORANGE, GREEN, PURPLE, GREY)
        for row, colour in zip(report.rows, colours, strict=False):
            time = timeline.unit.factor * row.times
            below.semilogy(
                time, np.where(row.errors > 0.0, row.errors, np.nan), color=colour, lw=0.9, label=row.quantity
            )
            below.semilogy(time, row.bounds, color=colour, lw=0.9, ls=":")
        low = min((float(r.errors[r.errors > 0.0].min()) for r in report.rows if (r.errors > 0.0).any()), default=1e-16)
        high = max((float(max(r.errors.max(), r.bounds.max())) for r in report.rows), default=1.0)
        below.set_ylim(max(low, 1e-18), 10.0 * high)
        below.axvline(timeline.unit.factor * report.horizon, color=BLACK, lw=0.8, ls="--")
        below.set_ylabel("error (lines), bound (dots)\n[unit of the quantity]")
        _key(below)
        timeline.figure.savefig(path, dpi=_DPI)


# -- axes ---------------------------------------------------------------------------------------------------------


class Unit(NamedTuple):
    """A unit with an SI prefix: values are multiplied by ``factor`` before they are drawn."""

    factor: float
    name: str


def readable_unit(values: Iterable[np.ndarray], unit: str) -> Unit:
    """The prefix with which the largest of ``values`` reads well: 0.015 m as 15 mm, 4.5e9 J as 4.5 GJ."""
    largest = max((float(np.max(np.abs(v), initial=0.0)) for v in values), default=0.0)
    if largest == 0.0 or 0.1 <= largest < 1e4:
        return Unit(1.0, unit)
    power = min(max(int(np.floor(np.log10(largest) / 3.0)), -4), 4)
    return Unit(10.0 ** (-3 * power), f"{'pnµm kMGT'[power + 4].strip()}{unit}")


def decimated(time: np.ndarray, values: np.ndarray, columns: int = _PIXEL_COLUMNS) -> np.ndarray:
    """Indices of the rows to draw: of each of ``columns`` equal spans of time the first, last, lowest and highest.

    A line through them covers the same pixels as one through all rows. ``time`` does not decrease.
    """
    if len(time) <= 4 * columns:
        return np.arange(len(time))
    edges = np.searchsorted(time, np.linspace(time[0], time[-1], columns + 1)[1:-1])
    keep = []
    for span in np.split(np.arange(len(time)), edges):
        if len(span):
            part = values[span]
            keep += [span[0], span[int(np.argmin(part))], span[int(np.argmax(part))], span[-1]]
    return np.unique(keep)


def alternates(values: np.ndarray) -> bool:
    """Whether ``values`` mostly jump up and down from row to row: the steps are longer than what they should show."""
    if len(values) < 20:
        return False
    jumps = np.diff(values)
    reversals = np.mean(jumps[1:] * jumps[:-1] < 0.0)
    usual_range = np.subtract(*np.quantile(values, (0.95, 0.05)))
    return bool(reversals > 0.6 and np.mean(np.abs(jumps)) > 0.15 * usual_range)


def phase_intervals(
    time: np.ndarray, phase: np.ndarray, columns: int = _PIXEL_COLUMNS
) -> list[tuple[str, float, float]]:
    """``(phase, start, end)`` in turn; a row's phase holds until the next row.

    More intervals than can be seen are replaced by the phases at ``columns`` equally spaced times.
    """
    starts = np.flatnonzero(np.r_[True, phase[1:] != phase[:-1]])
    if len(starts) > columns:
        samples = np.linspace(time[0], time[-1], columns + 1)
        at = np.searchsorted(time, 0.5 * (samples[1:] + samples[:-1]), side="right") - 1
        return phase_intervals(samples, phase[np.append(at, at[-1])], columns + 1)
    ends = np.r_[time[starts[1:]], time[-1]]
    return [(str(phase[i]), float(time[i]), float(end)) for i, end in zip(starts, ends, strict=True) if end > time[i]]


@dataclass
class _Timeline:
    """A figure of panels over a common time axis, phases shaded and events marked."""

    trajectory: Trajectory
    figure: Figure
    axes: list[Axes]
    unit: Unit

    @classmethod
    def of(cls, trajectory: Trajectory, title: str, heights: Sequence[float]) -> _Timeline:
        figure = _figure(trajectory, title, 1.0 + sum(heights))
        axes = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0].tolist()
        unit = readable_unit([trajectory["time"]], "s")
        timeline = cls(trajectory, figure, axes, unit)
        axes[-1].set_xlabel(f"time t [{unit.name}]")
        axes[0].set_xlim(unit.factor * trajectory["time"][0], unit.factor * trajectory["time"][-1])
        keys: list[Patch | Line2D] = [*timeline._shade(), *timeline._mark_events()]
        # Legends fill column by column; these read row by row.
        keys = [key for column in range(_KEY_COLUMNS) for key in keys[column::_KEY_COLUMNS]]
        if keys:
            figure.legend(handles=keys, loc="outside lower left", ncols=_KEY_COLUMNS, frameon=False, columnspacing=1.4)
        return timeline

    def line(self, ax: Axes, unit: Unit, name: str, **style: Any) -> None:
        """A column over time; where it alternates from step to step, as dots on a faint line."""
        values = self.trajectory[name]
        rows = decimated(self.trajectory["time"], values)
        t, v = self.unit.factor * self.trajectory["time"][rows], unit.factor * values[rows]
        if alternates(values):
            style = {**style, "linewidth": 0.25, "marker": ".", "markersize": 1.6, "markeredgewidth": 0.0}
            _note(ax, "alternates from step\nto step: not resolved")
        ax.plot(t, v, **style)

    def _shade(self) -> list[Patch]:
        spans: dict[str, list[tuple[float, float]]] = {}
        for phase, start, end in phase_intervals(self.trajectory["time"], self.trajectory["phase"]):
            spans.setdefault(phase, []).append((self.unit.factor * start, self.unit.factor * (end - start)))
        others = iter(_OTHER_SHADES * len(spans))
        patches = []
        if spans.keys() == {"free"}:
            return []
        for phase, intervals in spans.items():
            colour = _PHASE_SHADES.get(phase) or next(others)
            for ax in self.axes:
                ax.broken_barh(
                    intervals, (0.0, 1.0), transform=ax.get_xaxis_transform(), color=colour, lw=0.0, zorder=0
                )
            patches.append(Patch(facecolor=colour, edgecolor=GREY, linewidth=0.5, label=_PHASE_WORDS.get(phase, phase)))
        return patches

    def _mark_events(self) -> list[Line2D]:
        """Marks above the first panel and lines through all; of many events only ticks, a row for each kind."""
        events = self.trajectory.events
        many = len(events) > _MANY_EVENTS
        handles: list[Line2D] = []
        for kind, (colour, marker, words) in _EVENT_MARKS.items():
            times = self.unit.factor * np.array([event.time for event in events if event.kind == kind])
            if not len(times):
                continue
            height = _MARK_HEIGHT + (_MARK_ROW * len(handles) if many else 0.0)
            look: dict[str, Any] = {"color": colour, "marker": "|" if many else marker, "markersize": 4.0, "ls": "none"}
            visible = times[decimated(times, times)]
            first = self.axes[0]
            first.plot(
                visible, np.full(len(visible), height), transform=first.get_xaxis_transform(), clip_on=False, **look
            )
            for ax in [] if many else self.axes:
                ax.vlines(
                    visible, 0.0, 1.0, transform=ax.get_xaxis_transform(), color=colour, lw=0.4, alpha=0.6, zorder=1
                )
            handles.append(Line2D([], [], label=f"{words} ({len(times)})", **look))
        return handles


def _figure(trajectory: Trajectory, title: str, height: float) -> Figure:
    figure = Figure(figsize=(_WIDTH, height), layout="constrained")
    FigureCanvasAgg(figure)
    scene = trajectory.scene.title
    figure.suptitle(f"{title}\n{scene}" if scene else title, fontsize=10.0, x=0.01, ha="left")
    return figure


def _key(ax: Axes) -> None:
    ax.legend(loc="upper left", bbox_to_anchor=(1.005, 1.0), frameon=False, borderaxespad=0.0, handlelength=1.6)


def _note(ax: Axes, text: str) -> None:
    """A remark beside the panel, under its key; once, however often it is made."""
    notes = [note for note in ax.texts if note.get_gid() == "note"]
    if not notes:
        ax.text(1.012, 0.0, text, transform=ax.transAxes, va="bottom", gid="note", **_REMARK)
    elif text not in notes[0].get_text():
        notes[0].set_text(f"{notes[0].get_text()}\n{text}")


def _visible(ax: Axes, trajectory: Trajectory, labels: Mapping[str, str], unit: str) -> list[str]:
    """The columns that can be seen beside the largest; the others are named beside the panel."""
    sizes = {name: float(np.max(np.abs(trajectory[name]))) for name in labels}
    seen = [name for name, size in sizes.items() if size >= _INVISIBLE * max(sizes.values())]
    unseen = [f"{labels[name]} ≤ {size:.2g} {unit}" for name, size in sizes.items() if size > 0.0 and name not in seen]
    if unseen:
        _note(ax, "too small to draw:\n" + "\n".join(unseen))
    return seen


# -- (A), (B): the beam's shape -----------------------------------------------------------------------------------


def _first_contact(trajectory: Trajectory) -> float:
    times = (event.time for event in trajectory.events if event.kind in ("impact", "stop_impact"))
    return next(times, float(trajectory["time"][0]))


def _shapes_after_contact(trajectory: Trajectory) -> Figure | None:
    if trajectory.shapes is None:
        return None
    times, shapes = trajectory.shapes
    first = int(np.searchsorted(times, _first_contact(trajectory)))
    times, shapes = times[first : first + _SHAPES_EARLY], shapes[first : first + _SHAPES_EARLY]
    if len(times) < 2:
        return None
    figure = _figure(trajectory, "(A) The beam right after first contact", 3.6)
    left, right = figure.subplots(1, 2)
    steps = np.diff(times)
    apart = steps > 1e-6 * np.max(steps, initial=0.0)  # between rows of one event Δu is rounding
    velocities = np.diff(shapes, axis=0)[apart] / steps[apart, None]
    _curves(figure, left, trajectory, times, shapes, "deflection u", "m", bar=False)
    _levels(left, trajectory, readable_unit([shapes], "m"))
    middles = 0.5 * (times[1:] + times[:-1])[apart]
    _curves(figure, right, trajectory, middles, velocities, "mean velocity Δu/Δt", "m/s", bar=True)
    seen = (trajectory["time"] >= times[0]) & (trajectory["time"] <= times[-1])
    fastest = float(np.max(np.abs(trajectory["v_tip"][seen]), initial=0.0))
    if fastest > 3.0 * float(np.max(np.abs(velocities[:, -1]))):
        unit = readable_unit([np.array([fastest])], "m/s")
        right.set_title(
            f"mean from shape to shape; the tip's own velocity reaches {unit.factor * fastest:.2g} {unit.name}:\n"
            "the motion is faster than the steps",
            **_REMARK,
        )
    return figure


def _shapes_later(trajectory: Trajectory) -> Figure | None:
    if trajectory.shapes is None:
        return None
    times, shapes = trajectory.shapes
    first = int(np.searchsorted(times, _first_contact(trajectory)))
    times, shapes = times[first:], shapes[first:]
    if len(times) < _SHAPES_EARLY:
        return None
    figure = _figure(trajectory, "(B) Subsequent motion of the beam", 3.6)
    left, right = figure.subplots(1, 2)
    jumpy = alternates(shapes[:, -1])
    # Of shapes that alternate, evenly spaced ones may all be of one kind: pairs show both.
    wanted = np.linspace(times[0], times[-1], _SHAPES_LATER // 2 if jumpy else _SHAPES_LATER)
    some = np.searchsorted(times, wanted)
    some = np.unique((np.append(some, some + 1) if jumpy else some).clip(max=len(times) - 1))
    _curves(figure, left, trajectory, times[some], shapes[some], "deflection u", "m", bar=True)
    _levels(left, trajectory, readable_unit([shapes[some]], "m"))
    _map(figure, right, trajectory, times, shapes)
    if jumpy:
        left.set_title("pairs of successive shapes: they alternate,\nthe motion is not resolved", **_REMARK)
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
    """Curves over x, coloured from early (dark) to late."""
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
    """Deflection over x and t."""
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
    assert trajectory.scene.beam is not None
    x = trajectory.scene.beam.length * SHAPE_POINTS
    unit = readable_unit([x], "m")
    return unit.factor * x, unit


def _levels(ax: Axes, trajectory: Trajectory, unit: Unit, *, whole_width: bool = False) -> None:
    """Ψ and φ, across the panel or as ticks at the tip, unless what moves is tiny beside their distance."""
    low, high = ax.get_ylim()
    reach = 1.5 * (high - low)
    for value, symbol, style in _level_values(trajectory):
        level = unit.factor * value
        if not low - reach <= level <= high + reach:
            continue
        ax.axhline(level, xmin=0.0 if whole_width else 0.93, color=BLACK, zorder=1, **style)
        place: dict[str, Any] = {"xytext": (3.0, 0.0), "va": "center"}
        if whole_width:  # beside the panel is the key
            place = {"xytext": (-2.0, 1.5), "ha": "right"}
        ax.annotate(symbol, (1.0, level), xycoords=("axes fraction", "data"), textcoords="offset points", fontsize=8.0,
                    **place)  # fmt: skip


def _level_values(trajectory: Trajectory) -> list[tuple[float, str, dict[str, Any]]]:
    scene, levels = trajectory.scene, []
    if scene.spring is not None:
        levels.append((scene.spring.equilibrium, "Ψ", {"lw": 0.8, "ls": (0, (4, 3))}))
    if scene.stop is not None:
        levels.append((scene.stop.position, "φ", {"lw": 1.3}))
    return levels


# -- (C), (D), (E): over time -------------------------------------------------------------------------------------

_LABELS: dict[str, tuple[str, dict[str, Any]]] = {
    "u_tip": ("tip u(t, L)", {"color": BLUE, "linewidth": 2.2, "alpha": 0.75}),
    "y": ("spring top y", {"color": VERMILLION, "linewidth": 0.9}),
    "v_tip": ("tip v(t, L)", {"color": BLUE}),
    "z": ("spring top z", {"color": VERMILLION}),
}


def _present(trajectory: Trajectory, *names: str) -> list[str]:
    return [name for name in names if name in trajectory.columns]


def _positions(trajectory: Trajectory) -> Figure | None:
    positions = _present(trajectory, "u_tip", "y")
    speeds = _present(trajectory, "v_tip") or _present(trajectory, "z")
    whose = "beam's tip" if "v_tip" in speeds else "spring's top"
    title = "(C) Positions, and velocity" if len(positions) > 1 else "(C) Position and velocity"
    hidden = _much_smaller(trajectory, positions)
    timeline = _Timeline.of(trajectory, f"{title} of the {whose}", [2.4] + [1.2] * bool(hidden) + [1.6])
    above, *close, below = timeline.axes
    unit = readable_unit([trajectory[name] for name in positions], "m")
    for name in positions:
        label, style = _LABELS[name]
        timeline.line(above, unit, name, label=label, **style)
    _levels(above, trajectory, unit, whole_width=True)
    above.set_ylabel(f"position [{unit.name}]")
    for ax, name in zip(close, hidden, strict=True):
        unit = readable_unit([trajectory[name]], "m")
        label, style = _LABELS[name]
        timeline.line(ax, unit, name, label=f"{label}, enlarged", **{**style, "linewidth": 1.0})
        ax.set_ylabel(f"position [{unit.name}]")
    _velocity_panel(timeline, below, speeds)
    for ax in timeline.axes:
        _key(ax)
    return timeline.figure


def _much_smaller(trajectory: Trajectory, names: list[str]) -> list[str]:
    """The one of two whose motion cannot be seen beside the other's, if it moves at all."""
    ranges = {name: float(np.ptp(trajectory[name])) for name in names}
    return [name for name, size in ranges.items() if 0.0 < size < 0.02 * max(ranges.values())]


def _velocity_panel(timeline: _Timeline, ax: Axes, names: list[str]) -> None:
    unit = readable_unit([timeline.trajectory[name] for name in names], "m/s")
    ax.axhline(0.0, color=GREY, lw=0.5)
    for name in names:
        label, style = _LABELS[name]
        timeline.line(ax, unit, name, label=label, **style)
    ax.set_ylabel(f"velocity [{unit.name}]")
    _key(ax)


_FORCES: dict[str, tuple[str, dict[str, Any]]] = {
    "contact_force": ("contact C, as applied", {"color": SKY, "linewidth": 0.7}),
    "contact_force_smoothed": ("contact C, smoothed", {"color": BLUE, "linewidth": 1.2}),
    "compliance_force": (r"part $\lambda_{nc}(\Psi-u)_+^p$", {"color": GREEN, "linewidth": 1.0, "linestyle": "--"}),
    "foundation_force": ("foundation N", {"color": BLACK, "linewidth": 0.9}),
}


def _velocities_and_forces(trajectory: Trajectory) -> Figure | None:
    forces = [name for name in _present(trajectory, *_FORCES) if np.any(trajectory[name] != 0.0)]
    speeds = _present(trajectory, "z")
    impulses = [e for e in trajectory.events if e.impulse_contact != 0.0 or e.impulse_foundation != 0.0]
    panels = [1.6] * bool(speeds) + [2.0] * bool(forces) + [1.2] * bool(impulses)
    if not forces and not impulses:
        return None
    title = "(D) Velocity of the spring's top, and forces" if speeds else "(D) Forces"
    timeline = _Timeline.of(trajectory, title, panels)
    axes = iter(timeline.axes)
    if speeds:
        _velocity_panel(timeline, next(axes), speeds)
    if forces:
        _force_panel(timeline, next(axes), forces)
    if impulses:
        _impulse_panel(timeline, next(axes))
    return timeline.figure


def _force_panel(timeline: _Timeline, ax: Axes, names: list[str]) -> None:
    trajectory = timeline.trajectory
    unit = readable_unit([trajectory[name] for name in names], "N")
    ax.axhline(0.0, color=GREY, lw=0.5)
    for name in _visible(ax, trajectory, {name: _FORCES[name][0] for name in names}, "N"):
        label, style = _FORCES[name]
        timeline.line(ax, unit, name, label=label, **style)
    ax.set_ylabel(f"force [{unit.name}]")
    _key(ax)


def _impulse_panel(timeline: _Timeline, ax: Axes) -> None:
    events = timeline.trajectory.events
    kinds = (("impulse_contact", "on the tip", BLUE, "o"), ("impulse_foundation", "of the foundation", BLACK, "^"))
    sizes = np.array([getattr(e, name) for e in events for name, *_ in kinds if getattr(e, name) != 0.0])
    logarithmic = bool(np.all(sizes > 0.0) and np.max(sizes) > 30.0 * np.min(sizes))
    unit = Unit(1.0, "N·s") if logarithmic else readable_unit([sizes], "N·s")
    # Impulses of rounding size would stretch the axis over the ones that matter.
    smallest = max(float(np.min(sizes)), 1e-8 * float(np.max(sizes)))
    foot = 0.3 * unit.factor * smallest if logarithmic else 0.0
    for name, label, colour, marker in kinds:
        points = np.array([(e.time, getattr(e, name)) for e in events if getattr(e, name) != 0.0])
        if len(points):
            t, j = timeline.unit.factor * points[:, 0], unit.factor * points[:, 1]
            ax.vlines(t, foot, j, color=colour, lw=1.0)
            ax.plot(t, j, color=colour, marker=marker, markersize=3.5, linestyle="none", label=label)
    if logarithmic:
        ax.set_yscale("log")
        ax.set_ylim(foot, 2.0 * unit.factor * float(np.max(sizes)))
    else:
        ax.axhline(0.0, color=GREY, lw=0.5)
    ax.set_ylabel(f"impulse [{unit.name}]")
    _key(ax)


_ENERGIES: dict[str, tuple[str, str]] = {
    "e_beam": ("beam", SKY),
    "e_spring": ("spring", ORANGE),
    "e_contact": ("contact", YELLOW),
    "e_dissipated": ("dissipated", PURPLE),
    "e_impact_loss": ("impact losses", GREY),
    "e_load": ("loads (potential)", GREEN),
}


def _gap_and_energy(trajectory: Trajectory) -> Figure | None:
    gap = _present(trajectory, "gap")
    title = "(E) Gap and energy" if gap else "(E) Energy"
    timeline = _Timeline.of(trajectory, title, [1.5] * bool(gap) + [2.2, 1.4])
    *above, energies, residual = timeline.axes
    if gap:
        unit = readable_unit([trajectory["gap"]], "m")
        above[0].axhline(0.0, color=GREY, lw=0.5)
        timeline.line(
            above[0], unit, "gap", color=BLUE, label="u(t, L) − y" if "y" in trajectory.columns else "u(t, L) − φ"
        )
        above[0].set_ylabel(f"gap [{unit.name}]")
        _key(above[0])
    _energy_panel(timeline, energies)
    _residual_panel(timeline, residual)
    return timeline.figure


def _energy_panel(timeline: _Timeline, ax: Axes) -> None:
    """Stacked where no part is negative, else lines."""
    trajectory = timeline.trajectory
    there = {name: _ENERGIES[name][0] for name in _present(trajectory, *_ENERGIES) if np.any(trajectory[name] != 0.0)}
    parts = _visible(ax, trajectory, there, "J") if there else []
    unit = readable_unit([trajectory["e_total"], *(trajectory[name] for name in parts)], "J")
    least = min((float(np.min(trajectory[name])) for name in parts), default=-1.0)
    if least >= -1e-9 * float(np.max(trajectory["e_total"])):
        rows = decimated(trajectory["time"], trajectory[parts[0]])
        ax.stackplot(
            timeline.unit.factor * trajectory["time"][rows],
            *(unit.factor * np.maximum(trajectory[name][rows], 0.0) for name in parts),
            colors=[_ENERGIES[name][1] for name in parts],
            labels=[_ENERGIES[name][0] for name in parts],
            linewidth=0.0,
        )
        ax.set_ylim(bottom=0.0)
    else:
        for name in parts:
            timeline.line(ax, unit, name, color=_ENERGIES[name][1], label=_ENERGIES[name][0])
    timeline.line(ax, unit, "e_total", color=BLACK, linewidth=1.4, linestyle=(0, (4, 2)), label="total")
    ax.set_ylabel(f"energy [{unit.name}]")
    _key(ax)


def _residual_panel(timeline: _Timeline, ax: Axes) -> None:
    columns = timeline.trajectory.columns
    stored = sum(np.abs(columns[name]) for name in ("e_beam", "e_spring", "e_contact") if name in columns)
    scale = float(max(np.max(stored), abs(columns["e_total"][0]))) or 1.0
    relative = np.abs(columns["energy_residual"]) / scale
    rows = decimated(columns["time"], relative)
    rows = rows[relative[rows] > 0.0]
    ax.plot(timeline.unit.factor * columns["time"][rows], relative[rows], color=VERMILLION, lw=0.8)
    if len(rows):
        ax.set_yscale("log")
        ax.set_ylim(0.3 * max(float(np.min(relative[rows])), 1e-18), 5.0 * float(np.max(relative[rows])))
        ax.yaxis.set_major_locator(LogLocator(numticks=6))
    else:
        _note(ax, "zero throughout")
    ax.set_ylabel("energy residual\n/ largest energy [–]")
