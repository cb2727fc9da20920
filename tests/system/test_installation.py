"""What `pip install` and `springbeam doctor` promise."""

import os
import re
import shutil
import subprocess
import sys
import zipfile
from importlib import metadata
from pathlib import Path

import pytest
from commands import HANGS, command, printed, ran

ROOT = Path(__file__).parents[2]
FMUS = ("beam.fmu", "spring.fmu", "beam3.fmu", "spring3.fmu")


def test_doctor_has_an_exact_answer_of_each_fmu(monkeypatch):
    shown = printed("doctor")
    assert metadata.version("springbeam") in shown
    for file in FMUS:
        off, bound = re.search(rf"^{file} .*error (\S+) of \S+ m \(at most (\S+)\)", shown, re.M).groups()
        assert float(off) <= float(bound) < 1e-7


def changed(path, variable, instead):
    """Replace an FMU by one whose ``variable`` is another one: the two value references are exchanged."""
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    text = members["modelDescription.xml"].decode()
    pattern = r'(name="{}"[^>]*?valueReference=")(\d+)'
    one, other = (re.search(pattern.format(name), text)[2] for name in (variable, instead))
    for name, reference in ((variable, other), (instead, one)):
        text = re.sub(pattern.format(name), rf"\g<1>{reference}", text)
    members["modelDescription.xml"] = text.encode()
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)


@pytest.mark.parametrize(
    ("file", "variable", "instead"),
    [
        ("beam.fmu", "tip_displacement", "tip_rotation"),
        ("beam3.fmu", "young_modulus", "initial_velocity_slope"),
        ("spring.fmu", "linear_stiffness", "cubic_stiffness"),
        ("spring3.fmu", "displacement", "velocity"),
    ],
)
def test_doctor_finds_an_fmu_that_is_wrong(monkeypatch, tmp_path, fmu_folder, file, variable, instead):
    for name in FMUS:
        shutil.copy(fmu_folder / name, tmp_path)
    changed(tmp_path / file, variable, instead)
    monkeypatch.setenv("SPRINGBEAM_FMUS", str(tmp_path))
    result = command("doctor")
    assert result.exit_code == 1
    assert re.findall(r"^(\S+) +FAILED: ", result.stdout, re.M) == [file]


@pytest.fixture
def wheel():
    """Built by `./build.sh wheel`, which names it."""
    if "SPRINGBEAM_WHEEL" not in os.environ:
        pytest.skip("no wheel: ./build.sh wheel builds one and runs this test")
    return Path(os.environ["SPRINGBEAM_WHEEL"])


def test_a_wheel_brings_the_fmus_and_runs_where_there_is_no_checkout(wheel, tmp_path):
    assert wheel.name.startswith(f"springbeam-{metadata.version('springbeam')}-py3-none-")
    if os.uname()[::4] == ("Linux", "x86_64"):
        assert wheel.stem.endswith("-manylinux_2_17_x86_64")  # as auditwheel says of its binaries
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        archive.extractall(tmp_path / "site")
    fmus = [f"{name}.fmu" for name in ("beam", "spring", "beam3", "spring3")]
    assert {f"springbeam/fmus/{name}" for name in (*fmus, "spring_beam.ssp", "spring_beam3.ssp")} <= names
    assert {f"springbeam/scene/shipped/{p.name}" for p in (ROOT / "master/springbeam/scene/shipped").iterdir()} <= names
    script = """
import sys
sys.meta_path = [finder for finder in sys.meta_path if "editable" not in type(finder).__module__]
import springbeam
print(springbeam.__file__, len(springbeam.simulate(springbeam.load_scene("duffing"))))
"""
    run = subprocess.run(
        [sys.executable, "-c", script], env={"PYTHONPATH": str(tmp_path / "site"), "PATH": ""}, cwd=tmp_path,
        capture_output=True, text=True, check=True, timeout=HANGS,
    )  # fmt: skip
    assert run.stdout.split() == [str(tmp_path / "site/springbeam/__init__.py"), "2001"]


def test_a_run_uses_no_network(tmp_path):
    script = """
import socket, sys
sockets = []

def audit(event, arguments):
    if event.startswith("socket."):
        sockets.append(event)

sys.addaudithook(audit)
from springbeam import cli
try:
    cli.app(["run", "soft", "--set", "time.t_end=0.05", "--out", sys.argv[1], "--no-plots", "-q"])
except SystemExit as end:
    print(end.code, sockets)
"""
    assert ran(sys.executable, "-c", script, tmp_path / "out").splitlines()[-1] == "0 []"
