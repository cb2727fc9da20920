"""What is in the .fmu files, what their binaries need and show, and those for Windows under Wine."""

import ctypes as ct
import os
import re
import shutil
import sys
import zipfile
from pathlib import Path

import fmpy
import pytest
from commands import ran
from fmpy import simulate_fmu
from fmpy.util import read_csv
from fmpy.validation import validate_fmu
from lxml import etree
from scenes import table

# -- what is in the .fmu files, and what their binaries need and show -------------------------------------------------


ROOT = Path(__file__).resolve().parents[2]


def test_static_model_is_the_packed_one_and_fmpy_reports_nothing(case, tmp_path):
    # The description made from the table, before there is a binary. Only a list of sources is added to it.
    table, no_sources, printed = (tmp_path / name for name in ("table", "list", "modelDescription.xml"))
    table.write_text(ran(ROOT / "build" / "fmus" / f"describe_{case.name}"), encoding="utf-8")
    no_sources.touch()
    description = [sys.executable, ROOT / "fmus" / "description.py", case.version[0], table, no_sources]
    printed.write_text(ran(*description), encoding="utf-8")
    assert validate_fmu(str(tmp_path)) == []
    packed = (case.folder / "modelDescription.xml").read_text(encoding="utf-8")
    without_list = re.sub(r">\s*<SourceFiles>.*</CoSimulation>", " />", packed, flags=re.DOTALL)
    assert without_list == printed.read_text(encoding="utf-8")


def test_binary_needs_only_libc_and_libm_and_binds_its_own_symbols_first(case):
    dynamic = ran("readelf", "-d", case.binary)
    needed = set(re.findall(r"\(NEEDED\).*\[(.*)\]", dynamic))
    assert needed <= {"libc.so.6", "libm.so.6", "ld-linux-x86-64.so.2"}
    assert "SYMBOLIC" in dynamic


def test_binary_shows_the_functions_of_its_version_and_nothing_else(case):
    symbols = {line.split()[-1] for line in ran("nm", "-D", "--defined-only", case.binary).splitlines()}
    header = Path(fmpy.__file__).parent / "c-code" / f"fmi{case.version[0]}FunctionTypes.h"
    declared = set(re.findall(r"\b(fmi[23]\w+)TYPE\b", header.read_text(encoding="utf-8")))
    if case.version == "3.0":
        assert symbols == declared  # FMPy looks for those of other interfaces, too
    else:
        # FMI 2.0.4: 25 common functions and 9 of co-simulation (fmi2GetStatus and its four typed forms are 5 of them).
        assert (symbols <= declared, len(symbols)) == (True, 34)


def test_binary_names_no_folder_of_the_build_machine(case):
    binary = case.binary.read_bytes()
    assert b"/home/" not in binary
    assert str(case.path.parents[1]).encode() not in binary


@pytest.mark.parametrize("version", ["3.0"])
def test_the_shape_is_four_arrays_and_inputs_have_derivatives(beam, spring):
    arrays = {name: variable.shape for name, variable in beam.variables.items() if variable.shape}
    assert arrays == dict.fromkeys(("deflection", "rotation", "bending_moment", "shear_force"), (21,))
    for fmu in (beam, spring):
        for name in fmu.named("input"):
            first = fmu.variables.get(f"der({name})")
            second = fmu.variables.get(f"der({name},2)")
            unused = ("tip_velocity_forecast", "tip_response", "tip_response_2")
            if fmu.variables[name].variability == "discrete" or name in unused:
                assert first is second is None
            else:
                assert (first.derivative.name, second.derivative.name) == (name, first.name)
    k = beam.moving()
    assert k.access("GetFloat64", beam.references("deflection"), 1, (ct.c_double * 1)()) == 3
    assert "nValues = 1, but the variables have 21" in k.message


