"""What `pip install` and `springbeam doctor` promise."""

import os
import re
import subprocess
import sys
import zipfile
from importlib import metadata
from pathlib import Path

import pytest
from commands import HANGS, command, printed, ran
from packaging.requirements import Requirement

from springbeam.scene.reading import tomllib

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(("version", "found"), [("2.0", "{}.fmu +FMI 2.0, loads"), ("3.0", "{}3.fmu +FMI 3.0, loads")])
def test_doctor_finds_and_loads_both_fmus(monkeypatch, version, found):
    monkeypatch.setenv("SPRINGBEAM_FMI", version)
    shown = printed("doctor")
    assert metadata.version("springbeam") in shown
    for name in ("beam", "spring"):
        assert re.search(rf"^{found.format(name)}", shown, re.M)


def test_doctor_says_what_is_wrong(monkeypatch, tmp_path):
    monkeypatch.setenv("SPRINGBEAM_FMI", "4.0")
    assert command("doctor").stdout.count("SPRINGBEAM_FMI = '4.0': must be 2.0 or 3.0") == 2
    monkeypatch.delenv("SPRINGBEAM_FMI")
    (tmp_path / "beam.fmu").write_bytes(b"not an archive")
    monkeypatch.setenv("SPRINGBEAM_FMUS", str(tmp_path))
    result = command("doctor")
    assert result.exit_code == 1
    assert f"{tmp_path / 'beam.fmu'}: not a usable FMU" in result.stdout
    assert f"{tmp_path / 'spring.fmu'}: not found" in result.stdout


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


def test_every_dependency_has_a_lowest_and_a_tested_version():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    groups = [project["dependencies"], *(project["optional-dependencies"][name] for name in ("cluster", "dev"))]
    all_of_them = [requirement for group in groups for requirement in map(Requirement, group)]
    on = {"python_version": "3.11"}  # as constraints.txt says
    wanted = {r.name: r.specifier for r in all_of_them if r.marker is None or r.marker.evaluate(on)}
    del wanted["springbeam"]  # itself, with an extra
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    tested = {r.name: r.specifier for r in map(Requirement, (line for line in lines if not line.startswith("#")))}
    assert tested.keys() == wanted.keys()
    for name, specifier in wanted.items():
        assert [s.operator for s in specifier] == [">="], name
        (pin,) = tested[name]
        assert pin.operator == "=="
        assert specifier.contains(pin.version), name


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
    cli.app(["run", "soft", "--set", "time.t_end=0.05", "--out", sys.argv[1], "-q"])
except SystemExit as end:
    print(end.code, sockets)
"""
    assert ran(sys.executable, "-c", script, tmp_path / "out").splitlines()[-1] == "0 []"
