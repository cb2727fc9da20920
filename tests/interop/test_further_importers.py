"""Ecos, FMUContainer, FMI4j and JavaFMI: the pair and each FMU alone, bit for bit what the same calls give by hand."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from importers import CONNECTIONS, HERE, PARAMETERS, SIZE, by_hand, installed, run

pytestmark = pytest.mark.interop

END = 0.4
SYSTEMS = {"pair": "spring.displacement", "beam": "beam.tip_displacement", "spring": "spring.displacement"}


class System:
    """The pair, or one FMU alone: a job for an importer, and what has to come out."""

    def __init__(
        self,
        name: str,
        folder: Path,
        scratch: Path,
        ours: np.ndarray,
        judge: Callable[[np.ndarray], None],
    ) -> None:
        self.output = SYSTEMS[name]
        names = ["beam", "spring"] if name == "pair" else [name]
        self.fmus = {n: str(folder / f"{n}.fmu") for n in names}
        self.connections = CONNECTIONS if name == "pair" else []
        self.parameters = {p: v for p, v in PARAMETERS.items() if p.split(".")[0] in names}
        if name == "spring":
            self.parameters["spring.velocity"] = -1.0
        self._ours = ours
        self._judge = judge
        self._scratch = scratch

    def check(self, rows: np.ndarray) -> None:
        assert np.array_equal(rows, self._expected())
        if self.connections:
            self._judge(rows)

    def _expected(self) -> np.ndarray:
        if self.connections:
            return self._ours
        fmus = {name: Path(path) for name, path in self.fmus.items()}
        return by_hand(fmus, self._scratch, self.parameters, (), self.output)


@pytest.fixture(params=SYSTEMS)
def system(
    request: pytest.FixtureRequest,
    fmu_folder: Path,
    tmp_path: Path,
    ours: np.ndarray,
    judge: Callable[[np.ndarray], None],
) -> System:
    return System(request.param, fmu_folder, tmp_path / "extracted", ours, judge)


def test_ecos(system: System) -> None:
    venv = installed("ecos") / "venv"
    job = {
        "size": SIZE,
        "end": END,
        "fmus": system.fmus,
        "parameters": system.parameters,
        "connections": system.connections,
        "outputs": [system.output],
    }
    output = run(venv / "bin/python", HERE / "run_ecos.py", json.dumps(job), env={"LD_LIBRARY_PATH": str(venv / "lib")})
    rows = np.array(json.loads(output.split("ROWS ")[1]))
    system.check(rows[:, 1])


@pytest.fixture(scope="module")
def java(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The class path of the importers and of our callers, compiled."""
    libraries = (installed("java") / "classpath").read_text().strip()
    classes = tmp_path_factory.mktemp("classes")
    run("javac", "-cp", libraries, "-d", classes, *(HERE / "java").glob("*.java"))
    return f"{classes}:{libraries}"


@pytest.mark.parametrize("importer", ["fmi4j", "javafmi"])
def test_java(system: System, java: str, importer: str) -> None:
    # Half-way each state goes through its serialised bytes.
    values = {**system.fmus, **system.parameters}
    output = run(
        # JavaFMI 2.24.3 sets a file's permissions by a method that Java 17 hides.
        *("java", "--add-opens", "java.prefs/java.util.prefs=ALL-UNNAMED", "-cp", java, "Pair", importer),
        *(str(SIZE), str(round(END / SIZE)), system.output),
        *(f"{name}={str(value).lower() if isinstance(value, bool) else value}" for name, value in values.items()),
        *(f"{start}>{end}" for start, end in system.connections),
    )
    # The spring alone warns that its tip is not where it was foreseen; FMI4j prints that in between.
    (rows,) = (line.removeprefix("ROWS ") for line in output.splitlines() if line.startswith("ROWS "))
    system.check(np.array(rows.split(), dtype=float))


def test_fmucontainer(system: System, tmp_path: Path) -> None:
    # It makes one FMU of several; its own binary then is the importer of ours.
    tool = installed("fmucontainer") / "venv/bin/fmucontainer"

    def cells(path: str) -> str:
        name, variable = path.split(".")
        return f"{name}.fmu;{variable}"

    lines = ["rule;from_fmu;from_port;to_fmu;to_port", *(f"FMU;{name}.fmu;;;" for name in system.fmus)]
    lines += [f"LINK;{cells(start)};{cells(end)}" for start, end in system.connections]
    lines += [f"START;{cells(n)};{int(v) if isinstance(v, bool) else v};" for n, v in system.parameters.items()]
    lines += [f"OUTPUT;{cells(system.output)};;y"]
    (tmp_path / "container.csv").write_text("\n".join(lines) + "\n")
    for name, path in system.fmus.items():
        (tmp_path / f"{name}.fmu").symlink_to(path)
    run(
        *(tool, "-container", f"container.csv:{SIZE}", "-no-auto-input", "-no-auto-output", "-no-auto-link"),
        cwd=tmp_path,
    )
    container = str(tmp_path / "container.fmu")
    result: Any = fmpy.simulate_fmu(container, stop_time=END, output_interval=SIZE, output=["y"], validate=False)
    system.check(result["y"][1:])


@pytest.mark.parametrize("model", ["beam", "spring"])
def test_fmutool_finds_nothing(fmu_folder: Path, model: str) -> None:
    tool = installed("fmucontainer") / "venv/bin/fmutool"
    done = subprocess.run([tool, "-input", fmu_folder / f"{model}.fmu", "-check"], capture_output=True, text=True)
    report = done.stdout + done.stderr
    assert done.returncode == 0
    assert "seems to be compliant with FMI-2.0" in report
    assert "No semantic error against the FMI-2 standard" in report
    assert "WARNING" not in report
    assert "ERROR" not in report
