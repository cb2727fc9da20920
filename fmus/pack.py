"""Pack files into a zip whose bytes depend on their contents alone: fixed order, dates and modes.

Usage: pack.py OUT name=file… — `name` is the place inside, `file` a file or a folder; `name?=file` may be missing.
"""

from __future__ import annotations

import os
import sys
import zipfile
from pathlib import Path

DATE = (1980, 1, 1, 0, 0, 0)  # the earliest that zip can hold


def members(arguments: list[str]) -> dict[str, Path]:
    """The files to pack by their names inside; folders are followed."""
    found: dict[str, Path] = {}
    for argument in arguments:
        name, _, source = argument.partition("=")
        path = Path(source)
        if name.endswith("?"):
            if not path.exists():
                continue
            name = name[:-1]
        if path.is_dir():
            for file in sorted(p for p in path.rglob("*") if p.is_file()):
                found[f"{name}/{file.relative_to(path).as_posix()}"] = file
        else:
            found[name] = path
    return found


def pack(out: Path, files: dict[str, Path]) -> None:
    # Replaced in one move: a running test must not see half a file.
    temporary = out.with_suffix(out.suffix + ".part")
    with zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
        # modelDescription.xml first: readers of a stream find it at once.
        for name in sorted(files, key=lambda n: (n != "modelDescription.xml", n)):
            entry = zipfile.ZipInfo(name, DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, files[name].read_bytes())
    os.replace(temporary, out)


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    pack(Path(sys.argv[1]), members(sys.argv[2:]))
