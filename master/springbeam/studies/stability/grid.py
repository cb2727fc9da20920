"""The grid of extreme scenes: which cells it has, and what their outcomes amount to.

The same settings give the same cells and outcomes, in whatever order and in however many processes they run.
"""

from __future__ import annotations

import re
import statistics
import textwrap
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, ClassVar

import tomli_w
from rich.table import Table
from rich.text import Text

from ...scene import SceneError
from ..study import Findings, Row, Study
from ..tables import table
from .cells import COUPLINGS, sampled_cells, scene_dict, slice_cells
from .outcome import CLASSES, Outcome, run_cell

#: How many reasons the summary lists, and how many characters of each.
_REASONS, _REASON_WIDTH = 12, 62
#: Quick: the hypercube has so many times fewer cells, each axis of a slice half as many.
_QUICK = 5


class Grid(Study):
    """A Latin hypercube over all parameters, and slices through two of them."""

    kind: ClassVar[str] = "stability"
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

    def cost(self) -> str:
        """Say how many cells there are."""
        return f"{len(self.cases())} cells, mostly below a second each; --samples and --resolution set how many"

    def record(self, case: Mapping[str, Any]) -> Row:
        """Run a cell."""
        return asdict(run_cell(dict(case)))

    def lost(self, cause: str) -> Row:
        """Return the outcome of a cell that crashes."""
        return asdict(Outcome("garbage", f"crashed: {cause}"))

    def failed(self, record: Row) -> bool:
        """Tell whether a cell is garbage."""
        return bool(record["kind"] == "garbage")

    def findings(self, records: Mapping[str, Row]) -> Findings:
        """Count classes and reasons; passed if no cell is garbage."""
        bad = {name: record["reason"] for name, record in records.items() if self.failed(record)}
        classes = Counter(record["kind"] for record in records.values())
        garbage = [Text(f"garbage   {_file(name)}: {reason}") for name, reason in bad.items()]
        errors = [record["error_motion"] for record in records.values() if record["error_motion"] is not None]
        resolved = sum(record["resolved"] for record in records.values())
        beside = f"{resolved} cells call themselves resolved, {len(errors)} were compared with the reference"
        if errors:
            beside += f": errors {statistics.median(errors):.0e} in the median, at most {max(errors):.0e}"
        shown = [self._classes(records), _reasons(records), Text(beside), *garbage]
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

    def draw(self, records: Mapping[str, Row], directory: Path) -> list[Path]:
        """Draw the class of each cell, and its energy residual: slices as maps, the hypercube by coupling."""
        from .picture import draw

        return draw(self.rows(records), directory)

    def _classes(self, records: Mapping[str, Row]) -> Table:
        """Return a row per coupling, with the largest residual of the runs that were done."""
        cells, rows = self.cases(), []
        for coupling in (*COUPLINGS, None):
            mine = [r for name, r in records.items() if coupling in (cells[name]["coupling"], None)]
            counts = Counter(record["kind"] for record in mine)
            done = [
                r["residual"] for r in mine if r["kind"] not in ("refused", "stopped") and r["residual"] is not None
            ]
            name = "all" if coupling is None else " ".join(map(str, coupling)).removeprefix("transmission ")
            numbers = [str(counts[kind] or "") for kind in CLASSES]
            rows.append((name, *numbers, f"{max(done):.0e}" if done else ""))
        names = ("coupling", *(f"{kind[:4]}." for kind in CLASSES), "residual")
        return table(names, rows, f"{len(records)} cells")


def _reasons(records: Mapping[str, Row]) -> Table:
    """Return why cells were refused or stopped, without numbers, the most frequent reasons first."""
    counts = Counter(
        (record["kind"], _without_numbers(record["reason"]))
        for record in records.values()
        if record["kind"] in ("refused", "stopped")
    )
    rows = [
        (kind, str(number), textwrap.shorten(reason, _REASON_WIDTH, placeholder=" …"))
        for (kind, reason), number in counts.most_common(_REASONS)
    ]
    if len(counts) > _REASONS:
        rows.append(("", "", f"and {len(counts) - _REASONS} further reasons, see the table"))
    return table(("", "cells", "why"), rows, words=("why",))


def _without_numbers(reason: str) -> str:
    return re.sub(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?", "…", " ".join(reason.removeprefix("cell: ").split()))


def _file(name: str) -> str:
    return f"stability-garbage-{name}.toml"
