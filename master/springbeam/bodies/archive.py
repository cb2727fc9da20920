"""FMU files: where they are, and how archives that others made are unpacked so that nothing leaves their folder."""

from __future__ import annotations

import os
import re
import zipfile
from pathlib import Path

from .protocol import FmuError

#: Largest size of all members of an archive together, and largest number of them.
MOST_BYTES, MOST_MEMBERS = 1 << 28, 10_000
#: Parts that mean no other folder on any system, between slashes.
_PLAIN = re.compile(r"(?:(?!\.{1,2}(?:/|$))[^/\\:\x00-\x1f]+(?:/|$))+")
#: What a running FMU may use. The sources of the beam, with Eigen's, are 300 files: they would take most of the time.
_USED = ("modelDescription.xml", "binaries/", "resources/")
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
    """Unpack what a run needs of the FMU ``path`` into ``folder``; links and devices become plain files.

    Raises
    ------
    UnsafeArchive
        If a member's name leads elsewhere than into ``folder`` on some system, or if the archive is too large unpacked;
        nothing is unpacked then.
    zipfile.BadZipFile, RuntimeError
        If it is not a ZIP archive, damaged, or encrypted.
    OSError
        If it cannot be read, or ``folder`` not be written to.
    """
    with zipfile.ZipFile(path) as archive:
        members = archive.infolist()
        # What is read of a member is never more than the size it declares.
        size, remedy = sum(member.file_size for member in members), "it is not unpacked, take it from its source again"
        if size > MOST_BYTES or len(members) > MOST_MEMBERS:
            most = f"at most {MOST_MEMBERS} members and {MOST_BYTES} bytes are"
            raise UnsafeArchive(f"{len(members)} members of {size} bytes unpacked, {most} allowed; {remedy}")
        for name in (member.orig_filename for member in members):  # `filename` has been made harmless for this system
            if not _PLAIN.fullmatch(name):
                raise UnsafeArchive(f"member {name[:100]!r} is no plain name inside the archive; {remedy}")
        archive.extractall(folder, [member for member in members if member.filename.startswith(_USED)])
