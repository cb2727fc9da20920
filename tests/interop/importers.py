"""Where the importers are and how they are called, and what has to come out of them."""

from __future__ import annotations

import os
import subprocess
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import fmpy
import numpy as np
import pytest

HERE = Path(__file__).resolve().parent
SIZE = 1e-3

CONNECTIONS = [
    ("beam.tip_displacement", "spring.tip_displacement"),
    ("beam.tip_velocity", "spring.tip_velocity"),
    ("beam.tip_velocity_forecast", "spring.tip_velocity_forecast"),
    ("spring.reaction", "beam.tip_force"),
]
KINDS: dict[str, Callable[[str], float | int | bool]] = {"Real": float, "Integer": int, "Boolean": "true".__eq__}
#: Those of spring_beam.ssp.
PARAMETERS = {
    parameter.get("name", ""): KINDS[value.tag.split("}")[1]](value.get("value", ""))
    for parameter in ET.parse(HERE.parents[1] / "fmus/spring_beam/soft.ssv").getroot().iter()
    for value in parameter
    if parameter.tag.endswith("}Parameter")
}

CACHE = Path(
    os.environ.get("SPRINGBEAM_CACHE")
    or Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "springbeam"
)


def installed(name: str) -> Path:
    """The importer's folder; skips the test if it is not there."""
    folder = CACHE / name
    if not (folder / ".installed").is_file():
        pytest.skip(f"{name} is not in {CACHE}: ./build.sh interop installs it")
    return folder


def run(*command: str | Path, cwd: Path | None = None, env: dict[str, str] | None = None) -> str:
    """What the command printed; it must succeed."""
    done = subprocess.run(
        [str(c) for c in command],
        cwd=cwd,
        env={**os.environ, **(env or {})},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return done.stdout


def by_hand(
    fmus: Mapping[str, Path],
    folder: Path,
    parameters: Mapping[str, float | int | bool] = PARAMETERS,
    connections: Sequence[tuple[str, str]] = CONNECTIONS,
    output: str = "spring.displacement",
    end: float = 0.4,
) -> np.ndarray:
    """Return the output at every step: FMUs stepped, and exchanged by hand the way these importers do, unpacked below
    ``folder``."""
    slaves = {}
    for name, path in fmus.items():
        description = fmpy.read_model_description(str(path))
        unpacked = fmpy.extract(str(path), unzipdir=str(folder / name))
        slave = fmpy.instantiate_fmu(unpacked, description, "CoSimulation")
        slave.setupExperiment(startTime=0.0)
        slaves[name] = slave, {v.name: v for v in description.modelVariables}

    def get(path: str) -> float:
        slave, variables = slaves[path.split(".")[0]]
        return float(slave.getReal([variables[path.split(".")[1]].valueReference])[0])

    def put(path: str, value: float | int | bool) -> None:
        slave, variables = slaves[path.split(".")[0]]
        variable = variables[path.split(".")[1]]
        kind = {"Real": slave.setReal, "Integer": slave.setInteger, "Boolean": slave.setBoolean}[variable.type]
        kind([variable.valueReference], [value])

    def exchange() -> None:
        values = [get(start) for start, _ in connections]
        for (_, target), value in zip(connections, values, strict=True):
            put(target, value)

    for path, value in parameters.items():
        put(path, value)
    for slave, _ in slaves.values():
        slave.enterInitializationMode()
    exchange()
    for slave, _ in slaves.values():
        slave.exitInitializationMode()
    rows = []
    for i in range(round(end / SIZE)):
        for slave, _ in slaves.values():
            slave.doStep(i * SIZE, SIZE)
        exchange()
        rows.append(get(output))
    for slave, _ in slaves.values():
        slave.terminate()
        slave.freeInstance()
    return np.array(rows)
