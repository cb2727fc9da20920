"""Pictures of a table of cases: values over one axis as a curve, over two as a map, over more as small multiples."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..pictures.diagrams import figure_with
from ..pictures.drawing import BLUE, Unit, readable_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import XAxis, YAxis
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure

Rows = Sequence[Mapping[str, Any]]
#: Units that take a prefix.
_PREFIXED = ("m", "s", "N", "J", "Pa", "Hz", "N·m", "N·s", "m/s", "m/s²", "N/m", "N·s/m", "W")
#: Values of an axis that are named on it, and columns of small multiples.
_FEW = 8
_MOST = 6
#: Values are named on an axis if the range is less than so many times the least distance of two of them.
_APART = 5.0


class Scale(NamedTuple):
    """An axis of the table: a column, and how its values are laid out."""

    name: str
    label: str
    log: bool = False
    words: bool = False  #: evenly, each labelled with its value

    def places(self, values: Sequence[Any]) -> tuple[np.ndarray, list[Any]]:
        """Return the positions of ``values``, and the different values in the order of their positions."""
        if self.words:
            levels = list(dict.fromkeys(values))
            return np.array([levels.index(value) for value in values], dtype=float), levels
        return np.array(values, dtype=float), sorted(set(values))

    def mark(self, axis: XAxis | YAxis, levels: Sequence[Any]) -> None:
        """Label an axis and its values."""
        axis.set_label_text(self.label)
        if self.words:
            some = levels[:: max(1, -(-len(levels) // _FEW))] if len(levels) > _FEW else levels
            axis.set_ticks([levels.index(value) for value in some], [_short(value) for value in some])
        elif self.log:
            axis.axes.set(**{f"{axis.axis_name}scale": "log"})
        elif np.ptp(levels) < _APART * np.diff(np.array(levels, float)).min(initial=np.inf):
            axis.set_ticks(levels)


def _short(value: Any) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def column(rows: Rows, name: str) -> np.ndarray:
    """Return a column of numbers, NaN where there is none."""
    return np.array([np.nan if row.get(name) is None else row[name] for row in rows], dtype=float)


def readable(rows: Rows, units: Mapping[str, str]) -> tuple[Rows, dict[str, str]]:
    """Return ``rows`` with the columns of ``units`` in prefixes that read well, as in pictures of a run, and headings.

    Only a unit that has no power takes a prefix.
    """
    factors = {}
    headings = {}
    for name, unit in units.items():
        values = [row[name] for row in singly(rows, name)]
        numbers = [value for value in values if isinstance(value, (int, float)) and np.isfinite(value)]
        prefixed = readable_unit([np.array(numbers)], unit) if numbers and unit in _PREFIXED else Unit(1.0, unit)
        headings[name] = f"{name} [{prefixed.name}]" if unit not in ("", "–") else name
        if prefixed.factor != 1.0:
            factors[name] = prefixed.factor

    def scaled(value: Any, factor: float) -> Any:
        if isinstance(value, list):
            return [scaled(one, factor) for one in value]
        return factor * value if isinstance(value, (int, float)) else value

    changed = [{**row, **{name: scaled(row.get(name), factor) for name, factor in factors.items()}} for row in rows]
    return changed, headings


def singly(rows: Rows, name: str) -> Rows:
    """Return a row for each number where a column has several."""
    listed = [(row, row[name]) for row in rows if isinstance(row.get(name), list)]
    return [{**row, name: value} for row, values in listed for value in values] if listed else rows


def multiples(rows: Rows, scales: Sequence[Scale], values: Mapping[str, str], title: str) -> Figure:
    """Return a figure of columns of ``rows``, given with their titles, over the axes of the table.

    Of a full grid a curve over one axis, or maps over the first two, one for each pick of the others; of samples a
    panel over each axis.
    """
    levels = [list(dict.fromkeys(row[scale.name] for row in rows)) for scale in scales]
    of_grid = len(scales) == 1 or len(rows) == np.prod([len(level) for level in levels])
    picks: list[tuple[Any, ...]] = list(itertools.product(*levels[2:])) if of_grid else [(scale,) for scale in scales]
    picks = picks[:: -(-len(picks) // _MOST)]
    figure, axes = figure_with(len(picks) * len(values), len(picks) if len(picks) > 1 else 3, (3.8, 3.0), title)
    drawn = []
    for ax, ((name, words), pick) in zip(axes, itertools.product(values.items(), picks), strict=True):
        fixed = dict(zip((scale.name for scale in scales[2:]), pick, strict=True)) if of_grid else {}
        mine = [row for row in rows if all(row[key] == value for key, value in fixed.items())]
        where = "".join(f", {key.rpartition('.')[2]} = {_short(value)}" for key, value in fixed.items())
        every = column(singly(rows, name), name)  # panels of one column share its colours
        ends = np.nanmin(every), np.nanmax(every)
        scale = _panel(figure, ax, singly(mine, name), scales[:2] if of_grid else pick, name, ends, len(scales) == 1)
        drawn.append((ax, f"{words}{where}", scale.get_offset_text()))
    figure.draw_without_rendering()  # which decides by what the numbers of a scale are multiplied
    for ax, words, factor in drawn:
        ax.set_title(f"{words}   {factor.get_text()}", fontsize="medium")
        factor.set_visible(False)
    return figure


def _panel(
    figure: Figure, ax: Axes, rows: Rows, scales: Sequence[Scale], name: str, ends: tuple[float, float], alone: bool
) -> YAxis:
    """Draw a column over one or two axes; return the scale of its values, whose colours go from end to end.

    Values are joined over an axis that is ``alone``; else neighbours on it differ in others.
    """
    values = column(rows, name)
    if len(scales) == 2:
        drawn = cells(ax, rows, scales[0], scales[1], values, cmap="cividis", vmin=ends[0], vmax=ends[1])
        return figure.colorbar(drawn, ax=ax).ax.yaxis
    (scale,) = scales
    places, levels = scale.places([row[scale.name] for row in rows])
    order = np.argsort(places, kind="stable")
    joined = "-" if alone and not scale.words and len(set(places)) == len(places) else "none"
    ax.plot(places[order], values[order], marker=".", linestyle=joined, color=BLUE, linewidth=1.0)
    scale.mark(ax.xaxis, levels)
    ax.grid(alpha=0.3)
    return ax.yaxis


def cells(ax: Axes, rows: Rows, x: Scale, y: Scale, values: np.ndarray, **look: Any) -> ScalarMappable:
    """Draw the values of a full grid over two axes as cells."""
    (across, columns), (up, lines) = (scale.places([row[scale.name] for row in rows]) for scale in (x, y))
    grid = values[np.lexsort((across, up))].reshape(len(lines), len(columns))
    borders = (_borders(np.unique(places), scale.log) for places, scale in ((across, x), (up, y)))
    x.mark(ax.xaxis, columns)
    y.mark(ax.yaxis, lines)
    return ax.pcolormesh(*borders, grid, **look)


def _borders(values: np.ndarray, log: bool) -> np.ndarray:
    """Return the ends of cells around ascending values, shape (len(values) + 1,), halfway between; also of logarithms.

    Of one value the cell has no width.
    """
    around = np.pad(np.log(values) if log else values, 1, "reflect", reflect_type="odd")
    borders = 0.5 * (around[1:] + around[:-1])
    return np.exp(borders) if log else borders
