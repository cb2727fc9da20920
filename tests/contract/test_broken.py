"""Broken FMUs, where the master names the file and the cause; and archives made to do harm."""

import re
import zipfile
from pathlib import Path
from zipfile import ZipFile, ZipInfo

import pytest

import springbeam
from springbeam.bodies import archive
from springbeam.bodies.archive import UnsafeArchive, unpack
from springbeam.bodies.factory import load_bodies
from springbeam.bodies.protocol import FmuError

XML = "modelDescription.xml"
BINARY = "binaries/linux64/beam.so"
HERE = ("linux64",)


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


def both(*edits):
    return lambda files: [edit(files) for edit in edits]


def in_utf_16(files):
    files[XML] = files[XML].decode().encode("utf-16")


OTHERS = "it has binaries for win64 and none .* those of linux64"
DOCUMENT_TYPE = '<!DOCTYPE x [<!ENTITY secret SYSTEM "file:///etc/passwd">]>\n<fmi'
TIP_FORCE = r'(name="tip_force" valueReference=")\d+'
BROKEN = {
    "no description": (without(XML), "modelDescription.xml"),
    "description is not XML": (replaced(XML, b"<fmiModelDescription"), "XML|markup|parse|syntax|find end"),
    "an entity from outside": (edited("<fmi", DOCUMENT_TYPE), "document type declaration"),
    "an entity from outside in UTF-16": (
        both(edited("<fmi", DOCUMENT_TYPE), edited('encoding="UTF-8"', 'encoding="UTF-16"'), in_utf_16),
        "document type declaration",
    ),
    "description breaks the schema": (edited(r"<CoSimulation", '<CoSimulation colour="red"'), "colour"),
    "another FMI version": (edited(r'fmiVersion="2.0"', 'fmiVersion="9.9"'), r"9\.9|version"),
    "no co-simulation": (
        edited(r"<CoSimulation.*</CoSimulation>", '<ModelExchange modelIdentifier="beam"/>'),
        "co-simulation",
    ),
    "another model identifier": (
        both(
            edited(r'modelIdentifier="beam"', 'modelIdentifier="cable"'),
            renamed(BINARY, BINARY.replace("beam", "cable")),
        ),
        "'cable'",
    ),
    "wrong GUID": (edited(r'guid="\{[^"]*\}"', 'guid="{0}"'), r"the GUID \{0\} is not that of this FMU"),
    "no binary": (without(BINARY), r"beam\.so|platform|binary|binaries"),
    "binary of another platform": (renamed(BINARY, "binaries/win64/beam.dll"), OTHERS),
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
    here = Path.cwd()
    with pytest.raises(FmuError) as caught:
        load_bodies(springbeam.load_scene("soft"), 0.0, 2)
    message = str(caught.value)
    assert str(folder / "beam.fmu") in message
    assert Path.cwd() == here  # FMPy goes to the folder of a library
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


def named(name):
    info = ZipInfo("x")
    info.filename = info.orig_filename = name  # as it is: ZipInfo(name) would tidy it up
    return info


EVIL = (
    *("../evil", "resources/../../evil", "binaries/../evil", "..", "/tmp/evil", "//host/share/evil", "C:/evil"),
    *("modelDescription.xml:hidden", "..\\evil", "C:\\evil", "evil\n", "binaries//evil", "./evil"),
)


@pytest.mark.parametrize("name", EVIL)
def test_refused_by_name_and_nothing_is_unpacked(tmp_path, name):
    folder = tmp_path / "outer" / "inner"
    folder.mkdir(parents=True)
    with ZipFile(tmp_path / "evil.fmu", "w") as file:
        file.writestr("modelDescription.xml", b"<x/>")
        file.writestr(named(name), b"evil")
    with pytest.raises(UnsafeArchive) as refusal:
        unpack(tmp_path / "evil.fmu", folder, HERE)
    assert f"member {name!r} is no plain name" in str(refusal.value)
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["evil.fmu", "inner", "outer"]


def test_a_bomb_is_not_unpacked(tmp_path, monkeypatch):
    monkeypatch.setattr(archive, "MOST_BYTES", 4_000_000)
    with ZipFile(tmp_path / "bomb.fmu", "w") as file:
        file.writestr("resources/zeros", bytes(5_000_000), zipfile.ZIP_DEFLATED)
    with pytest.raises(UnsafeArchive, match="take 5000000 bytes unpacked, at most 4000000 are allowed; pack smaller"):
        unpack(tmp_path / "bomb.fmu", tmp_path / "in", HERE)
    assert not (tmp_path / "in").exists()
