"""Broken FMUs: the master names the file and the cause."""

import re
import zipfile

import pytest

import springbeam
from springbeam.bodies.factory import load_bodies
from springbeam.bodies.protocol import FmuError

Files = dict[str, bytes]
XML = "modelDescription.xml"
BINARY = "binaries/linux64/beam.so"


def edited(pattern, replacement):
    def edit(files):
        before = files[XML].decode()
        after = re.sub(pattern, replacement, before, count=1, flags=re.S)
        assert after != before, pattern
        files[XML] = after.encode()

    return edit


def without(name):
    return lambda files: files.__delitem__(name)


def replaced(name, content):
    return lambda files: files.__setitem__(name, content)


def renamed(old, new):
    return lambda files: files.__setitem__(new, files.pop(old))


TIP_FORCE = r'(name="tip_force" valueReference=")\d+'
BROKEN = {
    "no description": (without(XML), "modelDescription.xml"),
    "description is not XML": (replaced(XML, b"<fmiModelDescription"), "XML|markup|parse|syntax|find end"),
    "an entity from outside": (
        edited("<fmi", '<!DOCTYPE x [<!ENTITY secret SYSTEM "file:///etc/passwd">]>\n<fmi'),
        "document type declaration",
    ),
    "description breaks the schema": (edited(r"<CoSimulation", '<CoSimulation colour="red"'), "colour"),
    "another FMI version": (edited(r'fmiVersion="2.0"', 'fmiVersion="9.9"'), r"9\.9|version"),
    "no co-simulation": (
        edited(r"<CoSimulation.*</CoSimulation>", '<ModelExchange modelIdentifier="beam"/>'),
        "co-simulation",
    ),
    "another model identifier": (edited(r'modelIdentifier="beam"', 'modelIdentifier="cable"'), "'cable'"),
    "wrong GUID": (edited(r'guid="\{[^"]*\}"', 'guid="{0}"'), r"the GUID \{0\} is not that of this FMU"),
    "no binary": (without(BINARY), r"beam\.so|platform|binary|binaries"),
    "binary of another platform": (renamed(BINARY, "binaries/win64/beam.dll"), r"linux64|platform|beam\.so|binar"),
    "binary is no library": (replaced(BINARY, b"not an ELF file"), r"ELF|invalid|header|too short"),
    "empty binary": (replaced(BINARY, b""), r"file too short|ELF|empty"),
    "a variable is missing": (edited(r'name="tip_force"', 'name="tip_farce"'), "tip_force"),
    "value reference that does not exist": (edited(TIP_FORCE, r"\g<1>4711"), "4711|tip_force"),
    "wrong type": (
        edited(r'(name="tip_impulse".*?)<Real[^>]*/>', r'\1<Integer start="0"/>'),
        "tip_impulse",
    ),
}


def refusal(folder):
    with pytest.raises(FmuError) as caught:
        load_bodies(springbeam.load_scene("soft"), 0.0)
    message = str(caught.value)
    assert str(folder / "beam.fmu") in message
    return message


@pytest.mark.parametrize("name", [*BROKEN, "library of the other FMU"])
def test_broken_content_is_named(folder, fmu_folder, name):
    with zipfile.ZipFile(fmu_folder / "spring.fmu") as other:
        library = replaced(BINARY, other.read("binaries/linux64/spring.so"))
    damage, cause = BROKEN.get(name, (library, "is not that of this FMU"))
    path = folder / "beam.fmu"
    with zipfile.ZipFile(path) as archive:
        files = {entry: archive.read(entry) for entry in archive.namelist()}
    damage(files)
    with zipfile.ZipFile(path, "w") as archive:
        for entry, content in files.items():
            archive.writestr(entry, content)
    assert re.search(cause, refusal(folder).replace(str(path), ""))


@pytest.mark.parametrize(
    ("damage", "cause"),
    [
        (lambda path: path.unlink(), "not found"),
        (lambda path: path.write_bytes(b""), "zip"),
        (lambda path: path.write_bytes(b"not a zip"), "zip"),
        (lambda path: path.write_bytes(path.read_bytes()[:-2000]), "zip"),
    ],
    ids=["missing", "empty", "no archive", "truncated"],
)
def test_a_file_that_is_no_archive_is_named(folder, damage, cause):
    damage(folder / "beam.fmu")
    assert cause in refusal(folder).lower()
