"""Pictures and tables of docs/accuracy.md:  .venv/bin/python docs/accuracy.py [STUDY]…   (all: a quarter of an hour)

The studies are those of `springbeam tradeoff`, one after the other. Pictures go to docs/images/tradeoff-STUDY.png,
tables into docs/accuracy.md, between the lines that name the study.
"""

from __future__ import annotations

import sys
from typing import Any, NamedTuple

from pages import IMAGES, shrink, table, write_section  # beside this script

from springbeam import load_scene, with_changes
from springbeam.scene import Scene
from springbeam.scene.automatic import choice
from springbeam.studies.study import record_all
from springbeam.studies.tables import number
from springbeam.studies.tradeoff import Point, Points, Tradeoff
from springbeam.studies.tradeoff.picture import draw


class Window(NamedTuple):
    """What is compared: a scene and its changes, and up to when [s]; ``None``: as far as it can be."""

    scene: str
    changes: dict[str, Any]
    until: float | None


WINDOWS = {
    "soft": Window("soft", {}, 0.0712),
    "soft-events": Window("soft", {}, None),
    "steel-bumper": Window("steel-bumper", {}, None),
    "beam-on-stop": Window("beam-on-stop", {}, None),
    "bar-impact": Window("bar-impact", {}, None),
    "paper-fig2": Window("paper-fig2", {"coupling": {"macro_step": 1e-7}}, 0.50002),
}
#: Schemes at the scene's own macro step and at 4 times of it.
SCHEMES = ("energy 0", "energy 1", "energy 2", "hermite 1", "hermite 2")


def cell(point: Point | None) -> str:
    return "none" if point is None else f"{point.name}: {1e3 * point.solve:.3g}"


def cheapest(found: Points) -> list[str]:
    rows = []
    for best in found.cheapest():
        rows.append([f"{best.target:.0e}", cell(best.ours), cell(best.scipy), number(best.ratio, ".3g")])
    return table(["error", "cheapest here: solve [ms]", "cheapest of scipy: solve [ms]", "ratio"], rows)


def side_by_side(found: Points, scene: Scene) -> list[str]:
    """Compare error, time of events [s], energy residual and doStep calls."""
    rows = []
    for H in (4.0 * scene.coupling.H, scene.coupling.H):
        here = {p.family: p for p in found.points if p.macro_step == H and p.setting.startswith("H = ")}
        cells = [compared(here[name]) for name in SCHEMES if name in here]
        if len(cells) < len(SCHEMES):
            continue
        rows.append([f"{H:.3g}", *cells, taken(scene, H)])
    return table(["H [s]", *SCHEMES, "auto takes"], rows)


def compared(point: Point) -> str:
    if point.errors is None:
        return "stopped"
    e = point.errors
    return f"{point.displacement:.0e}, {e.event_time:.0e}, {e.energy:.0e}, {point.do_steps}"


def taken(scene: Scene, H: float) -> str:
    auto = choice(with_changes(scene, coupling={"macro_step": H}))
    return f"`{auto.scheme}` {auto.degree}"


def main(names: list[str]) -> None:
    if unknown := set(names) - set(WINDOWS):
        raise SystemExit(f"{', '.join(sorted(unknown))}: no study; there are {', '.join(WINDOWS)}")
    for name in names or list(WINDOWS):
        window = WINDOWS[name]
        scene = with_changes(load_scene(window.scene), **window.changes)
        study = Tradeoff.of(scene, window.until)
        records = record_all(study)
        found, remarks = study.judged(records), study.notes(records)
        picture = IMAGES / f"tradeoff-{name}.png"
        draw(study.scene, found, remarks, picture)
        shrink(picture)
        notes = [f"* {note}" for note in remarks]
        lines = [*cheapest(found), "", *side_by_side(found, study.scene), *([""] if notes else []), *notes]
        write_section("accuracy.md", name, lines)
        print(f"{name}, up to t = {study.scene.time.t_end:.6g} s", *lines, "", sep="\n", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
