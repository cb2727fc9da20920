"""Pictures and tables of docs/accuracy.md:  .venv/bin/python docs/accuracy.py [STUDY]…   (all: a quarter of an hour)

The studies are those of `springbeam tradeoff`, one after the other. Pictures go to docs/images/tradeoff-STUDY.png,
tables into docs/accuracy.md, between the lines that name the study.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any, NamedTuple

from PIL import Image

from springbeam import load_scene, with_changes
from springbeam.scene.automatic import choice
from springbeam.studies.tradeoff import Point, Study, study
from springbeam.studies.tradeoff.picture import draw

DOCS = Path(__file__).parent
_COLOURS = 64  #: of a picture: a fifth of its size


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
    return "none" if point is None else f"{point.configuration.name}: {1e3 * point.solve:.3g}"


def cheapest(found: Study) -> list[str]:
    lines = ["| error | cheapest here: solve [ms] | cheapest of scipy: solve [ms] | ratio |", "|---|---|---|---|"]
    for chosen in found.choices():
        ratio = f"{chosen.ratio:.3g}" if chosen.ours and chosen.scipy else ""
        lines.append(f"| {chosen.target:.0e} | {cell(chosen.ours)} | {cell(chosen.scipy)} | {ratio} |")
    return lines


def side_by_side(found: Study, macro_step: float) -> list[str]:
    """Error, time of events [s], energy residual and solve time over that of `energy` 0."""
    lines = ["| H [s] | " + " | ".join(SCHEMES) + " | auto takes |", "|---" * (len(SCHEMES) + 2) + "|"]
    for H in (4.0 * macro_step, macro_step):
        here = {
            p.configuration.family: p
            for p in found.points
            if p.configuration.scene.coupling.macro_step == H and p.configuration.setting.startswith("H = ")
        }
        if "energy 0" not in here:
            continue
        cells = [compared(here.get(name), here["energy 0"]) for name in SCHEMES]
        lines.append(f"| {H:.3g} | " + " | ".join([*cells, taken(found, H)]) + " |")
    return lines


def compared(point: Point | None, base: Point) -> str:
    if point is None or point.errors is None:
        return "stopped" if point is not None else ""
    e = point.errors
    event = "–" if e.event_time != e.event_time else f"{e.event_time:.0e}"
    return f"{point.displacement:.0e}, {event}, {e.energy:.0e}, {point.solve / base.solve:.1f}"


def taken(found: Study, H: float) -> str:
    auto = choice(with_changes(found.scene, coupling={"macro_step": H}))
    return f"`{auto.scheme}` {auto.degree}"


def written(name: str, lines: list[str], script: str = "accuracy.py", page_name: str = "accuracy.md") -> None:
    """Put ``lines`` into the page, in place of what stands between the marks of ``name`` and of who writes it."""
    page = DOCS / page_name
    text = page.read_text(encoding="utf-8")
    begin, end = f"<!-- {name}: docs/{script} -->\n", f"<!-- end of {name} -->"
    new, count = re.subn(
        re.escape(begin) + ".*?" + re.escape(end), lambda _: begin + "\n".join(lines) + "\n" + end, text, flags=re.S
    )
    if count != 1:
        raise SystemExit(f"{page}: no lines {begin.strip()} … {end}")
    page.write_text(new, encoding="utf-8")


def main(names: list[str]) -> None:
    if unknown := set(names) - set(WINDOWS):
        raise SystemExit(f"{', '.join(sorted(unknown))}: no study; there are {', '.join(WINDOWS)}")
    for name in names or list(WINDOWS):
        window = WINDOWS[name]
        scene = with_changes(load_scene(window.scene), **window.changes)
        found = study(scene, window.until)
        picture = DOCS / "images" / f"tradeoff-{name}.png"
        draw(found, picture)
        Image.open(picture).quantize(_COLOURS).save(picture, optimize=True)
        notes = [f"* {note}" for note in found.notes]
        lines = [*cheapest(found), "", *side_by_side(found, scene.coupling.H), *([""] if notes else []), *notes]
        written(name, lines)
        print(f"{name}, up to t = {found.scene.time.t_end:.6g} s", *lines, "", sep="\n", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
