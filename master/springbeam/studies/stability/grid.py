"""The grid of extreme scenes: run and judge each cell, count the classes.

The same settings give the same cells and outcomes, in whatever order and in however many processes they run.
"""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, ClassVar

import numpy as np
import tomli_w
from rich.table import Table

from ...pictures.diagrams import figure_with
from ...pictures.drawing import BLACK, BLUE, GREEN, ORANGE, SKY, STONE
from ...scene import SceneError, scene_from_dict
from ..picture import Scale, cells, column
from ..study import Study
from ..tables import Findings, Row, table
from .draw import COUPLINGS, EXTREME, SLICES, drawn, scene_dict, slice_cells
from .judge import CLASSES, ended, judge

#: Columns that define a coupling, and columns of the table.
_NAMES = ("law", "scheme", "degree")
#: Of `CLASSES`; residuals outside are drawn in the colours of the ends.
_COLOURS, _RESIDUALS = (BLUE, SKY, GREEN, STONE, ORANGE, BLACK), (1e-16, 1.0)
#: Quick: the hypercube has so many times fewer cells, each axis of a slice half as many.
_QUICK = 5


class Grid(Study):
    """A Latin hypercube over all parameters, and slices through two of them."""

    kind: ClassVar[str] = "stability"
    announced: ClassVar[str] = "{} cells, mostly below a second each; --samples and --resolution set how many"
    parallel: ClassVar[bool] = True

    samples: int = 300
    resolution: int = 6  #: values of each parameter of a slice
    seed: int = 1

    def cases(self) -> dict[str, dict[str, Any]]:
        """Return the cells."""
        samples, resolution = self.samples, self.resolution
        if self.quick:
            samples, resolution = -(-samples // _QUICK), -(-resolution // 2)
        cells = [*({"slice": ""} | cell for cell in drawn(EXTREME, samples, self.seed)), *slice_cells(resolution)]
        if not cells:
            raise SceneError("no cells: --samples and --resolution are both 0")
        return {str(number): cell for number, cell in enumerate(cells)}

    def record(self, case: Mapping[str, Any]) -> Row:
        """Run and judge the scene of a cell; it is refused if the schema rejects it."""
        try:
            scene = scene_from_dict(scene_dict(dict(case)), source="cell")
        except SceneError as error:
            return ended("refused", str(error))
        return judge(scene)

    def lost(self, cause: str) -> Row:
        """Return the outcome of a cell that crashes."""
        return ended("garbage", f"crashed: {cause}")

    def findings(self, records: Mapping[str, Row]) -> Findings:
        """Count classes; passed if no cell is garbage."""
        bad = {name: record["reason"] for name, record in records.items() if record["kind"] == "garbage"}
        files = {name: f"stability-garbage-{name}.toml" for name in bad}
        garbage = [f"garbage   {files[name]}: {reason}" for name, reason in bad.items()]
        errors = [record["error_motion"] for record in records.values() if record["error_motion"] is not None]
        quiet = sum(record["residual"] is not None and not record["warns"] for record in records.values())
        beside = f"{quiet} cells do not warn, {len(errors)} were compared with the reference"
        if errors:
            beside += f": errors {statistics.median(errors):.0e} in the median, at most {max(errors):.0e}"
        classes = Counter(record["kind"] for record in records.values())
        summary = {"cells": len(records), "classes": classes, "without_warning": quiet, "compared": len(errors)}
        cells, rows = self.cases(), self.rows(records)
        slices = any(row["slice"] for row in rows)
        return Findings(
            {**summary, "garbage": bad},
            [_classes(rows), beside, *garbage],
            code=1 if bad else 0,
            tables={self.kind: [row | dict(zip(_NAMES, row.pop("coupling"), strict=True)) for row in map(dict, rows)]},
            texts={file: tomli_w.dumps(scene_dict(cells[name])) for name, file in files.items()},
            pictures={f"stability-{what}": partial(_drawn, rows, what) for what in ("classes", "residuals") if slices},
        )


def _classes(rows: Sequence[Row]) -> Table:
    """Return a row per coupling, with the largest residual of the runs that were done."""
    shown = []
    for coupling in (*COUPLINGS, None):
        mine = [row for row in rows if coupling in (row["coupling"], None)]
        counts = Counter(row["kind"] for row in mine)
        done = [row["residual"] or 0.0 for row in mine if row["kind"] not in ("refused", "stopped")]
        name = "all" if coupling is None else " ".join(map(str, coupling)).removeprefix("transmission ")
        shown.append((name, *(counts[kind] or None for kind in CLASSES), max(done, default=None)))
    names = ("coupling", *(f"{kind[:4]}.:" for kind in CLASSES), "residual:.0e")
    return table(names, shown, f"{len(rows)} cells")


def _drawn(rows: Sequence[Row], what: str) -> Any:
    """Draw maps of the slices: ``classes`` of the cells, or their energy ``residuals``."""
    from matplotlib.colors import ListedColormap, LogNorm

    look: dict[str, Any] = {"cmap": ListedColormap(_COLOURS), "vmin": -0.5, "vmax": len(CLASSES) - 0.5}
    if what == "residuals":
        look = {"cmap": "cividis", "norm": LogNorm(*_RESIDUALS, clip=True)}
    names = [name for name in SLICES if any(row["slice"] == name for row in rows)]
    figure, axes = figure_with(len(names), 4, (4.2, 3.6), f"Slices through the extremes: {what}")
    for ax, name in zip(axes, names, strict=True):
        mine = [row for row in rows if row["slice"] == name]
        x, y = (Scale(key, key, words=True) for key in SLICES[name][:2])
        values = np.array([CLASSES.index(row["kind"]) for row in mine], dtype=float)
        if what == "residuals":
            values = np.maximum(column(mine, "residual"), _RESIDUALS[0])
        drawn = cells(ax, mine, x, y, values, **look)
        ax.set(title=name, facecolor=STONE)  # where nothing was run
        ax.tick_params(labelsize="small")
        ax.tick_params(axis="x", labelrotation=30)
    bar = figure.colorbar(drawn, ax=axes, shrink=0.6)
    if what == "classes":
        bar.set_ticks(range(len(CLASSES)), labels=CLASSES)
    else:
        bar.set_label("largest energy residual / largest energy so far (grey: refused)")
    return figure
