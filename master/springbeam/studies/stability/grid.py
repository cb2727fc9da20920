"""The grid of extreme scenes: which cells it has, and what their outcomes amount to.

The same settings give the same cells and outcomes, in whatever order and in however many processes they run.
"""

from __future__ import annotations

import re
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
from ..study import Findings, Record, Study
from ..tables import table, write_csv
from .cells import COUPLINGS, sampled_cells, scene_dict, slice_cells
from .outcome import CLASSES, Outcome, run_cell

#: How many reasons the summary lists, and how many characters of each.
_REASONS, _REASON_WIDTH = 12, 62
#: Quick: the hypercube has so many times fewer cells, each axis of a slice half as many.
_QUICK = 5


class Grid(Study):
    """A Latin hypercube over all parameters, and slices through two of them."""

    kind: ClassVar[str] = "stability"
    files: ClassVar[tuple[str, ...]] = ("stability.csv", "classes.png", "residuals.png", "garbage-*.toml")
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

    def record(self, case: Mapping[str, Any]) -> Record:
        """Run a cell."""
        return asdict(run_cell(dict(case)))

    def lost(self, cause: str) -> Record:
        """Return the outcome of a cell that crashes."""
        return asdict(Outcome("garbage", f"crashed: {cause}"))

    def failed(self, record: Record) -> bool:
        """Tell whether a cell is garbage."""
        return bool(record["kind"] == "garbage")

    def findings(self, records: Mapping[str, Record]) -> Findings:
        """Count classes and reasons; passed if no cell is garbage."""
        bad = {name: record["reason"] for name, record in records.items() if self.failed(record)}
        classes = Counter(record["kind"] for record in records.values())
        garbage = [Text(f"garbage   garbage-{name}.toml: {reason}") for name, reason in bad.items()]
        shown = [self._classes(records), _reasons(records), *garbage]
        return Findings({"cells": len(records), "classes": classes, "garbage": bad}, shown, not bad)

    def write(self, records: Mapping[str, Record], directory: Path, *, pictures: bool) -> list[Path]:
        """Write a row per cell, the scenes of garbage, and the pictures."""
        from .picture import draw

        cells = self.cases()
        rows = [_row(name, cells[name], record) for name, record in records.items()]
        files = [write_csv(directory / "stability.csv", rows)]
        for name, record in records.items():
            if self.failed(record):
                text = tomli_w.dumps(scene_dict(cells[name]))
                (directory / f"garbage-{name}.toml").write_text(text, encoding="utf-8")
        if pictures:
            files += draw([(cells[name], Outcome(**record)) for name, record in records.items()], directory)
        return files

    def _classes(self, records: Mapping[str, Record]) -> Table:
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


def _reasons(records: Mapping[str, Record]) -> Table:
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


def _row(name: str, cell: Mapping[str, Any], record: Record) -> dict[str, Any]:
    """Return a cell with its outcome, as a row of the table."""
    law, scheme, degree = cell["coupling"]
    values = {key: value for key, value in cell.items() if key not in ("slice", "coupling")}
    coupling = {"slice": cell["slice"], "law": law, "scheme": scheme, "degree": degree}
    outcome = {
        "class": record["kind"],
        **{key: value for key, value in record.items() if key not in ("kind", "reason")},
    }
    return {"cell": name, **coupling, **values, **outcome, "reason": " ".join(record["reason"].split())}
