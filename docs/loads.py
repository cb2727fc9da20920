"""The two pictures of docs/loads.md:  .venv/bin/python docs/loads.py   (about a minute)"""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
from pages import IMAGES, shrink  # beside this script

from springbeam import load_scene, simulate
from springbeam.pictures.drawing import BLACK, BLUE, VERMILLION
from springbeam.studies import sweep


def bifurcation() -> None:
    """Draw what `springbeam sweep vibro-impact --vary loads.0.frequency=25:65:81 --metric stroboscopic` draws."""
    todo = sweep.Sweep(
        scene=load_scene("vibro-impact"),
        vary=("loads.0.frequency=25:65:81",),
        metric=("stroboscopic", "settled_u_tip"),
    )
    with tempfile.TemporaryDirectory() as folder:
        found = todo.findings(todo.computed(workers=os.cpu_count() or 1))
        found.written(Path(folder), pictures=True)
        shutil.copy(Path(folder) / "sweep.png", IMAGES / "vibro-impact.png")


def shock() -> None:
    """Draw the board's end, the pad under it and the shock of the scene `pulse`."""
    run = simulate(load_scene("pulse"))
    figure, (upper, lower) = plt.subplots(
        2, 1, figsize=(7.0, 4.5), sharex=True, layout="constrained", height_ratios=(3, 1)
    )
    upper.plot(1e3 * run.time, 1e3 * run.u_tip, color=BLUE, label="end of the board")
    upper.plot(1e3 * run.time, 1e3 * run.y, color=VERMILLION, label="top of the pad")
    upper.set_ylabel("relative to the base [mm]")
    upper.legend(frameon=False)
    lower.plot(1e3 * run.time, run["load_0"], color=BLACK)
    lower.set(xlabel="time [ms]", ylabel="base [m/s²]")
    figure.savefig(IMAGES / "pulse.png", dpi=100)


if __name__ == "__main__":
    shock()
    bifurcation()
    for name in ("pulse.png", "vibro-impact.png"):
        shrink(IMAGES / name)
