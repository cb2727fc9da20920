"""Writes the table "Few elements of high degree" of docs/model.md:  .venv/bin/python docs/elements.py   (a minute)

A time is the smallest of five repetitions, as a ratio to the first row.
"""

from __future__ import annotations

import sys
from timeit import repeat
from typing import Any

import numpy as np
from pages import DOCS, table, write_section  # beside this script

from springbeam import Scene, load_scene, simulate, with_changes
from springbeam.bodies.fmu import release
from springbeam.bodies.own import FmuBeam
from springbeam.monolithic.semi_discrete import modal_beam
from springbeam.scene import Beam

sys.path.insert(0, str(DOCS.parent / "tests"))
from exact.alone import clamped_free_frequencies

#: Elements, degree, modes.
MESHES = ((1000, 1, 64), (500, 1, 0), (50, 1, 0), (10, 5, 0), (2, 12, 0), (4, 12, 0), (16, 12, 0))
FINEST = (41, 12, 0)
TIMES = np.linspace(0.001, 0.07, 70)
MACRO_STEP = 2.5e-4


def mesh(n: int, degree: int, modes: int) -> dict[str, Any]:
    return {"n_elements": n, "element_degree": degree, "n_modes": modes}


def soft(beam: dict[str, Any]) -> Scene:
    coupling = {"degree": 2, "macro_step": MACRO_STEP}
    return with_changes(load_scene("soft"), beam=beam, time={"t_end": 0.07}, coupling=coupling)


def spring_top(beam: dict[str, Any]) -> np.ndarray:
    run = simulate(soft(beam))
    return np.asarray(run.y[np.searchsorted(run.time, TIMES - 1e-9)])


def initialisation(beam: dict[str, Any]) -> float:
    """Return the time of initialisation of the FMU [s]."""
    own = soft(beam).beam
    assert own is not None
    return min(repeat(lambda: FmuBeam(own, 0.0, 0.0).close(), release, repeat=5, number=1))


def main() -> None:
    exact, finest = np.array(clamped_free_frequencies()[:10]), spring_top(mesh(*FINEST))
    rows, unit = [], None
    for n, degree, modes in MESHES:
        beam = mesh(n, degree, modes)
        omega = modal_beam(Beam(young_modulus=1.0, shear_modulus=1.0, **beam)).omega[:10]
        frequency = np.abs(omega / exact - 1.0).max()
        motion = np.abs(spring_top(beam) - finest).max()
        took = initialisation(beam)
        unit = unit or took
        kept = f"{modes or f'all {2 * n * degree}'}"
        rows.append([f"{n} × {degree}", kept, f"{frequency:.1e}", f"{motion:.1e}", f"{took / unit:.2g}"])
    head = ["elements × degree", "modes", "ω₁ … ω₁₀", "y, t ≤ 0.07 s [m]", "initialisation"]
    write_section("model.md", "elements", table(head, rows))


if __name__ == "__main__":
    main()
