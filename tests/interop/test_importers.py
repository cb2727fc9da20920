"""The FMUs in importers that others wrote, single and coupled by their connections; compared with our own numbers."""

import csv
import json
import os
import subprocess
import sys
import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from commands import ran

# -- where the importers are and how they are called, and what has to come out of them --------------------------------


HERE = Path(__file__).resolve().parent
SIZE = 1e-3
END = 0.4
#: What is run, and what is seen of it.
SYSTEMS = {"pair": "spring.displacement", "beam": "beam.tip_displacement", "spring": "spring.displacement"}

CONNECTIONS = [
    ("beam.tip_displacement", "spring.tip_displacement"),
    ("beam.tip_velocity", "spring.tip_velocity"),
    ("beam.tip_velocity_forecast", "spring.tip_velocity_forecast"),
    ("beam.tip_response", "spring.tip_response"),
    ("beam.tip_response_2", "spring.tip_response_2"),
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

    ``reference``, ``of_master``: y of the pair at 1, 2, … 400 ms by `springbeam run` in short steps and in the pair's.
    """

    def __init__(self, name, fmu_folder, scratch, reference, of_master):
        self.output = SYSTEMS[name]
        names = ["beam", "spring"] if name == "pair" else [name]
        self.fmus = {n: str(fmu_folder / f"{n}.fmu") for n in names}
        self.connections = CONNECTIONS if name == "pair" else []
        self.parameters = {p: v for p, v in PARAMETERS.items() if p.split(".")[0] in names}
        if name == "spring":
            self.parameters["spring.velocity"] = -1.0
        self._scratch = scratch
        self._reference = reference
        self._of_master = of_master
        self.exchanged = {}  # before the first step, by `by_hand`

    def columns(self, importer, outputs, size=SIZE, ssp=None):
        """Return what ``run_IMPORTER.py`` prints, run by the importer's own Python; ``ssp``: of this system file."""
        job = {"size": size, "end": END, "fmus": self.fmus, "parameters": self.parameters}
        job |= {"connections": self.connections, "outputs": outputs, "ssp": ssp and str(ssp)}
        folder = installed(importer) / "venv"
        environment = {"LD_LIBRARY_PATH": str(folder / "lib")}  # of Ecos
        output = ran(folder / "bin/python", HERE / f"run_{importer}.py", json.dumps(job), env=environment)
        return np.array(json.loads(output.split("ROWS ")[1]))[:, 1:].T

    def in_python(self, importer, ssp=None):
        """Return the output at every step."""
        return self.columns(importer, [self.output], ssp=ssp)[0]

    def check(self, rows, within=0.0):
        """The rows are those of the same calls by hand, to the last bit unless ``within`` says otherwise [m].

        Those of the pair are as near to the event-driven solution as `springbeam run` with H = 1 ms, and near to that.
        """
        n = len(rows)
        assert n >= 399  # a tool that adds up its times may leave out the last step
        assert np.abs(rows - self.by_hand()[:n]).max() <= within
        if self.connections:
            error = np.abs(rows - self._reference[:n]).max()
            difference = np.abs(rows - self._of_master[:n]).max()
            print(f"error {error:.3e} m, from springbeam run {difference:.3e} m")
            assert error < 1.1 * np.abs(self._of_master - self._reference).max()
            assert difference < 4e-5  # the first step, whose tip is predicted by interpolation

    def by_hand(self):
        """Return the output at every step: FMUs stepped, and exchanged by hand the way these importers do, twice before
        the first step."""
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
        for _ in range(2):
            exchange()
        self.exchanged = {end: get(start) for start, end in self.connections}
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


# -- The FMUs in importers that others wrote, single and coupled by their connections; compared with our own numbers


@pytest.fixture
def system(request, fmu_folder, tmp_path, reference, master_run):
    """That of the parameter, or the pair."""
    name = getattr(request, "param", "pair")
    return System(name, fmu_folder, tmp_path / "extracted", reference, master_run[SIZE])


each_system = pytest.mark.parametrize("system", SYSTEMS, indirect=True)
each_model = pytest.mark.parametrize("model", ["beam", "spring"])
each_file = pytest.mark.parametrize(
    ("file", "version"), [("beam", "2.0"), ("spring", "2.0"), ("beam3", "3.0"), ("spring3", "3.0")]
)


@each_model
@pytest.mark.parametrize("rules", ["static", "rules"])
def test_vdmcheck_finds_nothing(fmu_folder, model, rules):
    folder = next((installed("vdmcheck") / rules).iterdir())
    output = ran("bash", folder / "VDMCheck2.sh", fmu_folder / f"{model}.fmu", cwd=folder)
    assert output.strip() == "No errors found."


@each_file
def test_fmpy_accepts_it_from_its_command_line(fmu_folder, file, version):
    assert "No problems found" in ran(sys.executable, "-m", "fmpy", "validate", fmu_folder / f"{file}.fmu")


@each_file
def test_fmutool_finds_nothing(fmu_folder, file, version):
    tool = installed("fmucontainer") / "venv/bin/fmutool"
    done = subprocess.run([tool, "-input", fmu_folder / f"{file}.fmu", "-check"], capture_output=True, text=True)
    report = done.stdout + done.stderr
    assert done.returncode == 0
    assert f"seems to be compliant with FMI-{version}" in report
    assert f"No semantic error against the FMI-{version[0]} standard" in report
    assert "WARNING" not in report
    assert "ERROR" not in report


def test_pair_by_hand_in_fmpy(system):
    system.check(system.by_hand())


@each_system
def test_libcosim(system):
    system.check(system.in_python("libcosim"), within=1e-12)  # its times are whole nanoseconds


@each_system
def test_ecos(system):
    """In both versions of FMI, to the same bits."""
    before = system.in_python("ecos")
    system.check(before)
    system.fmus = {name: path.replace(".fmu", "3.fmu") for name, path in system.fmus.items()}
    assert np.array_equal(system.in_python("ecos"), before)


@pytest.mark.parametrize("system", ["pair", "beam"], indirect=True)
def test_pathsim(system):
    """It exchanges after each FMU's step; with the force held back by one step the results are those of a parallel
    exchange, if inputs have start values: the hold takes its first value before one. (It writes 0 to every input, so
    the spring alone is another case.)"""
    system.by_hand()
    system.parameters |= system.exchanged
    system.check(system.in_python("pathsim"))


@pytest.mark.parametrize(
    ("importer", "file", "within"),
    [("libcosim", "spring_beam", 1e-12), ("ecos", "spring_beam", 0.0), ("ecos", "spring_beam3", 0.0)],
)
def test_system_file(system, fmu_folder, importer, file, within):
    """Components, connections and parameters as the .ssp has them: the pair that is connected by hand."""
    system.check(system.in_python(importer, fmu_folder / f"{file}.ssp"), within)


#: What adds up to the energy of the pair, and what counts warnings.
ENERGIES = [f"beam.{e}_energy" for e in ("kinetic", "strain", "dissipated")]
ENERGIES += [f"spring.{e}_energy" for e in ("kinetic", "potential", "contact", "dissipated")] + ["spring.impact_loss"]
WARNINGS = ["beam.warnings", "spring.warnings"]


@pytest.mark.parametrize("size", [1e-3, 3e-4, 1.7e-2])
@pytest.mark.parametrize("importer", ["ecos", "libcosim", "sofirpy"])
def test_the_pair_keeps_its_energy_at_any_step_size(system, importer, size):
    """Read after the exchange or, by Ecos and libcosim, before it: then a force that is not foreseen shows at once."""
    columns = system.columns(importer, ENERGIES + WARNINGS, size)
    energy = columns[: len(ENERGIES)].sum(axis=0)
    assert energy[3:] == pytest.approx(1 / 6, abs=1e-9)
    if importer != "sofirpy":  # it exchanges nothing before the first step
        assert np.all(columns[len(ENERGIES) :] == 0.0)


def test_sofirpy(system):
    """It exchanges nothing before the first step. Start values of inputs replace that: the same bits."""
    late = system.in_python("sofirpy")
    assert 1e-5 < np.abs(late - system.by_hand()).max() < 3e-4
    system.parameters |= system.exchanged
    system.check(system.in_python("sofirpy"))


def test_pair_in_maestro(system, tmp_path):
    classpath = (installed("maestro") / "classpath").read_text()

    def path(name):
        return "{" + name.split(".")[0] + "}." + name

    model = {
        "fmus": {"{" + name + "}": Path(file).as_uri() for name, file in system.fmus.items()},
        "connections": {path(start): [path(end)] for start, end in system.connections},
        "parameters": {path(name): value for name, value in system.parameters.items()},
    }
    experiment = {
        "startTime": 0.0,
        "endTime": END,
        "reportProgress": False,
        "liveLogInterval": 0,
        "loggingOn": False,
        "algorithm": {"type": "fixed-step", "size": SIZE},
        "logVariables": {"{spring}.spring": ["displacement"]},
    }
    (tmp_path / "model.json").write_text(json.dumps(model))
    (tmp_path / "experiment.json").write_text(json.dumps(experiment))
    ran(
        *("java", "-cp", classpath, "org.intocps.maestro.Main", "import", "sg1", "-output", "out"),
        *("model.json", "experiment.json", "--interpret"),
        cwd=tmp_path,
    )
    with (tmp_path / "out/outputs.csv").open() as file:
        rows = np.array([[float(x) for x in row] for row in list(csv.reader(file))[1:]])
    assert rows[0, 1] == pytest.approx(0.0, abs=1e-10)
    # Maestro adds up its times: its last step may be one more or less.
    system.check(rows[1:401, 1], within=1e-10)


@pytest.mark.parametrize(("model", "output"), [("beam", "tip_displacement"), ("spring", "displacement")])
def test_single_fmu_in_fmi_sim(fmu_folder, tmp_path, model, output):
    tool = installed("fmi-sim") / "bin/fmi-sim"
    name, value = {"beam": ("initial_velocity_slope", -1.0), "spring": ("displacement", 0.5)}[model]
    result = tmp_path / "out.csv"
    ran(
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


@pytest.fixture(scope="module")
def java(tmp_path_factory):
    """The class path of the importers and of our callers, compiled."""
    libraries = (installed("java") / "classpath").read_text().strip()
    classes = tmp_path_factory.mktemp("classes")
    ran("javac", "-cp", libraries, "-d", classes, *(HERE / "java").glob("*.java"))
    return f"{classes}:{libraries}"


@each_system
@pytest.mark.parametrize("importer", ["fmi4j", "javafmi"])
def test_java(system, java, importer):
    # Half-way each state goes through its serialised bytes.
    values = {**system.fmus, **system.parameters}
    output = ran(
        # JavaFMI 2.24.3 sets a file's permissions by a method that Java 17 hides.
        *("java", "--add-opens", "java.prefs/java.util.prefs=ALL-UNNAMED", "-cp", java, "Pair", importer),
        *(str(SIZE), str(round(END / SIZE)), system.output),
        *(f"{name}={str(value).lower() if isinstance(value, bool) else value}" for name, value in values.items()),
        *(f"{start}>{end}" for start, end in system.connections),
    )
    # The spring alone warns that its tip is not where it was predicted; FMI4j prints that in between.
    (rows,) = (line.removeprefix("ROWS ") for line in output.splitlines() if line.startswith("ROWS "))
    system.check(np.array(rows.split(), dtype=float))


@each_system
def test_fmucontainer(system, tmp_path):
    # It makes one FMU of several; its own binary then is the importer of ours.
    tool = installed("fmucontainer") / "venv/bin/fmucontainer"

    def cells(path):
        name, variable = path.split(".")
        return f"{name}.fmu;{variable}"

    lines = ["rule;from_fmu;from_port;to_fmu;to_port", *(f"FMU;{name}.fmu;;;" for name in system.fmus)]
    lines += [f"LINK;{cells(start)};{cells(end)}" for start, end in system.connections]
    lines += [f"START;{cells(n)};{int(v) if isinstance(v, bool) else v};" for n, v in system.parameters.items()]
    lines += [f"OUTPUT;{cells(system.output)};;y"]
    (tmp_path / "container.csv").write_text("\n".join(lines) + "\n")
    for name, path in system.fmus.items():
        (tmp_path / f"{name}.fmu").symlink_to(path)
    ran(
        *(tool, "-container", f"container.csv:{SIZE}", "-no-auto-input", "-no-auto-output", "-no-auto-link"),
        cwd=tmp_path,
    )
    container = str(tmp_path / "container.fmu")
    result = fmpy.simulate_fmu(container, stop_time=END, output_interval=SIZE, output=["y"], validate=False)
    system.check(result["y"][1:])


# -- binaries that FMPy compiles from what is packed in sources/ do the same as those that are shipped ----------------


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
    shipped = fmu_folder / f"{model}.fmu"
    compiled = tmp_path / f"{model}.fmu"
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
