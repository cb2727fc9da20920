"""The FMUs in importers that others wrote, single and coupled by their connections; compared with our own numbers.

`./build.sh interop` installs them into a cache folder; those that are not there are skipped, with the reason.
"""

from __future__ import annotations

import csv
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from importers import CONNECTIONS, HERE, PARAMETERS, SIZE, installed, run

pytestmark = pytest.mark.interop


@pytest.mark.parametrize("model", ["beam", "spring"])
@pytest.mark.parametrize("rules", ["static", "rules"])
def test_vdmcheck_finds_nothing(fmu_folder: Path, model: str, rules: str) -> None:
    folder = next((installed("vdmcheck") / rules).iterdir())
    output = run("bash", folder / "VDMCheck2.sh", fmu_folder / f"{model}.fmu", cwd=folder)
    assert output.strip() == "No errors found."


def test_pair_by_hand_in_fmpy(ours: np.ndarray, judge: Callable[[np.ndarray], None]) -> None:
    judge(ours)


def test_pair_in_libcosim(fmu_folder: Path, ours: np.ndarray, judge: Callable[[np.ndarray], None]) -> None:
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
    assert rows[:, 1] == pytest.approx(ours, abs=1e-12)
    judge(rows[:, 1])


def test_pair_in_maestro(
    fmu_folder: Path, tmp_path: Path, ours: np.ndarray, judge: Callable[[np.ndarray], None]
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
    expected = np.concatenate([[0.0], ours])
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
