"""FMU files: where they are, and how archives that others made are unpacked so that nothing leaves their folder."""

from __future__ import annotations

import os
import stat
import zipfile
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

from .protocol import FmuError

#: Largest size of all members of an archive together, and largest number of them.
MOST_BYTES, MOST_MEMBERS = 1 << 28, 10_000
_ENCRYPTED = 0x1
#: What the names of our FMUs end with, by version of FMI.
_ENDINGS = {"2.0": "", "3.0": "3"}
_PACKAGE = Path(__file__).resolve().parents[1]


def fmu_directory() -> Path:
    """Return where our FMUs are: $SPRINGBEAM_FMUS, the installed package, or the checkout."""
    chosen = os.environ.get("SPRINGBEAM_FMUS")
    if chosen:
        return Path(chosen)
    installed = _PACKAGE / "fmus"
    return installed if installed.is_dir() else _PACKAGE.parents[1] / "fmus"


def own_fmu(name: str) -> Path:
    """Return the file of our FMU ``name`` for the version of FMI that $SPRINGBEAM_FMI names, 2.0 (default) or 3.0.

    Raises FmuError for another version.
    """
    version = os.environ.get("SPRINGBEAM_FMI") or "2.0"
    if version not in _ENDINGS:
        raise FmuError(f"SPRINGBEAM_FMI = {version!r}: must be {' or '.join(_ENDINGS)}")
    return fmu_directory() / f"{name}{_ENDINGS[version]}.fmu"


class UnsafeArchive(ValueError):
    """An archive that is not unpacked; the message names the member and the cause."""


def unpack(path: Path, folder: Path) -> None:
    """Unpack the ZIP archive ``path`` into ``folder``, all of it or nothing.

    Raises
    ------
    UnsafeArchive
        If a member's name leads elsewhere than into ``folder`` on some system or is there twice, if one is neither a
        file nor a folder, is encrypted, or if it is too large unpacked.
    zipfile.BadZipFile
        If it is not a ZIP archive, or damaged.
    OSError
        If it cannot be read, or ``folder`` not be written to.
    """
    with zipfile.ZipFile(path) as archive:
        members = archive.infolist()
        for fault in _faults(members):
            raise UnsafeArchive(f"{fault}; it is not unpacked, take it from its source again")
        archive.extractall(folder)


def _faults(members: list[zipfile.ZipInfo]) -> Iterator[str]:
    if len(members) > MOST_MEMBERS:
        yield f"{len(members)} members, more than {MOST_MEMBERS}"
    # What is read of a member is never more than the size it declares.
    if (total := sum(member.file_size for member in members)) > MOST_BYTES:
        largest = max(members, key=lambda member: member.file_size)
        yield f"{total} bytes unpacked, more than {MOST_BYTES}, of them {largest.file_size} of {_shown(largest)}"
    files: dict[str, str] = {}
    for member in members:
        # As it is in the archive; `filename` has been made harmless for this system.
        name = member.orig_filename
        yield from (f"member {_shown(member)} {fault}" for fault in _name_faults(name))
        kind = stat.S_IFMT(member.external_attr >> 16)
        if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
            yield f"member {_shown(member)} is a {'symbolic link' if kind == stat.S_IFLNK else 'special file'}"
        if member.flag_bits & _ENCRYPTED:
            yield f"member {_shown(member)} is encrypted"
        same = name.rstrip("/").casefold()  # some file systems tell no case
        if same in files:
            yield f"member {_shown(member)} is there twice"
        files[same] = "folder" if name.endswith("/") else "file"
    for same in files:
        for above in PurePosixPath(same).parents:
            if files.get(str(above)) == "file":
                yield f"member {str(above)!r} is both a file and a folder"


def _name_faults(name: str) -> Iterator[str]:
    if name.startswith("/"):
        yield "has an absolute name"
    if "\\" in name:
        yield "has a backslash in its name"
    if ":" in name:
        yield "has a drive letter or a colon in its name"
    if not name.isprintable() or not name:
        yield "has a name that cannot be printed"
    parts = name.rstrip("/").split("/")
    if ".." in parts:
        yield "leads out of the folder"
    elif not name.startswith("/") and ("" in parts or "." in parts):
        yield "has an empty part in its name"


def _shown(member: zipfile.ZipInfo) -> str:
    text = repr(member.orig_filename)
    return text if len(text) <= 100 else text[:99] + "…"
