"""Binaries that FMPy compiles from what is packed in sources/ do the same as those that are shipped."""

import os
import sys
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from commands import ran

SOFT_BEAM = {"young_modulus": 100.0, "shear_modulus": 100.0, "initial_velocity_slope": -1.0, "alpha_b": 1e-3}
SOFT_SPRING = {"linear_stiffness": 3.0, "cubic_stiffness": -0.2, "damping": 0.1, "velocity": -1.0}
RUNS = {
    "beam": [SOFT_BEAM, {**SOFT_BEAM, "integrator": 2}],
    "spring": [
        {**SOFT_SPRING, "stop_enabled": True, "stop_position": -0.015, "restitution": 0.5},
        {**SOFT_SPRING, "contact_law": 2, "compliance_stiffness": 1e4, "compliance_exponent": 1.5, "velocity": 1.0},
    ],
}


@pytest.mark.parametrize("model", ["beam", "spring"])
def test_compiled_from_its_own_sources_it_gives_the_same_bits(fmu_folder, tmp_path, model):
    shipped, compiled = fmu_folder / f"{model}.fmu", tmp_path / f"{model}.fmu"
    description = fmpy.read_model_description(str(shipped))
    if not description.buildConfigurations:
        pytest.skip(f"{model}.fmu is packed without the source of SUNDIALS")
    with zipfile.ZipFile(shipped) as old, zipfile.ZipFile(compiled, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            if not name.startswith("binaries/"):
                new.writestr(name, old.read(name))
    # The CMake and Ninja of this environment, which FMPy and the build use.
    tools = {
        "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]),
        "CMAKE_GENERATOR": "Ninja",
    }
    ran(sys.executable, "-m", "fmpy", "compile", compiled, env=tools, cwd=tmp_path)
    with zipfile.ZipFile(compiled) as archive:
        assert f"binaries/linux64/{model}.so" in archive.namelist()
    outputs = [v.name for v in description.modelVariables if v.causality == "output"]
    for values in RUNS[model]:
        results = [
            fmpy.simulate_fmu(str(fmu), stop_time=1.0, output_interval=2e-3, start_values=values, output=outputs)
            for fmu in (shipped, compiled)
        ]
        # -O3 instead of -O2 and other link options: neither may change a double.
        for name in outputs:
            assert np.array_equal(results[0][name], results[1][name]), (name, values)
            assert np.isfinite(results[0][name]).all()
