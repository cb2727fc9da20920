"""Extreme scenes: run and judge each cell of a hypercube and of slices, count the classes.

The same settings give the same cells and outcomes, in whatever order and in however many processes they run.
"""

import statistics
from collections import Counter
from typing import ClassVar

import tomli_w
from draw import COUPLINGS, EXTREME, drawn, scene_dict, slice_cells
from judge import CLASSES, MEANINGS, ended, judge

from springbeam.scene import SceneError, scene_from_dict
from springbeam.studies.study import Study
from springbeam.studies.tables import Findings


class Grid(Study):
    """A Latin hypercube over all parameters, and slices through two of them."""

    kind: ClassVar[str] = "extreme"
    parallel: ClassVar[bool] = True

    samples: int = 300
    resolution: int = 6  #: values of each parameter of a slice
    seed: int = 1

    def cases(self):
        cells = [*({"slice": ""} | cell for cell in drawn(EXTREME, self.samples, self.seed))]
        return {str(number): cell for number, cell in enumerate(cells + slice_cells(self.resolution))}

    def record(self, case):
        """Run and judge the scene of a cell; it is refused if the schema rejects it."""
        try:
            scene = scene_from_dict(scene_dict(dict(case)), source="cell")
        except SceneError as error:
            return ended("refused", str(error))
        return judge(scene)

    def lost(self, cause):
        return ended("garbage", f"crashed: {cause}")

    def findings(self, records):
        """Return tables of the classes, what is garbage, and scenes of that; passed if no cell is garbage."""
        cells = self.cases()
        bad = {name: record["reason"] for name, record in records.items() if record["kind"] == "garbage"}
        return Findings(
            {"garbage": bad},
            [*lines(self.rows(records)), "", *(f"garbage {name}: {reason}" for name, reason in bad.items())],
            code=1 if bad else 0,
            texts={f"garbage-{name}.toml": tomli_w.dumps(scene_dict(cells[name])) for name in bad},
        )


def lines(rows):
    """Return the tables, and what the comparison with the reference showed."""
    from pages import table

    counts = Counter(row["kind"] for row in rows)
    shown = table(("class", "the run", "cells"), [(name, words, str(counts[name])) for name, words in MEANINGS.items()])
    shown += [
        "",
        *table(("coupling", *CLASSES, "largest residual"), [row_of(name, mine) for name, mine in grouped(rows)]),
    ]
    errors = [row["error_motion"] for row in rows if row["error_motion"] is not None]
    if errors:
        shown += [
            "",
            f"{len(errors)} runs without a warning were compared with the reference: their largest error is "
            f"{statistics.median(errors):.0e} in the median, at most {max(errors):.0e}.",
        ]
    return shown


def grouped(rows):
    """Yield the words of each coupling, and its rows."""
    for coupling in COUPLINGS:
        mine = [row for row in rows if tuple(row["coupling"]) == coupling]
        if mine:
            yield " ".join(map(str, coupling)), mine


def row_of(name, rows):
    counts = Counter(row["kind"] for row in rows)
    done = [row["residual"] or 0.0 for row in rows if row["kind"] not in ("refused", "stopped")]
    return [name, *(str(counts[kind] or "") for kind in CLASSES), f"{max(done):.0e}" if done else ""]
