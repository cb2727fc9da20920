"""The FMUs in importers that others wrote, single and coupled by their connections; compared with our own numbers.

`./build.sh interop` installs them into a cache folder; those that are not there are skipped, with the reason.
"""

import csv
import json
import subprocess
import sys
from pathlib import Path

import fmpy
import numpy as np
import pytest
from commands import ran
from importers import END, HERE, SIZE, SYSTEMS, installed

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
    libraries = str(installed("ecos") / "venv/lib")
    system.check(system.in_python("ecos", LD_LIBRARY_PATH=libraries))
    by_hand = system.by_hand()
    system.fmus = {name: path.replace(".fmu", "3.fmu") for name, path in system.fmus.items()}
    rows = system.in_python("ecos", LD_LIBRARY_PATH=libraries)
    assert np.array_equal(rows, by_hand[: len(rows)])


@pytest.mark.parametrize(
    ("importer", "file", "within"),
    [("libcosim", "spring_beam", 1e-12), ("ecos", "spring_beam", 0.0), ("ecos", "spring_beam3", 0.0)],
)
def test_system_file(system, fmu_folder, importer, file, within):
    """Components, connections and parameters as the .ssp has them: the pair that is connected by hand."""
    libraries = str(installed(importer) / "venv/lib")
    rows = system.in_python(importer, fmu_folder / f"{file}.ssp", LD_LIBRARY_PATH=libraries)
    system.check(rows, within)


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
    # The spring alone warns that its tip is not where it was foreseen; FMI4j prints that in between.
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
