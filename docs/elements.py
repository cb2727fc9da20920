"""Writes the table "Few elements of high degree" of docs/model.md:  .venv/bin/python docs/elements.py   (a minute)

Times are the smallest of several repetitions, in one process, as ratios to the first row.
"""

from __future__ import annotations

from contextlib import closing
from itertools import count
from timeit import repeat
from typing import Any

import numpy as np
from pages import table, write_section  # beside this script

from springbeam import Scene, load_scene, simulate, with_changes
from springbeam.bodies.fmu_bodies import FmuBeam
from springbeam.monolithic.semi_discrete import modal_beam
from springbeam.scene import Beam
from springbeam.studies.verify.alone import clamped_free_frequencies

MESHES: tuple[tuple[int, int, int], ...] = (  # elements, degree, modes
    (1000, 1, 64), (1000, 1, 250), (500, 1, 0), (100, 1, 0), (50, 1, 0), (10, 5, 0),
    (1, 12, 0), (2, 12, 0), (4, 12, 0), (8, 12, 0), (16, 12, 0),
)  # fmt: skip
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


def times(beam: Beam) -> tuple[float, float]:
    """Return the times of initialisation and of one step of the FMU [s]."""
    initialisation = min(repeat(lambda: FmuBeam(beam, 0.0, 0.0).close(), repeat=5, number=1))
    with closing(FmuBeam(beam, 0.0, 0.0)) as body:
        starts = count(0.0, MACRO_STEP)
        steps = repeat(lambda: body.advance(next(starts), MACRO_STEP, (1.0, 0.0, 0.0)), repeat=11, number=100)
        return initialisation, min(steps) / 100.0


def main() -> None:
    exact, finest = np.array(clamped_free_frequencies()[:10]), spring_top(mesh(*FINEST))
    rows, unit = [], None
    for n, degree, modes in MESHES:
        beam = mesh(n, degree, modes)
        omega = modal_beam(Beam(**beam)).omega[:10]
        error = np.abs(spring_top(beam) - finest)
        own = times(soft(beam).beam or Beam())
        unit = unit or own
        errors = (np.abs(omega / exact - 1.0).max(), error.max(), error[-1])
        rows.append([
            f"{n} × {degree}", f"{modes or f'all {2 * n * degree}'}", *(f"{e:.1e}" for e in errors),
            *(f"{t / first:.2g}" for t, first in zip(own, unit, strict=True)),
        ])  # fmt: skip
    head = ["elements × degree", "modes", "ω₁ … ω₁₀", "y, t ≤ 0.07 s [m]", "y at 0.07 s [m]", "initialisation", "step"]
    write_section("model.md", "elements", table(head, rows))


if __name__ == "__main__":
    main()
