"""The Windows binaries under Wine, by the same C host as the Linux ones."""

import os
import shutil
import zipfile
from pathlib import Path

import fmpy
import pytest
from commands import ran

HERE = Path(__file__).resolve().parent
HEADERS = Path(fmpy.__file__).parent / "c-code"
ZIG = HERE.parents[1] / "build" / "win64" / "zig-cc"


def arguments(case):
    names = [case.force, case.impulse, case.displacement, case.velocity, "kinetic_energy", "dissipated_energy"]
    return [case.description.guid, *(str(case.variables[n].valueReference) for n in names)]


def rows(output):
    return [line.split() for line in output.splitlines()]


@pytest.fixture(scope="module")
def linux_host(tmp_path_factory):
    compiler = shutil.which(os.environ.get("CC", "cc"))
    if compiler is None:
        pytest.skip("no C compiler: the FMUs are not tried in a C host")
    host = tmp_path_factory.mktemp("host") / "host"
    ran(compiler, "-O1", "-isystem", HEADERS, HERE / "host.c", "-o", host, "-ldl")
    return host


@pytest.fixture(scope="module")
def wine_prefix(tmp_path_factory):
    """Made by the first run; takes half a minute."""
    return tmp_path_factory.mktemp("wine") / "prefix"


@pytest.mark.parametrize("version", ["2.0"])
def test_c_host(case, linux_host):
    result = rows(ran(linux_host, case.binary, *arguments(case)))
    repeated = [row for row in result if row[0] == "100"]
    assert len(repeated) == 8  # step 100 was made twice, from the same state
    assert repeated[:4] == repeated[4:]


@pytest.mark.parametrize("version", ["2.0"])
def test_windows_binary_under_wine(case, linux_host, wine_prefix, tmp_path):
    with zipfile.ZipFile(case.path) as archive:
        name = f"binaries/win64/{case.name}.dll"
        if name not in archive.namelist():
            pytest.skip(f"{case.path.name} has no Windows binary: ./build.sh win64 makes one")
        archive.extract(name, tmp_path)
    wine = shutil.which("wine64") or shutil.which("wine") or shutil.which("wine64", path="/usr/lib/wine")
    if wine is None or not ZIG.is_file():
        pytest.skip("Wine is not installed (Debian: wine64): THE WINDOWS BINARIES ARE NOT TESTED")
    host = tmp_path / "host.exe"
    ran(ZIG, "-O1", "-isystem", HEADERS, HERE / "host.c", "-o", host)
    environment = {**os.environ, "WINEPREFIX": str(wine_prefix), "WINEDEBUG": "-all"}
    theirs = rows(ran(wine, host, f"binaries\\win64\\{case.name}.dll", *arguments(case), cwd=tmp_path, env=environment))
    ours = rows(ran(linux_host, case.binary, *arguments(case)))
    assert [row[:2] for row in theirs] == [row[:2] for row in ours]
    repeated = [row for row in theirs if row[0] == "100"]
    assert repeated[:4] == repeated[4:]
    # Another compiler and C library: elementary functions may differ in the last place.
    for mine, its in zip(ours, theirs, strict=True):
        assert float(its[3]) == pytest.approx(float(mine[3]), rel=1e-10, abs=1e-14)
