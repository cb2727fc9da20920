"""Measure the tables of own_fmu.md and draw its picture: FMUs of others against the elements that they describe.

It needs `pip install pythonfmu3` and a C compiler: python docs/own_fmu.py   (about a minute)
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from pages import IMAGES, shrink  # beside this script

from springbeam import Trajectory, load_scene, simulate
from springbeam.pictures.drawing import BLACK, BLUE, VERMILLION
from springbeam.scene import scene_from_dict

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS.parent / "tests" / "system"))

import oscillator  # noqa: E402

BEAM = {**load_scene("soft").model_dump(exclude_none=True)["beam"], "initial_velocity_slope": -1.0}
SPRING = {"mass": 1.0, "linear_stiffness": 3.0, "cubic_stiffness": -0.2, "initial_velocity": 1.0}
COMPLIANCE = {"law": "compliance", "stiffness": 1e5, "exponent": 1.5}
LINK = {"law": "link", "stiffness": 1e3}
TIE = {"law": "tie"}


def built(folder: Path, *, version: int) -> dict[str, Any]:
    """Build the FMU of the page by PythonFMU, or by PythonFMU3 for FMI 3.0, and return its table."""
    found = re.search(r"```py\n(from pythonfmu .*?)```", (DOCS / "own_fmu.md").read_text("utf-8"), re.S)
    assert found is not None
    source, tool = found[1], "pythonfmu"
    if version == 3:
        tool = "pythonfmu3"
        for two, three in (("pythonfmu", tool), ("Fmi2", "Fmi3"), ("Real", "Float64")):
            source = source.replace(two, three)
        kinds = "causality=Fmi3Causality.independent, variability=Fmi3Variability.continuous"
        clock = f'self.time = 0.0\n        self.register_variable(Float64("time", {kinds}))\n        '
        source = source.replace("self.m = 1.0", f"{clock}self.m = 1.0")
    (folder / tool).mkdir()
    (folder / tool / "msd.py").write_text(source, "utf-8")
    build = [sys.executable, "-m", tool, "build", "-f", "msd.py", "--handle-state"]
    subprocess.run(build, cwd=folder / tool, check=True)
    path = folder / tool / "MassSpringDamper.fmu"
    return {"fmu": str(path), "force": "F", "displacement": "x", "velocity": "v"}


def body(table: dict[str, Any], **parameters: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return a foreign body and the element that it describes."""
    element = {"element": "spring_damper", "mass": parameters["m"], "stiffness": parameters["k"]}
    element |= {"damping": parameters["c"], "velocity": parameters.get("v0", 0.0)}
    return {**table, "parameters": parameters}, element


def compared(beam: Any, spring: Any, contact: dict[str, Any]) -> tuple[Trajectory, Trajectory, float]:
    """Run a scene with foreign bodies, and with elements in their places; return both and how far they are apart."""
    runs = []
    for kind in (0, 1):
        bodies = [place[kind] if isinstance(place, tuple) else place for place in (beam, spring)]
        if kind == 0 and "fmu" in bodies[1]:
            bodies[1] = {**bodies[1], "force_sign": -1}
        data = {"time": {"t_end": 1.5}, "coupling": {"macro_step": 1e-3, "degree": 0}, "contact": contact}
        runs.append(simulate(scene_from_dict({**data, "beam": bodies[0], "spring": bodies[1]})))
    fmu, element = runs
    return fmu, element, max(float(np.abs(fmu[name] - element[name]).max()) for name in ("u_tip", "y"))


def by_python(folder: Path) -> None:
    """Print the table of FMUs by PythonFMU and draw their motion."""
    figure, axes = plt.subplots(2, 2, figsize=(8.0, 5.0), sharex=True, layout="constrained")
    for version in (2, 3):
        python = built(folder, version=version)
        below = body(python, m=1.0, k=30.0, c=0.5)
        above = body(python, m=2.0, k=30.0, c=0.5, v0=-0.5)
        together = body(python, m=1.0, k=9.0, c=0.5, v0=-0.5)
        pairs = (
            ("below our beam, compliance", BEAM, below, COMPLIANCE),
            ("above our spring, link", above, SPRING, LINK),
            ("two of them, link", above, below, LINK),
            ("two of them, tie", above, together, TIE),
        )
        print(f"PythonFMU, FMI {version}, degree 0, H = 1e-3 s")
        for axis, (what, beam, spring, contact) in zip(axes.flat, pairs, strict=True):
            run, exact, apart = compared(beam, spring, contact)
            print(f"{what:32} {apart:.0e}  {run.summary['max_interface_residual']:.0e}")
            if version == 2:
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


def main() -> None:
    """Print the tables and draw the picture."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        by_python(folder)
        names = {key: oscillator.ALL[key] for key in ("force", "displacement", "velocity", "integral", "integral_2")}
        plain = {**names, "fmu": str(oscillator.made(folder / "plain.fmu", state=False, slopes=False))}
        exact = {**names, "fmu": str(oscillator.made(folder / "exact.fmu"))}
        point = {"element": "point_mass", "mass": 2.0, "velocity": -0.5}
        print("plain C below a mass of 2 kg on a link")
        tried = [("jacobi", 0, plain), ("gauss_seidel", 0, plain), *(("energy", degree, exact) for degree in (0, 1, 2))]
        for scheme, degree, table in tried:
            errors, residual = [], 0.0
            for size in (2e-3, 1e-3):
                coupling = {"scheme": scheme, "degree": degree, "macro_step": size}
                spring = body(table, m=3.0, k=30.0, c=0.5)[0] | {"force_sign": -1}
                data = {"time": {"t_end": 0.3}, "beam": point, "contact": {**LINK, "stiffness": 100.0}}
                run = simulate(scene_from_dict({**data, "spring": spring, "coupling": coupling}))
                fine = {"scheme": "energy", "degree": 2, "macro_step": size}
                same = body(table, m=3.0, k=30.0, c=0.5)[1]
                truth = simulate(scene_from_dict({**data, "spring": same, "coupling": fine}))
                errors.append(float(np.abs(run.y - truth.y).max()))
                residual = run.summary["max_interface_residual"]
            print(f"{scheme:13} {degree}  {errors[0]:.1e}  {errors[1]:.1e}  {residual:.0e}")


if __name__ == "__main__":
    main()
