"""Gather what an FMU can be compiled from: its C++ files, all headers they include, and SUNDIALS if it is at hand.

Usage: sources.py OUT [--sundials FOLDER | --without NAME] [--headers PREFIX=FOLDER]… [FILE…]

OUT/sources is filled as the FMU's sources/: files of this project where they are in its tree, other headers by the
name they are included under, so that sources/ itself is the one include folder. OUT/list has the names to compile, one
per line; with `--without` (a library that has to be compiled too but is not at hand) it is empty. OUT/list.d names what
was read, for the build tool.
"""

from __future__ import annotations

import argparse
import re
import shutil
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[1]
INCLUDE = re.compile(r'^\s*#\s*include\s*["<]([^">]+)[">]', re.MULTILINE)
# Parts of Eigen that have to be asked for: graphics processors, and other libraries in place of its own code.
OPTIONAL = re.compile(
    r"/arch/(CUDA|GPU|HIP|SYCL)/|/misc/(lapack|lapacke|lapacke_mangling|blas)\.h$|_(BLAS|LAPACKE|MKL)\.h$"
)

# Of SUNDIALS: IDA, its vectors, matrices and solvers as far as the spring or IDA itself uses them.
SUNDIALS_FOLDERS = ("ida", "sundials", "nvector/serial", "sunmatrix/dense", "sunmatrix/band", "sunlinsol/dense")
SUNDIALS_FOLDERS += ("sunnonlinsol/newton",)
# Fortran, MPI and other bindings; the profiler is only needed when asked for. What finds consistent initial values, and
# what other linear solvers take.
SUNDIALS_WITHOUT = re.compile(
    r"^f|_(futils|xbraid|profiler|mpi_errors|bbdpre)\.c$|^ida_(direct|ic|spils)\.c$|^sundials_(band|iterative)\.c$"
)


class Gathered:
    """Files by their place in sources/."""

    def __init__(self, headers: list[tuple[str, Path]]) -> None:
        self.headers = headers
        self.files: dict[str, Path] = {}

    def add(self, place: str, file: Path) -> None:
        """A file and, one after the other, all it includes that is not the compiler's own."""
        waiting = [(place, file)]
        while waiting:
            place, file = waiting.pop()
            if place in self.files or OPTIONAL.search("/" + place):
                continue
            self.files[place] = file
            for name in INCLUDE.findall(file.read_text(encoding="utf-8", errors="replace")):
                beside = file.parent / name
                if beside.is_file():
                    # Resolved by hand: the file itself may be a link into another folder.
                    waiting.append((_normal(f"{place.rpartition('/')[0]}/{name}"), beside))
                    continue
                for prefix, folder in self.headers:
                    if name.startswith(prefix) and (folder / name).is_file():
                        waiting.append((name, folder / name))
                        break


def _normal(place: str) -> str:
    parts: list[str] = []
    for part in place.split("/"):
        if part == "..":
            parts.pop()
        elif part not in ("", "."):
            parts.append(part)
    return "/".join(parts)


def gather(arguments: argparse.Namespace) -> None:
    headers = [(prefix, Path(folder)) for prefix, _, folder in (h.partition("=") for h in arguments.headers)]
    units = {file.resolve().relative_to(PROJECT).as_posix(): file for file in arguments.files}
    licences: dict[str, Path] = {}
    if arguments.sundials:
        source = arguments.sundials
        for folder in ("ida", "nvector", "sundials", "sunlinsol", "sunmatrix", "sunnonlinsol"):
            headers.append((folder + "/", source / "include"))
        headers.append(("sundials_", source / "src/sundials"))
        for folder in SUNDIALS_FOLDERS:
            for file in sorted((source / "src" / folder).glob("*.c")):
                if not SUNDIALS_WITHOUT.search(file.name):
                    units[f"sundials_src/{folder}/{file.name}"] = file
        licences = {f"sundials/{name}": source / name for name in ("LICENSE", "NOTICE")}
    gathered = Gathered(headers)
    for place, file in units.items():
        gathered.add(place, file)
    files = gathered.files | licences

    out: Path = arguments.out
    shutil.rmtree(out / "sources", ignore_errors=True)
    for place, file in files.items():
        target = out / "sources" / place
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(file.read_bytes())
    read = " ".join(str(file).replace(" ", r"\ ") for file in files.values())
    (out / "list.d").write_text(f"{out / 'list'}: {read}\n", encoding="utf-8")
    names = "" if arguments.without else "".join(f"{place}\n" for place in units)
    if arguments.without:
        print(f"{out.name}.fmu: its sources/ can be read but not compiled without {arguments.without}")
    (out / "list").write_text(names, encoding="utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("files", type=Path, nargs="*")
    parser.add_argument("--headers", action="append", default=[])
    parser.add_argument("--sundials", type=Path)
    parser.add_argument("--without")
    gather(parser.parse_intermixed_args())
