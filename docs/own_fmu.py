"""Measure the tables of own_fmu.md: FMUs by PythonFMU and in plain C, against the elements that they describe.

It needs `pip install pythonfmu` and a C compiler: python docs/own_fmu.py
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from springbeam import Trajectory, load_scene, simulate
from springbeam.scene import scene_from_dict

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS.parent / "tests" / "system"))

import oscillator  # noqa: E402

BEAM = {**load_scene("soft").model_dump(exclude_none=True)["beam"], "initial_velocity_slope": -1.0}
SPRING = {"mass": 1.0, "linear_stiffness": 3.0, "cubic_stiffness": -0.2, "initial_velocity": 1.0}
COMPLIANCE = {"law": "compliance", "stiffness": 1e5, "exponent": 1.5}
LINK = {"law": "link", "stiffness": 1e3}
TIE = {"law": "tie"}


def built(folder: Path) -> dict[str, Any]:
    """Build the FMU of the page by PythonFMU and return its table."""
    source = re.search(r"```py\n(from pythonfmu .*?)```", (DOCS / "own_fmu.md").read_text("utf-8"), re.S)
    assert source is not None
    (folder / "msd.py").write_text(source[1], "utf-8")
    subprocess.run(["pythonfmu", "build", "-f", "msd.py", "--handle-state"], cwd=folder, check=True)
    return {"fmu": str(folder / "MassSpringDamper.fmu"), "force": "F", "displacement": "x", "velocity": "v"}


def body(table: dict[str, Any], **parameters: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return a foreign body and the element that it describes."""
    element = {"element": "spring_damper", "mass": parameters["m"], "stiffness": parameters["k"]}
    element |= {"damping": parameters["c"], "velocity": parameters.get("v0", 0.0)}
    return {**table, "parameters": parameters}, element


def compared(beam: Any, spring: Any, **tables: Any) -> tuple[Trajectory, float]:
    """Run a scene with foreign bodies, and with elements in their places; return the run and their difference."""
    runs = []
    for kind in (0, 1):
        bodies = [place[kind] if isinstance(place, tuple) else place for place in (beam, spring)]
        if kind == 0 and "fmu" in bodies[1]:
            bodies[1] = {**bodies[1], "force_sign": -1}
        data = {"time": {"t_end": 0.3}, "coupling": {"macro_step": 1e-3}, **tables}
        runs.append(simulate(scene_from_dict({**data, "beam": bodies[0], "spring": bodies[1]})))
    fmu, element = runs
    return fmu, max(float(np.abs(fmu[name] - element[name]).max()) for name in ("u_tip", "y"))


def main() -> None:
    """Print the tables."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        python = built(folder)
        below = body(python, m=1.0, k=30.0, c=0.5)
        above = body(python, m=2.0, k=30.0, c=0.5, v0=-0.5)
        together = body(python, m=1.0, k=9.0, c=0.5, v0=-0.5)
        print("PythonFMU, degree 0, H = 1e-3 s")
        for what, beam, spring, contact in (
            ("below our beam, compliance", BEAM, below, COMPLIANCE),
            ("above our spring, link", above, SPRING, LINK),
            ("two of them, link", above, below, LINK),
            ("two of them, tie", above, together, TIE),
        ):
            run, apart = compared(beam, spring, contact=contact)
            print(f"{what:32} {apart:.0e}  {run.summary['max_interface_residual']:.0e}")
        names = {key: oscillator.ALL[key] for key in ("force", "displacement", "velocity")}
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
