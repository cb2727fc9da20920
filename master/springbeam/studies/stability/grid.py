"""The grid of extreme scenes: which cells it has, and what their outcomes amount to.

The same settings give the same cells and outcomes, in whatever order and in however many processes they run.
"""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import tomli_w
from rich.table import Table
from rich.text import Text

from ...pictures.drawing import BLACK, BLUE, GREEN, ORANGE, SKY, STONE
from ...scene import SceneError
from ..study import Findings, Pictures, Row, Study
from ..tables import table
from .cells import COUPLINGS, SLICES, UNITS, sampled_cells, scene_dict, slice_cells
from .outcome import CLASSES, ended, run_cell

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
        cells = [*sampled_cells(samples, self.seed), *slice_cells(resolution)]
        if not cells:
            raise SceneError("no cells: --samples and --resolution are both 0")
        return {str(number): cell for number, cell in enumerate(cells)}

    def record(self, case: Mapping[str, Any]) -> Row:
        """Run a cell."""
        return run_cell(dict(case))

    def lost(self, cause: str) -> Row:
        """Return the outcome of a cell that crashes."""
        return ended("garbage", f"crashed: {cause}")

    def failed(self, record: Row) -> bool:
        """Tell whether a cell is garbage."""
        return bool(record["kind"] == "garbage")

    def findings(self, records: Mapping[str, Row]) -> Findings:
        """Count classes; passed if no cell is garbage."""
        bad = {name: record["reason"] for name, record in records.items() if self.failed(record)}
        classes = Counter(record["kind"] for record in records.values())
        garbage = [Text(f"garbage   {_file(name)}: {reason}") for name, reason in bad.items()]
        errors = [record["error_motion"] for record in records.values() if record["error_motion"] is not None]
        resolved = sum(record["resolved"] for record in records.values())
        beside = f"{resolved} cells call themselves resolved, {len(errors)} were compared with the reference"
        if errors:
            beside += f": errors {statistics.median(errors):.0e} in the median, at most {max(errors):.0e}"
        shown = [self._classes(records), Text(beside), *garbage]
        told = {"cells": len(records), "classes": classes, "resolved": resolved, "compared": len(errors)}
        return Findings({**told, "garbage": bad}, shown, 1 if bad else 0)

    def rows(self, records: Mapping[str, Row]) -> list[Row]:
        """Return a row per cell."""
        found = []
        for row in super().rows(records):
            law, scheme, degree = row.pop("coupling")
            coupling = {"law": law, "scheme": scheme, "degree": degree}
            found.append(row | coupling | {"reason": " ".join(row["reason"].split())})
        return found

    def write(self, records: Mapping[str, Row], directory: Path, *, pictures: bool) -> list[Path]:
        """Write the table, the pictures, and the scenes of garbage."""
        cells = self.cases()
        for name, record in records.items():
            if self.failed(record):
                (directory / _file(name)).write_text(tomli_w.dumps(scene_dict(cells[name])), encoding="utf-8")
        return super().write(records, directory, pictures=pictures)

    def draw(self, records: Mapping[str, Row]) -> Pictures:
        """Draw maps of the slices: the class of each cell, and its energy residual."""
        import matplotlib
        from matplotlib.colors import ListedColormap, LogNorm

        from ..picture import Scale, cells, column, panels

        rows, figures = self.rows(records), Pictures()
        slices = [name for name in SLICES if any(row["slice"] == name for row in rows)]
        looks: dict[str, dict[str, Any]] = {
            "classes": {"cmap": ListedColormap(_COLOURS), "vmin": -0.5, "vmax": len(CLASSES) - 0.5},
            "residuals": {"cmap": matplotlib.colormaps["cividis"], "norm": LogNorm(*_RESIDUALS, clip=True)},
        }
        for what, look in looks.items() if slices else ():
            figure, axes = panels(len(slices), 4, (4.2, 3.6), f"Slices through the extremes: {what}")
            for ax, name in zip(axes, slices, strict=True):
                mine = [row for row in rows if row["slice"] == name]
                labels = {parameter: f"{parameter} [{UNITS.get(parameter, '–')}]" for parameter in SLICES[name][:2]}
                x, y = (Scale(parameter, label, words=True) for parameter, label in labels.items())
                values = np.maximum(column(mine, "residual"), _RESIDUALS[0])
                if what == "classes":
                    values = np.array([CLASSES.index(row["kind"]) for row in mine], dtype=float)
                drawn = cells(ax, mine, x, y, values, **look)
                ax.set(title=name, facecolor=STONE)  # where nothing was run
                ax.tick_params(labelsize="small")
                ax.tick_params(axis="x", labelrotation=30)
            bar = figure.colorbar(drawn, ax=axes, shrink=0.6)
            if what == "classes":
                bar.set_ticks(range(len(CLASSES)), labels=CLASSES)
            else:
                bar.set_label("largest energy residual / largest energy so far (grey: refused)")
            figures[f"stability-{what}"] = figure
        return figures

    def _classes(self, records: Mapping[str, Row]) -> Table:
        """Return a row per coupling, with the largest residual of the runs that were done."""
        cells, rows = self.cases(), []
        for coupling in (*COUPLINGS, None):
            mine = [r for name, r in records.items() if coupling in (cells[name]["coupling"], None)]
            counts = Counter(record["kind"] for record in mine)
            done = [r["residual"] or 0.0 for r in mine if r["kind"] not in ("refused", "stopped")]
            name = "all" if coupling is None else " ".join(map(str, coupling)).removeprefix("transmission ")
            rows.append((name, *(str(counts[kind] or "") for kind in CLASSES), f"{max(done):.0e}" if done else ""))
        names = ("coupling", *(f"{kind[:4]}." for kind in CLASSES), "residual")
        return table(names, rows, f"{len(records)} cells")


def _file(name: str) -> str:
    return f"stability-garbage-{name}.toml"
