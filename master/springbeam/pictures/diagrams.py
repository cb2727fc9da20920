"""Diagrams: curves over quantities other than the time of a run, such as errors over cost, spectra, measurements.

matplotlib, which takes a second to load, is loaded only to draw.
"""

from __future__ import annotations

import textwrap
from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

#: Letters of a title, and inches of an entry of the key, to an inch of a figure.
_LETTERS = 9
_ENTRY = 2.4
_MARKERS = "os^DvPX*<"
_DASHES = ("-", "--", ":")
#: Between these, decades of a logarithmic axis are written as numbers; within this ratio, it has more labels.
_SHORT = (1e-3, 1e5)
_FEW = 200.0
#: A curve of more points than this has no markers.
_MARKED = 60


class Diagram(NamedTuple):
    """Curves by their names, each of shape (n, 2); labels and title of the axes."""

    across: str
    up: str
    curves: Mapping[str, Any]
    title: str = ""
    log: bool = True  #: both axes; what is not above 0 is left out
    dots: Collection[str] = ()  #: curves whose points are not joined


def draw_diagrams(
    diagrams: Sequence[Diagram], title: str, size: tuple[float, float] = (5.0, 4.0), wide: int = 3
) -> Figure:
    """Return a figure of diagrams of ``size`` [inch], ``wide`` of them side by side; names have one look in all."""
    figure, axes = figure_with(len(diagrams), wide, size, title)
    names = list(dict.fromkeys(name for diagram in diagrams for name in diagram.curves))
    key = {}
    for ax, diagram in zip(axes, diagrams, strict=True):
        scale = "log" if diagram.log else "linear"
        ax.set(title=diagram.title, xlabel=diagram.across, ylabel=diagram.up, xscale=scale, yscale=scale)
        ax.grid(alpha=0.3)
        for name, curve in diagram.curves.items():
            k = names.index(name)
            dots = name in diagram.dots
            points = np.reshape(np.array(curve, float), (-1, 2))
            seen = points[np.all(points > 0.0, axis=1)] if diagram.log else points
            marker = "." if dots else _MARKERS[k % len(_MARKERS)] if len(seen) <= _MARKED else ""
            (key[name],) = ax.plot(*seen.T, color=f"C{k % 10}", marker=marker, markersize=4.0, linewidth=1.1,
                                   linestyle="none" if dots else _DASHES[k % len(_DASHES)])  # fmt: skip
        for axis in (ax.xaxis, ax.yaxis) if diagram.log else ():
            _label(axis)
    columns = max(1, int(figure.get_figwidth() / _ENTRY))
    figure.legend(key.values(), key, loc="outside lower center", fontsize="small", ncols=columns)
    return figure


def _label(axis: Axis) -> None:
    """Label a logarithmic axis: decades as numbers where these are short, also 2 and 5 where there are few decades."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = axis.get_view_interval()
    plain = FuncFormatter(lambda value, _: f"{value:g}")
    if low >= _SHORT[0] and high <= _SHORT[1]:
        axis.set_major_formatter(plain)
    few = high < _FEW * low
    axis.set_minor_formatter(plain if few else NullFormatter())
    if few:
        axis.set_minor_locator(LogLocator(subs=(2.0, 5.0)))


def figure_with(count: int, wide: int, size: tuple[float, float], title: str) -> tuple[Figure, list[Axes]]:
    """Return a figure with ``count`` axes of ``size`` [inch], at most ``wide`` in a row."""
    from matplotlib.figure import Figure

    wide = max(1, min(wide, count))
    high = -(-count // wide)
    figure = Figure(figsize=(size[0] * wide, size[1] * high + 0.5), layout="constrained")
    if title:
        figure.suptitle(textwrap.fill(title, round(_LETTERS * figure.get_figwidth())))
    return figure, [figure.add_subplot(high, wide, place) for place in range(1, count + 1)]
