"""`oscillator.c` as FMUs: a plain C FMU that is not ours, with the capabilities that a test wants it to have."""

from __future__ import annotations

import functools
import subprocess
import tempfile
import zipfile
from pathlib import Path

#: Names in the order of value references, with their causality.
_INPUTS, _OUTPUTS = ("F", "J"), ("x", "v", "ix", "ix2", "Ek", "Ep", "Ed", "El")
_PARAMETERS = {"m": 1.0, "k": 0.0, "c": 0.0, "load": 0.0, "x0": 0.0, "v0": 0.0, "sign": 1.0, "lie": 0.0}
#: Values of the parameter ``lie``.
LIES = {
    name: float(number)
    for number, name in enumerate(
        ("none", "state", "velocity", "integral", "slopes", "hang", "crash", "nan", "energy", "integral_2")
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


@functools.cache
def _library() -> bytes:
    folder = Path(tempfile.mkdtemp(prefix="springbeam-oscillator-"))
    source, library = Path(__file__).with_suffix(".c"), folder / "oscillator.so"
    subprocess.run(["cc", "-O1", "-shared", "-fPIC", "-o", library, source], check=True)
    content = library.read_bytes()
    library.unlink()
    folder.rmdir()
    return content


def _description(**flags: bool) -> str:
    names = [*_INPUTS, *_OUTPUTS, *_PARAMETERS]
    variables = []
    for number, name in enumerate(names):
        if name in _PARAMETERS:
            kind, start = 'causality="parameter" variability="fixed"', f' start="{_PARAMETERS[name]}"'
        elif name in _INPUTS:
            kind, start = 'causality="input"', ' start="0"'
        else:
            kind, start = 'causality="output"', ""
        variables.append(
            f'<ScalarVariable name="{name}" valueReference="{number}" {kind}><Real{start}/></ScalarVariable>'
        )
    outputs = "".join(f'<Unknown index="{len(_INPUTS) + i + 1}"/>' for i in range(len(_OUTPUTS)))
    said = " ".join(f'{flag}="{str(value).lower()}"' for flag, value in flags.items())
    return (
        '<?xml version="1.0"?><fmiModelDescription fmiVersion="2.0" modelName="oscillator" guid="{1}">'
        f'<CoSimulation modelIdentifier="oscillator" {said}/><ModelVariables>{"".join(variables)}</ModelVariables>'
        f"<ModelStructure><Outputs>{outputs}</Outputs><InitialUnknowns>{outputs}</InitialUnknowns></ModelStructure></fmiModelDescription>"
    )


def made(path: Path, *, state: bool = True, slopes: bool = True, variable: bool = True) -> Path:
    """Write the FMU ``path`` with these capabilities and return the path."""
    flags = {
        "canGetAndSetFMUstate": state,
        "canSerializeFMUstate": state,
        "canInterpolateInputs": slopes,
        "canHandleVariableCommunicationStepSize": variable,
    }
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", _description(**flags))
        archive.writestr("binaries/linux64/oscillator.so", _library())
    return path
