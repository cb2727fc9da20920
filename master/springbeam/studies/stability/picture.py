"""Maps of the grid's slices: the class of each cell, and its energy residual."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ...pictures.drawing import BLACK, BLUE, GREEN, ORANGE, SKY, STONE
from .cells import COUPLINGS, PARAMETERS, SLICES, Slice
from .outcome import CLASSES, Outcome

_COLOURS = dict(zip(CLASSES, (BLUE, SKY, GREEN, STONE, ORANGE, BLACK), strict=True))
_LOG = {p.name for p in PARAMETERS if not p.linear and not p.choices}
#: Residuals outside are drawn in the colours of the ends.
_RESIDUALS = (1e-16, 1.0)

Ended = tuple[dict[str, Any], Outcome]  #: a cell, and how it ended
Rows = list[list[Ended]]


def draw(ended: Sequence[Ended], directory: Path) -> list[Path]:
    """Draw ``classes.png`` and ``residuals.png`` into ``directory``; returns their paths."""
    paths = []
    for name, panel, legend in (
        ("classes", _classes, _class_legend),
        ("residuals", _residuals, _residual_legend),
    ):
        wide = 4
        high = -(-(len(SLICES) + 1) // wide)
        figure = Figure(figsize=(4.2 * wide, 3.6 * high), layout="constrained")
        axes = figure.subplots(high, wide)
        for ax, s in zip(axes.flat, SLICES, strict=False):
            _map(ax, s, _rows(s, ended), panel)
        for ax in axes.flat[len(SLICES) :]:
            ax.set_visible(False)
        _samples(axes.flat[-1], ended, name)
        legend(figure, axes)
        paths.append(directory / f"{name}.png")
        figure.savefig(paths[-1], dpi=100)
    return paths


def _rows(s: Slice, ended: Sequence[Ended]) -> Rows:
    """Return the cells of a slice: a row per value of y, a column per value of x, both ascending."""
    mine = [(cell, outcome) for cell, outcome in ended if cell["slice"] == s.name]
    rows = sorted({cell[s.y] for cell, _ in mine})
    return [sorted((c for c in mine if c[0][s.y] == y), key=lambda c: float(c[0][s.x])) for y in rows]


def _map(ax: Axes, s: Slice, grid: Rows, panel: Callable[[Axes, Rows], None]) -> None:
    ax.set_title(s.name, fontsize="medium")
    ax.set(xlabel=s.x, ylabel=s.y)
    if not grid:
        return
    panel(ax, grid)
    # Values are evenly spaced (but a 0 in front of a logarithmic range): their places are drawn, not they.
    for name, values, set_ticks in (
        (s.x, [cell[s.x] for cell, _ in grid[0]], ax.set_xticks),
        (s.y, [row[0][0][s.y] for row in grid], ax.set_yticks),
    ):
        some = range(0, len(values), max(1, (len(values) - 1) // 4))
        set_ticks(list(some), [f"{values[i]:.0e}" if name in _LOG and values[i] else f"{values[i]:g}" for i in some])
        ax.tick_params(labelsize="small")


def _classes(ax: Axes, grid: Rows) -> None:
    numbers = np.array([[CLASSES.index(outcome.kind) for _, outcome in row] for row in grid])
    ax.imshow(numbers, ListedColormap([_COLOURS[name] for name in CLASSES]), vmin=-0.5, vmax=len(CLASSES) - 0.5,
              origin="lower", aspect="auto")  # fmt: skip
    for j, row in enumerate(grid):
        for i, (_, outcome) in enumerate(row):
            colour = "white" if outcome.kind in ("conserved", "garbage") else BLACK
            ax.text(i, j, outcome.kind[0].upper(), ha="center", va="center", fontsize="small", color=colour)


def _class_legend(figure: Figure, axes: np.ndarray) -> None:
    patches = [Patch(color=colour, label=f"{name[0].upper()}  {name}") for name, colour in _COLOURS.items()]
    figure.legend(handles=patches, loc="outside upper center", ncols=len(patches))


def _residuals(ax: Axes, grid: Rows) -> None:
    residuals = np.array([[outcome.residual for _, outcome in row] for row in grid], dtype=float)
    ax.set_facecolor(STONE)  # nothing was run
    ax.imshow(np.maximum(residuals, _RESIDUALS[0]), "cividis", norm=LogNorm(*_RESIDUALS), origin="lower", aspect="auto")


def _residual_legend(figure: Figure, axes: np.ndarray) -> None:
    mappable = ScalarMappable(LogNorm(*_RESIDUALS), "cividis")
    figure.colorbar(mappable, ax=axes, label="largest energy residual / largest energy so far (grey: refused)",
                    shrink=0.6)  # fmt: skip


def _samples(ax: Axes, ended: Sequence[Ended], what: str) -> None:
    """Draw the hypercube's cells by coupling: shares of the classes, or the residuals."""
    mine = [(cell["coupling"], outcome) for cell, outcome in ended if not cell["slice"]]
    ax.set_visible(bool(mine))
    names = [f"{scheme} {degree}" if law == "transmission" else f"{law}: {scheme} {degree}"
             for law, scheme, degree in COUPLINGS]  # fmt: skip
    places = range(len(COUPLINGS))
    if what == "classes":
        left = np.zeros(len(COUPLINGS))
        counts = Counter((coupling, outcome.kind) for coupling, outcome in mine)
        for kind in CLASSES:
            width = np.array([counts[coupling, kind] for coupling in COUPLINGS])
            ax.barh(places, width, left=left, color=_COLOURS[kind])
            left += width
        ax.set(xlabel="cells")
    else:
        for place, coupling in enumerate(COUPLINGS):
            x = [max(o.residual, _RESIDUALS[0]) for c, o in mine if c == coupling and o.residual is not None]
            ax.plot(x, [place] * len(x), "|", color=BLUE)
        ax.set(xscale="log", xlabel="energy residual")
    ax.set_title(f"hypercube, {len(mine)} cells", fontsize="medium")
    ax.set_yticks(list(places), names, fontsize="xx-small")
    ax.yaxis.tick_right()  # at the edge of the picture: on the left they would part all columns
    ax.invert_yaxis()
