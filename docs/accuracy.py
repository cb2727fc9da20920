"""Pictures and tables of docs/measured.md:  .venv/bin/python docs/accuracy.py [STUDY]…   (all: some minutes)

The studies are those of `springbeam tradeoff`, and scipy on the same problem (tests/bench/rivals.py), one after the
other, timed in processor time, of which what else runs on the machine takes none (with OMP_NUM_THREADS=1). Pictures go
to docs/images/tradeoff-STUDY.png, tables into docs/measured.md, between the lines that name the study.
"""

from __future__ import annotations

import sys
from time import process_time
from typing import Any, NamedTuple

from pages import DOCS, IMAGES, shrink, table, write_section  # beside this script

from springbeam import load_scene, with_changes
from springbeam.run import runner
from springbeam.scene import Scene
from springbeam.studies import tradeoff
from springbeam.studies.study import troubles
from springbeam.studies.tables import Row, in_words
from springbeam.studies.tradeoff import TARGETS, Tradeoff, cheapest

sys.path.insert(0, str(DOCS.parent / "tests" / "bench"))
import rivals


class Window(NamedTuple):
    """What is compared: a scene and its changes, and up to when [s]; ``None``: as far as it can be."""

    scene: str
    changes: dict[str, Any]
    until: float | None


WINDOWS = {
    "soft": Window("soft", {}, None),
}
runner.perf_counter = tradeoff.perf_counter = rivals.perf_counter = process_time  # type: ignore[attr-defined]
#: Schemes at the scene's own macro step and at 4 times of it.
SCHEMES = ("energy 0", "energy 1", "energy 2")


def cell(row: Row | None) -> str:
    return "none" if row is None else f"{row['family']}, {row['setting']}: {1e3 * row['cost_wall_time']:.3g}"


def choices(rows: list[Row], theirs: list[Row]) -> list[str]:
    cells = []
    for target, here, there in zip(TARGETS, cheapest(rows), cheapest(theirs), strict=True):
        ratio = there["cost_wall_time"] / here["cost_wall_time"] if here and there else None
        cells.append([f"{target:.0e}", cell(here), cell(there), in_words(ratio, ".2g")])
    return table(["error", "cheapest here: solve [ms]", "cheapest of scipy: solve [ms]", "ratio"], cells)


def side_by_side(rows: list[Row], scene: Scene) -> list[str]:
    """Compare the errors of the motion and of the times of events [s]."""
    lines = []
    for H in (4.0 * scene.coupling.H, scene.coupling.H):
        here = {row["family"]: row for row in rows if row.get("coupling.macro_step") == H}
        cells = [compared(here[name]) for name in SCHEMES if name in here]
        if len(cells) == len(SCHEMES):
            lines.append([f"{H:.3g}", *cells])
    return table(["H [s]", *SCHEMES], lines)


def compared(row: Row) -> str:
    if row["status"] != "done":
        return "stopped"
    return f"{row['error_motion']:.0e}, {row['error_event_time']:.0e}"


def main(names: list[str]) -> None:
    if unknown := set(names) - set(WINDOWS):
        raise SystemExit(f"{', '.join(sorted(unknown))}: no study; there are {', '.join(WINDOWS)}")
    for name in names or list(WINDOWS):
        window = WINDOWS[name]
        scene = with_changes(load_scene(window.scene), **window.changes)
        study = Tradeoff.of(scene, window.until)
        records = study.computed()
        rows, remarks = study.rows(records), troubles(records)
        study.findings(records).pictures["tradeoff"]().savefig(IMAGES / f"tradeoff-{name}.png", dpi=110)
        shrink(IMAGES / f"tradeoff-{name}.png")
        notes = [f"* {note}" for note in remarks]
        theirs = list(rivals.rows(study.scene, study.reference, study.times))
        lines = [*choices(rows, theirs), "", *side_by_side(rows, study.scene), *([""] if notes else []), *notes]
        write_section("measured.md", name, lines)
        print(f"{name}, up to t = {study.scene.time.t_end:.6g} s", *lines, "", sep="\n", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
