"""Writes the table of contact laws of docs/choose.md:  .venv/bin/python docs/choose.py   (a minute)"""

from __future__ import annotations

import tempfile
from pathlib import Path

from pages import table, write_section  # beside this script

from springbeam import Scene, load_scene, simulate, with_changes
from springbeam.results.totals import peak_force
from springbeam.scene.files import beginning

#: Laws, and numbers of linear elements.
LAWS = ("transmission", "unilateral", "compliance")
MESHES = (10, 20, 40, 80, 160)
MACRO_STEP = 1e-5
#: A window as short as the first waves after an impact [s].
SHORT = 2e-5


def scene() -> Scene:
    """The scene of ``springbeam new``, with linear elements and all modes, up to 0.05 s."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bumper.toml"
        path.write_text(beginning("bumper"), encoding="utf-8")
        found = load_scene(path)
    mesh = {"element_degree": 1, "n_modes": 0, "reduced_integration": True}
    coupling = {"scheme": "energy", "degree": 2, "macro_step": MACRO_STEP}
    return with_changes(found, time={"t_end": 0.05}, beam=mesh, coupling=coupling)


def row(law: str, elements: int) -> list[str]:
    run = simulate(with_changes(scene(), beam={"n_elements": elements}, contact={"law": law}))
    steps = run.steps
    assert steps is not None
    short, _ = peak_force(steps, run.events, SHORT)
    first = next(event.time for event in run.events if event.kind.opens)
    numbers = (
        f"{run.contact_force.max():.3g}",
        f"{short:.3g}",
        f"{run.summary['contact_force_max']:.3g}",
        f"{run.summary['contact_impulse']:.4f}",
        f"{1e3 * (first - run.events[0].time):.2f}",
    )
    return [f"`{law}`", str(elements), *numbers]


HEAD = (
    "law",
    "elements",
    "peak at an instant [N]",
    "mean over 20 µs [N]",
    "`contact_force_max` [N]",
    "impulse [N·s]",
    "first contact lasts [ms]",
)


if __name__ == "__main__":
    write_section("choose.md", "laws", table(HEAD, [row(law, n) for law in LAWS for n in MESHES]))
