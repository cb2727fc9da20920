"""The FMUs in importers that others wrote, single and coupled by their connections; compared with our own numbers.

`./build.sh interop` installs them into a cache folder; those that are not there are skipped, with the reason.
"""

from __future__ import annotations

import csv
import json
import sys
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from importers import installed, run

pytestmark = pytest.mark.interop

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


@pytest.fixture(scope="module")
def ours(fmu_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[float], np.ndarray]:
    """y at every step of the pair, exchanged by hand the way these importers do."""

    def pair(end: float) -> np.ndarray:
        slaves = {}
        for name in ("beam", "spring"):
            description = fmpy.read_model_description(str(fmu_folder / f"{name}.fmu"))
            slave = fmpy.fmi2.FMU2Slave(
                guid=description.guid,
                unzipDirectory=fmpy.extract(
                    str(fmu_folder / f"{name}.fmu"), unzipdir=str(tmp_path_factory.mktemp(name))
                ),
                modelIdentifier=name,
                instanceName=name,
            )
            slaves[name] = slave, {v.name: v for v in description.modelVariables}
            slave.instantiate()
            slave.setupExperiment(startTime=0.0)

        def get(path: str) -> float:
            slave, variables = slaves[path.split(".")[0]]
            return float(slave.getReal([variables[path.split(".")[1]].valueReference])[0])

        def put(path: str, value: float | int | bool) -> None:
            slave, variables = slaves[path.split(".")[0]]
            variable = variables[path.split(".")[1]]
            kind = {"Real": slave.setReal, "Integer": slave.setInteger, "Boolean": slave.setBoolean}[variable.type]
            kind([variable.valueReference], [value])

        def exchange() -> None:
            values = [get(start) for start, _ in CONNECTIONS]
            for (_, target), value in zip(CONNECTIONS, values, strict=True):
                put(target, value)

        for path, value in PARAMETERS.items():
            put(path, value)
        for slave, _ in slaves.values():
            slave.enterInitializationMode()
        exchange()
        for slave, _ in slaves.values():
            slave.exitInitializationMode()
        y = []
        for i in range(round(end / SIZE)):
            for slave, _ in slaves.values():
                slave.doStep(i * SIZE, SIZE)
            exchange()
            y.append(get("spring.displacement"))
        for slave, _ in slaves.values():
            slave.terminate()
            slave.freeInstance()
        return np.array(y)

    return pair


@pytest.fixture(scope="module")
def judge(reference: np.ndarray, master_run: dict[float, np.ndarray]) -> Callable[[np.ndarray], None]:
    """y at 1 … 400 ms is as near to the event-driven solution as `springbeam run` with H = 1 ms, and near to that."""
    of_master = master_run[SIZE]

    def check(y: np.ndarray) -> None:
        n = len(y)
        assert n >= 399
        error, difference = np.abs(y - reference[:n]).max(), np.abs(y - of_master[:n]).max()
        print(f"error {error:.3e} m, from springbeam run {difference:.3e} m")
        assert error < 1.1 * np.abs(of_master - reference).max()
        assert difference < 4e-5  # the first step, whose tip is foreseen by its mean velocity over two

    return check


@pytest.mark.parametrize("model", ["beam", "spring"])
@pytest.mark.parametrize("rules", ["static", "rules"])
def test_vdmcheck_finds_nothing(fmu_folder: Path, model: str, rules: str) -> None:
    folder = next((installed("vdmcheck") / rules).iterdir())
    output = run("bash", folder / "VDMCheck2.sh", fmu_folder / f"{model}.fmu", cwd=folder)
    assert output.strip() == "No errors found."


def test_pair_by_hand_in_fmpy(ours: Callable[[float], np.ndarray], judge: Callable[[np.ndarray], None]) -> None:
    judge(ours(0.4))


