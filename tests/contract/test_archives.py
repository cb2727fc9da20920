"""Archives made to do harm: refused before anything of them is unpacked, or harmless when it is."""

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
        unpack(tmp_path / "evil.fmu", folder)
    assert f"member {name!r} is no plain name" in str(refusal.value)
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["evil.fmu", "inner", "outer"]


@pytest.mark.parametrize("kind", [stat.S_IFLNK, stat.S_IFCHR, stat.S_IFIFO])
def test_links_and_devices_become_files(tmp_path, kind):
    info = ZipInfo("resources/link")
    info.external_attr = (kind | 0o777) << 16
    with ZipFile(tmp_path / "evil.fmu", "w") as file:
        file.writestr(info, b"/etc")
    unpack(tmp_path / "evil.fmu", tmp_path / "in")
    found = tmp_path / "in" / "resources" / "link"
    assert stat.S_ISREG(found.lstat().st_mode)
    assert found.read_bytes() == b"/etc"


def test_a_bomb_is_not_unpacked(tmp_path, monkeypatch):
    monkeypatch.setattr(archive, "MOST_BYTES", 4_000_000)
    with ZipFile(tmp_path / "bomb.fmu", "w") as file:
        file.writestr("resources/zeros", bytes(5_000_000), zipfile.ZIP_DEFLATED)
    with pytest.raises(UnsafeArchive, match="1 members of 5000000 bytes"):
        unpack(tmp_path / "bomb.fmu", tmp_path / "in")
    assert not (tmp_path / "in").exists()


def test_too_many_members(tmp_path):
    with ZipFile(tmp_path / "many.fmu", "w") as file:
        for i in range(archive.MOST_MEMBERS + 1):
            file.writestr(ZipInfo(str(i)), b"")
    with pytest.raises(UnsafeArchive, match="10001 members of 0 bytes"):
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
    said = f"error: {folder / 'spring.fmu'}: not a usable FMU: member '../../evil' is no plain name"
    assert refused("run", "soft", "--out", folder / "out").startswith(said)
    assert not (folder / "out").exists()
