"""Pictures of a sweep: a metric over one varied key as a curve, over two as a map."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import XAxis, YAxis
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from ...pictures.drawing import BLUE, VERMILLION
from ...scene.reference import unit_of
from .design import Axis
from .metrics import heading

#: A metric that varies less, relative to its largest value, is constant.
_ROUNDING = 1e-12
#: So many values of a key are named on its axis.
_FEW = 8


def draw(columns: dict[str, list[Any]], axes: Sequence[Axis], metrics: Sequence[str], title: str, path: Path) -> bool:
    """Draw to ``path`` what of ``metrics`` the one or two keys of a sweep change; ``False`` if that is nothing."""
    metrics = [name for name in metrics if name in columns]
    numbers = {name: np.array([np.nan if v is None else v for v in columns[name]], dtype=float) for name in metrics}
    shown = [name for name in metrics if _varies(numbers[name])]
    if len(axes) not in (1, 2) or not shown:
        return False
    wide = min(3, len(shown))
    high = -(-len(shown) // wide)
    figure = Figure(figsize=(4.0 * wide, 3.0 * high + 0.4), layout="constrained")
    figure.suptitle(title or "sweep", wrap=True)
    panels = [figure.add_subplot(high, wide, place) for place in range(1, len(shown) + 1)]
    scales = [
        _curve(ax, columns[axes[0].name], numbers[name], axes[0])
        if len(axes) == 1
        else _map(figure, ax, columns, numbers[name], axes)
        for ax, name in zip(panels, shown, strict=True)
    ]
    figure.draw_without_rendering()  # which decides by what the numbers of a scale are multiplied
    for ax, name, scale in zip(panels, shown, scales, strict=True):
        factor = scale.get_offset_text()
        ax.set_title(f"{heading(name)}   {factor.get_text()}", fontsize="medium")
        factor.set_visible(False)
    figure.savefig(path, dpi=100)
    return True


def _varies(values: np.ndarray) -> bool:
    found = values[np.isfinite(values)]
    return found.size > 1 and bool(np.ptp(found) > _ROUNDING * np.abs(found).max())


def _curve(ax: Axes, at: list[Any], values: np.ndarray, axis: Axis) -> YAxis:
    """Draw values over those of a key; return the scale of the former."""
    failed = np.isnan(values)
    if any(isinstance(value, str) for value in at):
        ax.plot([str(v) for v in at], values, "o", color=BLUE)
    else:
        position = np.array(at, dtype=float)
        order = np.argsort(position, kind="stable")
        ax.plot(position[order], values[order], ".-", color=BLUE, linewidth=1.0)
        if failed.any():
            low = ax.get_ylim()[0]
            ax.plot(position[failed], np.full(failed.sum(), low), "x", color=VERMILLION, clip_on=False)
        if axis.log:
            logarithmic(ax.xaxis, position)
    ax.set_xlabel(labelled(axis))
    ax.grid(alpha=0.3)
    return ax.yaxis


def _map(figure: Figure, ax: Axes, columns: dict[str, list[Any]], values: np.ndarray, axes: Sequence[Axis]) -> YAxis:
    """Draw values over those of two keys; return the scale of the former."""
    levels = [list(dict.fromkeys(columns[axis.name])) for axis in axes]
    grid = len(values) == len(levels[0]) * len(levels[1]) and all(axis.values for axis in axes)
    words = [any(isinstance(v, str) for v in level) for level in levels]
    if grid:
        x, y = (np.arange(len(level)) if word else np.array(level, dtype=float)
                for level, word in zip(levels, words, strict=True))  # fmt: skip
        ascending = np.ix_(np.argsort(x), np.argsort(y))
        found = values.reshape(len(x), len(y))[ascending].T
        borders = (borders_between(np.sort(at), axis.log) for at, axis in zip((x, y), axes, strict=True))
        picture: ScalarMappable = ax.pcolormesh(*borders, found, cmap="cividis")
    else:
        x, y = (np.array([level.index(v) for v in columns[a.name]] if word else columns[a.name], dtype=float)
                for a, level, word in zip(axes, levels, words, strict=True))  # fmt: skip
        picture = ax.scatter(x, y, c=values, s=14, cmap="cividis")
    for axis, drawn, set_ticks, level, word in (
        (axes[0], ax.xaxis, ax.set_xticks, levels[0], words[0]),
        (axes[1], ax.yaxis, ax.set_yticks, levels[1], words[1]),
    ):
        if word:
            set_ticks(range(len(level)), [str(v) for v in level])
        elif axis.log:
            logarithmic(drawn, np.array(level, dtype=float))
        elif grid and len(level) <= _FEW:
            set_ticks(level)
    ax.set(xlabel=labelled(axes[0]), ylabel=labelled(axes[1]))
    return figure.colorbar(picture, ax=ax).ax.yaxis


def borders_between(values: np.ndarray, log: bool) -> np.ndarray:
    """Return the ends of cells around ascending values, shape (len(values) + 1,), halfway between; also of logarithms.

    Of one value the cell has no width.
    """
    around = np.pad(np.log(values) if log else values, 1, "reflect", reflect_type="odd")
    borders = 0.5 * (around[1:] + around[:-1])
    return np.asarray(np.exp(borders) if log else borders)


def labelled(axis: Axis) -> str:
    """Return a varied key with its unit."""
    unit = unit_of(axis.table, axis.key)
    return f"{axis.name} [{unit}]" if unit != "–" else axis.name


def logarithmic(axis: XAxis | YAxis, values: np.ndarray) -> None:
    """Make an axis logarithmic, with plain numbers at decades, and at 2 and 5 if there are few."""
    (axis.axes.set_xscale if isinstance(axis, XAxis) else axis.axes.set_yscale)("log")
    wide = np.max(values) > 20.0 * np.min(values)
    axis.set_major_locator(LogLocator(subs=(1.0,) if wide else (1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())
