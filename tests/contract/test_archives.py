"""Archives made to do harm: refused by name before anything of them is unpacked."""

import stat
import zipfile
from zipfile import ZipFile, ZipInfo

import pytest
from commands import refused

from springbeam.bodies import archive
from springbeam.bodies.archive import UnsafeArchive, unpack


def named(name):
    info = ZipInfo("x")
    info.filename = info.orig_filename = name  # as it is: ZipInfo(name) would tidy it up
    return info


def add(name, content=b"evil"):
    return lambda file: file.writestr(named(name), content)


def twice(first, second):
    def write(file):
        file.writestr(named(first), b"good")
        file.writestr(named(second), b"evil")

    return write


def special(kind):
    def write(file):
        info = ZipInfo("resources/link")
        info.external_attr = (kind | 0o777) << 16
        file.writestr(info, b"/etc")

    return write


def bomb(file):
    file.writestr("resources/zeros", bytes(5_000_000), zipfile.ZIP_DEFLATED)


EVIL = {
    "above": (add("../evil"), "member '../evil' leads out of the folder"),
    "above, from within": (add("resources/../../evil"), "member 'resources/../../evil' leads out of the folder"),
    "up and back": (add("binaries/../evil"), "leads out of the folder"),
    "the folder above": (add(".."), "leads out of the folder"),
    "absolute": (add("/tmp/evil"), "member '/tmp/evil' has an absolute name"),
    "another host": (add("//host/share/evil"), "has an absolute name"),
    "drive": (add("C:/evil"), "member 'C:/evil' has a drive letter"),
    "stream": (add("modelDescription.xml:hidden"), "has a drive letter or a colon"),
    "backslash": (add("..\\evil"), "has a backslash"),
    "drive and backslash": (add("C:\\evil"), "has a backslash"),
    "control character": (add("evil\n"), "cannot be printed"),
    "nothing between": (add("binaries//evil"), "has an empty part"),
    "here": (add("./evil"), "has an empty part"),
    "symbolic link": (special(stat.S_IFLNK), "member 'resources/link' is a symbolic link"),
    "device": (special(stat.S_IFCHR), "is a special file"),
    "pipe": (special(stat.S_IFIFO), "is a special file"),
    "twice": (twice("evil", "evil"), "member 'evil' is there twice"),
    "twice but for case": (twice("evil", "EVIL"), "member 'EVIL' is there twice"),
    "file and folder": (twice("evil", "evil/evil"), "member 'evil' is both a file and a folder"),
    "bomb": (bomb, "5000000 of 'resources/zeros'"),
}  # fmt: skip


@pytest.fixture
def small(monkeypatch):
    monkeypatch.setattr(archive, "MOST_BYTES", 4_000_000)


@pytest.mark.filterwarnings("ignore:Duplicate name")
@pytest.mark.usefixtures("small")
@pytest.mark.parametrize("name", EVIL)
def test_refused_by_name_and_nothing_is_unpacked(tmp_path, name):
    write, cause = EVIL[name]
    folder = tmp_path / "outer" / "inner"
    folder.mkdir(parents=True)
    with ZipFile(tmp_path / "evil.fmu", "w") as file:
        file.writestr("modelDescription.xml", b"<x/>")
        write(file)
    with pytest.raises(UnsafeArchive) as refusal:
        unpack(tmp_path / "evil.fmu", folder)
    assert cause in str(refusal.value)
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["evil.fmu", "inner", "outer"]


def test_too_many_members(tmp_path):
    with ZipFile(tmp_path / "many.fmu", "w") as file:
        for i in range(archive.MOST_MEMBERS + 1):
            file.writestr(ZipInfo(str(i)), b"")
    with pytest.raises(UnsafeArchive, match="10001 members, more than 10000"):
        unpack(tmp_path / "many.fmu", tmp_path / "in")


def test_a_size_that_is_declared_too_small_is_not_exceeded(tmp_path):
    """A member that unpacks to more than it says is damaged: what it says is all that is ever read of it."""
    path = tmp_path / "liar.fmu"
    with ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("zeros", bytes(1_000_000))
    content = bytearray(path.read_bytes())
    entry = content.rindex(b"PK\x01\x02")
    content[entry + 24 : entry + 28] = (1000).to_bytes(4, "little")
    path.write_bytes(content)
    with pytest.raises(zipfile.BadZipFile):
        unpack(path, tmp_path / "in")
    assert sum(file.stat().st_size for file in (tmp_path / "in").rglob("*")) <= 1000


@pytest.mark.parametrize("name", ["beam", "spring"])
def test_our_own_are_unpacked_to_the_last_byte(fmu_folder, tmp_path, name):
    unpack(fmu_folder / f"{name}.fmu", tmp_path)
    with ZipFile(fmu_folder / f"{name}.fmu") as file:
        files = {info.filename: file.read(info) for info in file.infolist() if not info.is_dir()}
    assert {str(p.relative_to(tmp_path)): p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()} == files


def test_the_command_names_file_and_member(folder):
    with ZipFile(folder / "spring.fmu", "a") as file:
        file.writestr(named("../../evil"), b"evil")
    said = f"error: {folder / 'spring.fmu'}: not a usable FMU: member '../../evil' leads"
    assert refused("run", "soft", "--out", folder / "out").startswith(said)
    assert not (folder / "out").exists()