def test_binary_loads_on_systems_since_glibc_2_14(case):
    # RHEL 7 has 2.17. See fmus/adapter/old_glibc.cpp, which is where a name listed here wants a definition.
    symbols = re.findall(r"GLIBC_([0-9.]+)\)?\s+(\S+)", ran("objdump", "-T", case.binary))
    assert len(symbols) > 20
    assert [(name, v) for v, name in symbols if tuple(int(part) for part in v.split(".")) > (2, 14)] == []


def test_reference_result_is_reproduced(case):
    folder = case.folder / "documentation" / "reference"
    signals = read_csv(str(folder / f"{case.name}_in.csv"))
    expected = read_csv(str(folder / f"{case.name}_ref.csv"))
    names = list(expected.dtype.names)
    result = simulate_fmu(
        str(case.path), stop_time=0.6, output_interval=0.01, input=signals, output=names[1:], validate=False
    )
    for name in names:
        # 12 digits are written; the beam's modes differ by rounding between compilers.
        assert result[name] == pytest.approx(expected[name], rel=1e-9, abs=1e-11)


# -- the Windows binaries under Wine, by the same C host as the Linux ones --------------------------------------------


HERE = Path(__file__).resolve().parent
HEADERS = Path(fmpy.__file__).parent / "c-code"
ZIG = HERE.parents[1] / "build" / "win64" / "zig-cc"


def arguments(case, scale=1.0, **start):
    """Arguments of the host; ``scale`` is of the force and the impulses, ``start`` has start values."""
    names = [case.force, case.impulse, case.displacement, case.velocity, "kinetic_energy", "dissipated_energy"]
    given = []
    for name, value in start.items():
        variable = case.variables[name]
        kind = {"Integer": "i", "Boolean": "b"}.get(variable.type, "")
        given.append(f"{kind}{variable.valueReference}={value}")
    return [case.description.guid, str(scale), *(str(case.variables[n].valueReference) for n in names), *given]


def rows(output):
    return [line.split() for line in output.splitlines()]


@pytest.fixture(scope="module")
def linux_host(tmp_path_factory):
    compiler = shutil.which(os.environ.get("CC", "cc"))
    if compiler is None:
        pytest.skip("no C compiler: the FMUs are not tried in a C host")
    host = tmp_path_factory.mktemp("host") / "host"
    ran(compiler, "-O1", "-isystem", HEADERS, HERE / "host.c", "-o", host, "-ldl", "-lm", "-pthread")
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


SPECIAL = table("contract/values.toml")["special"]


@pytest.mark.parametrize("version", ["2.0"])
@pytest.mark.parametrize("scale", [0.0, 1.0])
@pytest.mark.parametrize("name", SPECIAL)
def test_no_floating_point_trap_springs(spring, linux_host, name, scale):
    result = rows(ran(linux_host, spring.binary, *arguments(spring, scale, **SPECIAL[name])))
    assert len(result) == 4 * 11


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


def test_sources_have_what_importers_do_not_bring(case):
    """Sources include headers by their path from sources/; those of FMI 3.0 are the importer's."""
    sources = case.folder / "sources"
    headers = {p.name for p in sources.rglob("fmi*unctions.h")}
    assert headers == ({"fmi2Functions.h"} if case.version == "2.0" else set())
    if case.version == "3.0":
        folder = Path(fmpy.__file__).parent / "schema" / "fmi3"
        description = etree.parse(sources / "buildDescription.xml")
        etree.XMLSchema(etree.parse(folder / "fmi3BuildDescription.xsd")).assertValid(description)
        assert [element.get("name") for element in description.iter("IncludeDirectory")] == ["."]


@pytest.mark.parametrize("among", ["[^A-Za-z0-9_]", "[^A-Za-z0-9_]+"])
def test_names_differ_where_tools_spell_them_in_letters(case, among):
    """der(q_2) and der(q,2) were one variable, of two loads, in tools that write _ for each bracket."""
    plain = [re.sub(among, "_", name).strip("_") for name in case.variables]
    assert len(set(plain)) == len(plain)
