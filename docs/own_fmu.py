"""Draws the picture of own_fmu.md, the FMU of that page beside the element it describes: python docs/own_fmu.py"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from pages import DOCS, IMAGES, shrink  # beside this script

from springbeam import Trajectory, load_scene, simulate
from springbeam.pictures.drawing import BLACK, BLUE, VERMILLION
from springbeam.scene import scene_from_dict

BEAM = {**load_scene("soft").model_dump(exclude_none=True)["beam"], "initial_velocity_slope": -1.0}
SPRING = {"mass": 1.0, "linear_stiffness": 3.0, "cubic_stiffness": -0.2, "initial_velocity": 1.0}
COMPLIANCE = {"law": "compliance", "stiffness": 1e5, "exponent": 1.5}
LINK = {"law": "link", "stiffness": 1e3}
TIE = {"law": "tie"}


def built(folder: Path) -> dict[str, Any]:
    """Build the FMU of the page by PythonFMU and return its table."""
    found = re.search(r"```py\n(from pythonfmu .*?)```", (DOCS / "own_fmu.md").read_text("utf-8"), re.S)
    assert found is not None
    (folder / "msd.py").write_text(found[1], "utf-8")
    build = [sys.executable, "-m", "pythonfmu", "build", "-f", "msd.py", "--handle-state"]
    subprocess.run(build, cwd=folder, check=True)
    return {"fmu": str(folder / "MassSpringDamper.fmu"), "force": "F", "displacement": "x", "velocity": "v"}


def body(table: dict[str, Any], **parameters: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the tables of an FMU and of the element that it describes."""
    element = {"element": "spring_damper", "mass": parameters["m"], "stiffness": parameters["k"]}
    element |= {"damping": parameters["c"], "velocity": parameters.get("v0", 0.0)}
    return {**table, "parameters": parameters}, element


def compared(beam: Any, spring: Any, contact: dict[str, Any]) -> tuple[Trajectory, Trajectory, float]:
    """Run a scene with FMUs and with elements in their places; return both and their largest difference [m]."""
    runs = []
    for kind in (0, 1):
        bodies = [place[kind] if isinstance(place, tuple) else place for place in (beam, spring)]
        if kind == 0 and "fmu" in bodies[1]:
            bodies[1] = {**bodies[1], "force_sign": -1}
        data = {"time": {"t_end": 1.5}, "coupling": {"macro_step": 1e-3, "degree": 0}, "contact": contact}
        runs.append(simulate(scene_from_dict({**data, "beam": bodies[0], "spring": bodies[1]})))
    fmu, element = runs
    return fmu, element, max(float(np.abs(fmu[name] - element[name]).max()) for name in ("u_tip", "y"))


def main() -> None:
    figure, axes = plt.subplots(2, 2, figsize=(8.0, 5.0), sharex=True, layout="constrained")
    with tempfile.TemporaryDirectory() as name:
        python = built(Path(name))
        below = body(python, m=1.0, k=30.0, c=0.5)
        above = body(python, m=2.0, k=30.0, c=0.5, v0=-0.5)
        together = body(python, m=1.0, k=9.0, c=0.5, v0=-0.5)
        pairs: tuple[tuple[str, Any, Any, dict[str, Any]], ...] = (
            ("below our beam, compliance", BEAM, below, COMPLIANCE),
            ("above our spring, link", above, SPRING, LINK),
            ("two of them, link", above, below, LINK),
            ("two of them, tie", above, together, TIE),
        )
        for axis, (what, beam, spring, contact) in zip(axes.flat, pairs, strict=True):
            run, exact, apart = compared(beam, spring, contact)
            axis.plot(run.time, 1e3 * run.u_tip, color=BLUE, linewidth=2.5, label="upper end")
            axis.plot(run.time, 1e3 * run.y, color=VERMILLION, linewidth=2.5, label="lower end")
            for column in (exact.u_tip, exact.y):
                axis.plot(exact.time, 1e3 * column, color=BLACK, linestyle=(0, (1, 4)), linewidth=1.0)
            axis.set_title(f"{what}: {apart:.0e} m apart", fontsize="medium")
    axes[0, 0].plot([], [], color=BLACK, linestyle=":", label="exact elements in their places")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    for axis in axes[1]:
        axis.set_xlabel("time [s]")
    for axis in axes[:, 0]:
        axis.set_ylabel("ends [mm]")
    figure.savefig(IMAGES / "own-fmu.png", dpi=100)
    shrink(IMAGES / "own-fmu.png")


if __name__ == "__main__":
    main()
