"""FMU files: find them, and unpack archives of others safely inside their folder."""

from __future__ import annotations

import os
import re
import zipfile
from pathlib import Path

from .protocol import FmuError

#: Largest size of all members that are unpacked.
MOST_BYTES = 1 << 31
#: Largest number of members.
MOST_MEMBERS = 10_000
#: Parts that mean no other folder on any system, between slashes.
_PLAIN = re.compile(r"(?:(?!\.{1,2}(?:/|$))[^/\\:\x00-\x1f]+(?:/|$))+")
#: Folders that a running FMU may use in addition to the binaries of this platform. The sources of the beam, with
#: Eigen's, are 300 files, which would take most of the time.
_USED = ("modelDescription.xml", "resources/")
_BINARIES = "binaries/"
_EXECUTABLE = 0o111
#: Endings of the names of our FMUs, by version of FMI.
ENDINGS = {"2.0": "", "3.0": "3"}
_PACKAGE = Path(__file__).resolve().parents[1]


def fmu_directory() -> Path:
    """Return the folder of our FMUs: $SPRINGBEAM_FMUS, the installed package, or the checkout."""
    chosen = os.environ.get("SPRINGBEAM_FMUS")
    if chosen:
        return Path(chosen)
    installed = _PACKAGE / "fmus"
    return installed if installed.is_dir() else _PACKAGE.parents[1] / "fmus"


def fmi_version() -> str:
    """Return the version of FMI that $SPRINGBEAM_FMI names, 2.0 (default) or 3.0. Raises FmuError for another one."""
    version = os.environ.get("SPRINGBEAM_FMI") or "2.0"
    if version not in ENDINGS:
        raise FmuError(f"SPRINGBEAM_FMI = {version!r}: must be {' or '.join(ENDINGS)}")
    return version


def own_fmu(name: str, version: str | None = None) -> Path:
    """Return the file of our FMU ``name`` for a version of FMI, that of `fmi_version` if none is given."""
    return fmu_directory() / f"{name}{ENDINGS[version or fmi_version()]}.fmu"


class UnsafeArchive(ValueError):
    """An archive that is not unpacked; the message names the member and the cause."""


def unpack(path: Path, folder: Path, platforms: tuple[str, ...]) -> None:
    """Unpack the files of the FMU ``path`` that a run needs into ``folder``; links and devices become plain files.

    ``platforms`` are the names of this platform's folders of binaries.

    Raises
    ------
    UnsafeArchive
        If a member's name leads out of ``folder`` on some system, or if the needed files are too large; nothing is
        unpacked then.
    ValueError
        If there are binaries, but none for this platform.
    zipfile.BadZipFile, RuntimeError
        If it is not a ZIP archive, damaged, or encrypted.
    OSError
        If it cannot be read, or ``folder`` not be written to.
    """
    with zipfile.ZipFile(path) as archive:
        for member in _used(archive, platforms):
            unpacked = Path(archive.extract(member, folder))
            # Only whether a file may be executed, as a program among the resources: nothing else of its mode.
            if not member.is_dir() and (mode := member.external_attr >> 16 & _EXECUTABLE):
                unpacked.chmod(unpacked.stat().st_mode | mode)


def _used(archive: zipfile.ZipFile, platforms: tuple[str, ...]) -> list[zipfile.ZipInfo]:
    """Return the members that a run needs. Raises as `unpack`."""
    members = archive.infolist()
    if len(members) > MOST_MEMBERS:
        raise UnsafeArchive(f"{len(members)} members, at most {MOST_MEMBERS} are allowed; pack fewer files")
    for name in (member.orig_filename for member in members):  # `filename` has been made harmless for this system
        if not _PLAIN.fullmatch(name):
            what = f"member {name[:100]!r} is no plain name inside the archive"
            raise UnsafeArchive(f"{what}; it is not unpacked, take it from its source again")
    here = tuple(f"{_BINARIES}{platform}/" for platform in platforms)
    used = [member for member in members if member.filename.startswith((*_USED, *here))]
    # What is read of a member is never more than the size it declares.
    size = sum(member.file_size for member in used)
    if size > MOST_BYTES:
        what = f"resources/ and the binaries of this platform take {size} bytes unpacked"
        raise UnsafeArchive(f"{what}, at most {MOST_BYTES} are allowed; pack smaller resources")
    others = {m.filename.split("/")[1] for m in members if m.filename.startswith(_BINARIES) and not m.is_dir()}
    if others and others.isdisjoint(platforms):
        raise ValueError(
            f"it has binaries for {', '.join(sorted(others))} and none for this platform; export it with those of "
            f"{' or '.join(platforms)}"
        )
    return used
