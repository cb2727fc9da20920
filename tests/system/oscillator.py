"""`oscillator.c` as FMUs: a plain C FMU that is not ours, with the capabilities that a test wants it to have.

Its descriptions are `oscillator2.xml` and `oscillator3.xml`.
"""

import functools
import subprocess
import tempfile
import zipfile
from pathlib import Path

#: Values of the parameter ``lie``.
LIES = {
    name: float(number)
    for number, name in enumerate(
        (
            *("none", "state", "velocity", "integral", "slopes", "hang", "crash", "nan", "energy", "integral_2"),
            *("early", "event", "end", "late crash", "late abort", "late exit", "late hang"),
            *("message", "short", "past"),
            *("explicit", "semi-implicit", "grid"),
        )
    )
}
#: All that a scene may name, for `springbeam.scene.partners.ForeignFmu`.
ALL = {
    "force": "F",
    "displacement": "x",
    "velocity": "v",
    "integral": "ix",
    "integral_2": "ix2",
    "impulse": "J",
    "kinetic_energy": "Ek",
    "potential_energy": "Ep",
    "dissipated_energy": "Ed",
    "load_potential": "El",
}


def in_units(time, units, bases):
    """The edits by which variables of FMI 2.0, and its ``time``, have ``units``, by name; ``bases`` are BaseUnits."""
    known = "".join(f'<Unit name="{name}"><BaseUnit {base}/></Unit>' for name, base in bases.items())
    known += "".join(f'<Unit name="{name}"/>' for name in {time, *units.values()} - {*bases})
    clock = (
        '<ScalarVariable name="time" valueReference="99" causality="independent" variability="continuous">'
        f'<Real unit="{time}"/></ScalarVariable>'
    )
    edits = [
        ("<ModelVariables>", f"<UnitDefinitions>{known}</UnitDefinitions><ModelVariables>"),
        ("</ModelVariables>", f"{clock}</ModelVariables>"),
    ]
    for name, unit in units.items():
        before = f'<ScalarVariable name="{name}" '
        line = next(line for line in _DESCRIPTION.splitlines() if before in line)
        edits.append((line, line.replace("<Real", f'<Real unit="{unit}"')))
    return tuple(edits)


_DESCRIPTION = Path(__file__).with_name("oscillator2.xml").read_text(encoding="utf-8")


@functools.cache
def _library(lacks):
    folder = Path(tempfile.mkdtemp(prefix="springbeam-oscillator-"))
    source = Path(__file__).with_suffix(".c")
    library = folder / "oscillator.so"
    renamed = [] if lacks is None else [f"-D{lacks}=renamed"]
    subprocess.run(["cc", "-O1", "-shared", "-fPIC", *renamed, "-o", library, source, "-lm"], check=True)
    content = library.read_bytes()
    library.unlink()
    folder.rmdir()
    return content


def made(path, *, version="2.0", lacks=None, state=True, slopes=True, variable=True, edits=()):
    """Write the FMU ``path`` of a version of FMI, without one of its functions, and return the path.

    It saves its ``state``, follows ``slopes`` of the force, or makes steps of ``variable`` size unless told otherwise.
    ``edits`` of its description are texts, each of which is there once, with what takes its place. Its GUID makes
    "unlicensed" fail, and "once" after the first instance.
    """
    template = Path(__file__).with_name(f"oscillator{version[0]}.xml").read_text(encoding="utf-8")
    can = {"state": state, "slopes": slopes, "variable": variable}
    description = template.format(**{name: str(value).lower() for name, value in can.items()})
    for old, new in edits:
        assert description.count(old) == 1, old
        description = description.replace(old, new)
    folder = {"2.0": "linux64", "3.0": "x86_64-linux"}[version]
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", description)
        archive.writestr(f"binaries/{folder}/oscillator.so", _library(lacks))
    return path