def test_pair_in_libcosim(
    fmu_folder: Path, ours: Callable[[float], np.ndarray], judge: Callable[[np.ndarray], None]
) -> None:
    job = {
        "size": SIZE,
        "end": 0.4,
        "fmus": {name: str(fmu_folder / f"{name}.fmu") for name in ("beam", "spring")},
        "parameters": PARAMETERS,
        "connections": CONNECTIONS,
        "outputs": ["spring.displacement"],
    }
    output = run(installed("libcosim") / "venv/bin/python", HERE / "run_libcosim.py", json.dumps(job))
    rows = np.array(json.loads(output.split("ROWS ")[1]))
    assert rows[:, 1] == pytest.approx(ours(0.4), abs=1e-12)
    judge(rows[:, 1])


def test_pair_in_maestro(
    fmu_folder: Path, tmp_path: Path, ours: Callable[[float], np.ndarray], judge: Callable[[np.ndarray], None]
) -> None:
    classpath = (installed("maestro") / "classpath").read_text()

    def path(name: str) -> str:
        return "{" + name.split(".")[0] + "}." + name

    model: dict[str, Any] = {
        "fmus": {"{" + name + "}": (fmu_folder / f"{name}.fmu").as_uri() for name in ("beam", "spring")},
        "connections": {path(start): [path(end)] for start, end in CONNECTIONS},
        "parameters": {path(name): value for name, value in PARAMETERS.items()},
    }
    experiment = {
        "startTime": 0.0,
        "endTime": 0.4,
        "reportProgress": False,
        "liveLogInterval": 0,
        "loggingOn": False,
        "algorithm": {"type": "fixed-step", "size": SIZE},
        "logVariables": {"{spring}.spring": ["displacement"]},
    }
    (tmp_path / "model.json").write_text(json.dumps(model))
    (tmp_path / "experiment.json").write_text(json.dumps(experiment))
    run(
        *("java", "-cp", classpath, "org.intocps.maestro.Main", "import", "sg1", "-output", "out"),
        *("model.json", "experiment.json", "--interpret"),
        cwd=tmp_path,
    )
    with (tmp_path / "out/outputs.csv").open() as file:
        rows = np.array([[float(x) for x in row] for row in list(csv.reader(file))[1:]])
    expected = np.concatenate([[0.0], ours(0.4)])
    # Maestro adds up its times: its last step may be one more or less.
    n = min(len(rows), len(expected))
    assert n >= len(expected) - 1
    assert rows[:n, 1] == pytest.approx(expected[:n], abs=1e-10)
    judge(rows[1:401, 1])


@pytest.mark.parametrize(("model", "output"), [("beam", "tip_displacement"), ("spring", "displacement")])
def test_single_fmu_in_fmi_sim(fmu_folder: Path, tmp_path: Path, model: str, output: str) -> None:
    tool = installed("fmi-sim") / "bin/fmi-sim"
    name, value = {"beam": ("initial_velocity_slope", -1.0), "spring": ("displacement", 0.5)}[model]
    result = tmp_path / "out.csv"
    run(
        *(tool, "--model", fmu_folder / f"{model}.fmu", "--output-file", result, "co-simulation", "-f", "0.1"),
        *("--output-interval", "0.01", "--step", "0.01", "--init-values", f"{name}={value}"),
    )
    with result.open() as file:
        rows = list(csv.DictReader(file))
    expected = fmpy.simulate_fmu(
        str(fmu_folder / f"{model}.fmu"),
        stop_time=0.1,
        output_interval=0.01,
        start_values={name: value},
        output=[output],
    )
    theirs = np.array([float(row[output]) for row in rows])
    # Both make ten steps; their sizes differ by rounding.
    assert theirs == pytest.approx(expected[output], abs=1e-12)


def test_fmpy_accepts_both_from_its_command_line(fmu_folder: Path) -> None:
    for name in ("beam", "spring"):
        output = run(sys.executable, "-m", "fmpy", "validate", fmu_folder / f"{name}.fmu")
        assert "No problems found" in output
