"""Maps of the grid's slices, and its hypercube by coupling: the class of each cell, and its energy residual."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.patches import Patch

from ...pictures.drawing import BLACK, BLUE, GREEN, ORANGE, SKY, STONE
from ..picture import Scale, cells, column, panels
from ..study import Row
from .cells import COUPLINGS, SLICES
from .outcome import CLASSES

_COLOURS = dict(zip(CLASSES, (BLUE, SKY, GREEN, STONE, ORANGE, BLACK), strict=True))
#: Residuals outside are drawn in the colours of the ends.
_RESIDUALS = (1e-16, 1.0)


def draw(rows: Sequence[Row], directory: Path) -> list[Path]:
    """Draw ``stability-classes.png`` and ``stability-residuals.png`` into ``directory``; return their paths."""
    slices = [s for s in SLICES if any(row["slice"] == s.name for row in rows)]
    sampled = [row for row in rows if not row["slice"]]
    looks: dict[str, dict[str, Any]] = {
        "classes": {"cmap": ListedColormap(list(_COLOURS.values())), "vmin": -0.5, "vmax": len(CLASSES) - 0.5},
        "residuals": {"cmap": "cividis", "norm": LogNorm(*_RESIDUALS, clip=True)},
    }
    paths = []
    for what, look in looks.items():
        figure, axes = panels(len(slices) + bool(sampled), 4, (4.2, 3.6), f"{len(rows)} cells: {what}")
        for ax, s in zip(axes, slices, strict=False):
            mine = [row for row in rows if row["slice"] == s.name]
            values = np.array([CLASSES.index(row["kind"]) for row in mine], dtype=float)
            if what == "residuals":
                values = np.maximum(column(mine, "residual"), _RESIDUALS[0])
            cells(ax, mine, Scale(s.x, s.x, words=True), Scale(s.y, s.y, words=True), values, **look)
            ax.set(title=s.name, facecolor=STONE)  # where nothing was run
            ax.tick_params(labelsize="small")
        if sampled:
            _by_coupling(axes[-1], sampled, what)
        if what == "classes":
            patches = [Patch(color=colour, label=name) for name, colour in _COLOURS.items()]
            figure.legend(handles=patches, loc="outside lower center", ncols=len(patches))
        else:
            figure.colorbar(ScalarMappable(look["norm"], look["cmap"]), ax=axes, shrink=0.6,
                            label="largest energy residual / largest energy so far (grey: refused)")  # fmt: skip
        paths.append(directory / f"stability-{what}.png")
        figure.savefig(paths[-1], dpi=100)
    return paths


def _by_coupling(ax: Axes, rows: Sequence[Row], what: str) -> None:
    """Draw the cells of the hypercube by coupling: how many are of each class, or their residuals."""
    names = [f"{law}: {scheme} {degree}".removeprefix("transmission: ") for law, scheme, degree in COUPLINGS]
    places = [COUPLINGS.index((row["law"], row["scheme"], row["degree"])) for row in rows]
    if what == "classes":
        counts, left = Counter(zip(places, (row["kind"] for row in rows), strict=True)), np.zeros(len(names))
        for kind, colour in _COLOURS.items():
            width = np.array([counts[place, kind] for place in range(len(names))])
            ax.barh(names, width, left=left, color=colour)
            left += width
        ax.set(xlabel="cells")
    else:
        ax.plot(np.maximum(column(rows, "residual"), _RESIDUALS[0]), places, "|", color=BLUE)
        ax.set(xscale="log", xlabel="energy residual", yticks=range(len(names)), yticklabels=names)
    ax.set_title(f"hypercube, {len(rows)} cells", fontsize="medium")
    ax.tick_params(axis="y", labelsize="xx-small")
    ax.yaxis.tick_right()  # at the edge of the picture: on the left they would part all columns
    ax.invert_yaxis()
