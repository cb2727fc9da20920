"""Where the importers are and how they are called, and what has to come out of them."""

import json
import os
import xml.etree.ElementTree as ET
from pathlib import Path

import fmpy
import numpy as np
import pytest
from commands import ran

HERE = Path(__file__).resolve().parent
SIZE, END = 1e-3, 0.4
#: What is run, and what is seen of it.
SYSTEMS = {"pair": "spring.displacement", "beam": "beam.tip_displacement", "spring": "spring.displacement"}

CONNECTIONS = [
    ("beam.tip_displacement", "spring.tip_displacement"),
    ("beam.tip_velocity", "spring.tip_velocity"),
    ("beam.tip_velocity_forecast", "spring.tip_velocity_forecast"),
    ("spring.reaction", "beam.tip_force"),
]
KINDS = {"Real": float, "Integer": int, "Boolean": "true".__eq__}
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


def installed(name):
    """The importer's folder; skips the test if it is not there."""
    folder = CACHE / name
    if not (folder / ".installed").is_file():
        pytest.skip(f"{name} is not in {CACHE}: ./build.sh interop installs it")
    return folder


class System:
    """The pair, or one FMU alone: a job for an importer, and what has to come out.

    ``reference``, ``of_master``: y of the pair at 1, 2, … 400 ms by the event-driven solver and by `springbeam run`.
    """

    def __init__(self, name, fmu_folder, scratch, reference, of_master):
        self.output = SYSTEMS[name]
        names = ["beam", "spring"] if name == "pair" else [name]
        self.fmus = {n: str(fmu_folder / f"{n}.fmu") for n in names}
        self.connections = CONNECTIONS if name == "pair" else []
        self.parameters = {p: v for p, v in PARAMETERS.items() if p.split(".")[0] in names}
        if name == "spring":
            self.parameters["spring.velocity"] = -1.0
        self._scratch, self._reference, self._of_master = scratch, reference, of_master

    def in_python(self, importer, ssp=None, **environment):
        """Return the rows of ``run_IMPORTER.py``, run by the importer's own Python; ``ssp``: of this system file."""
        job = {"size": SIZE, "end": END, "fmus": self.fmus, "parameters": self.parameters}
        job |= {"connections": self.connections, "outputs": [self.output], "ssp": ssp and str(ssp)}
        python = installed(importer) / "venv/bin/python"
        output = ran(python, HERE / f"run_{importer}.py", json.dumps(job), env=environment)
        return np.array(json.loads(output.split("ROWS ")[1]))[:, 1]

    def check(self, rows, within=0.0):
        """The rows are those of the same calls by hand, to the last bit unless ``within`` says otherwise [m].

        Those of the pair are as near to the event-driven solution as `springbeam run` with H = 1 ms, and near to that.
        """
        n = len(rows)
        assert n >= 399  # a tool that adds up its times may leave out the last step
        assert np.abs(rows - self.by_hand()[:n]).max() <= within
        if self.connections:
            error, difference = np.abs(rows - self._reference[:n]).max(), np.abs(rows - self._of_master[:n]).max()
            print(f"error {error:.3e} m, from springbeam run {difference:.3e} m")
            assert error < 1.1 * np.abs(self._of_master - self._reference).max()
            assert difference < 4e-5  # the first step, whose tip is foreseen by its mean velocity over two

    def by_hand(self):
        """Return the output at every step: FMUs stepped, and exchanged by hand the way these importers do."""
        slaves = {}
        for name, path in self.fmus.items():
            description = fmpy.read_model_description(path)
            unpacked = fmpy.extract(path, unzipdir=str(self._scratch / name))
            slave = fmpy.instantiate_fmu(unpacked, description, "CoSimulation")
            slave.setupExperiment(startTime=0.0)
            slaves[name] = slave, {v.name: v for v in description.modelVariables}

        def get(path):
            slave, variables = slaves[path.split(".")[0]]
            return float(slave.getReal([variables[path.split(".")[1]].valueReference])[0])

        def put(path, value):
            slave, variables = slaves[path.split(".")[0]]
            variable = variables[path.split(".")[1]]
            kind = {"Real": slave.setReal, "Integer": slave.setInteger, "Boolean": slave.setBoolean}[variable.type]
            kind([variable.valueReference], [value])

        def exchange():
            values = [get(start) for start, _ in self.connections]
            for (_, target), value in zip(self.connections, values, strict=True):
                put(target, value)

        for path, value in self.parameters.items():
            put(path, value)
        for slave, _ in slaves.values():
            slave.enterInitializationMode()
        exchange()
        for slave, _ in slaves.values():
            slave.exitInitializationMode()
        rows = []
        for i in range(round(END / SIZE)):
            for slave, _ in slaves.values():
                slave.doStep(i * SIZE, SIZE)
            exchange()
            rows.append(get(self.output))
        for slave, _ in slaves.values():
            slave.terminate()
            slave.freeInstance()
        return np.array(rows)
