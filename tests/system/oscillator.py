"""`oscillator.c` as FMUs: a plain C FMU that is not ours, with the capabilities that a test wants it to have."""

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
        (
            *("none", "state", "velocity", "integral", "slopes", "hang", "crash", "nan", "energy", "integral_2"),
            *("early", "event", "end", "late crash", "late abort", "late exit", "late hang"),
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


@functools.cache
def _library(lacks):
    folder = Path(tempfile.mkdtemp(prefix="springbeam-oscillator-"))
    source, library = Path(__file__).with_suffix(".c"), folder / "oscillator.so"
    renamed = [] if lacks is None else [f"-D{lacks}=renamed"]
    subprocess.run(["cc", "-O1", "-shared", "-fPIC", *renamed, "-o", library, source], check=True)
    content = library.read_bytes()
    library.unlink()
    folder.rmdir()
    return content


def _description(version, **flags):
    variables, outputs = [], ""
    for number, name in enumerate([*_INPUTS, *_OUTPUTS, *_PARAMETERS]):
        said, start = f'name="{name}" valueReference="{number}" ', ""
        if name in _PARAMETERS:
            said, start = f'{said} causality="parameter" variability="fixed"', f' start="{_PARAMETERS[name]}"'
        elif name in _INPUTS:
            said, start = f'{said} causality="input"', ' start="0"'
        else:
            said += 'causality="output"'
        if version == "2.0":
            variables.append(f"<ScalarVariable {said}><Real{start}/></ScalarVariable>")
        else:
            variables.append(f"<Float64 {said}{start}/>")
        if name in _OUTPUTS:
            outputs += f'<Unknown index="{number + 1}"/>' if version == "2.0" else f"<Output {said.split()[1]}/>"
    if version == "3.0":
        variables.append('<Float64 name="time" valueReference="99" causality="independent" variability="continuous"/>')
    else:
        outputs = f"<Outputs>{outputs}</Outputs><InitialUnknowns>{outputs}</InitialUnknowns>"
    said = " ".join(f'{flag}="{str(value).lower()}"' for flag, value in flags.items())
    token = "guid" if version == "2.0" else "instantiationToken"
    return (
        f'<?xml version="1.0"?><fmiModelDescription fmiVersion="{version}" modelName="oscillator" {token}="{{1}}">'
        f'<CoSimulation modelIdentifier="oscillator" {said}/><ModelVariables>{"".join(variables)}</ModelVariables>'
        f"<ModelStructure>{outputs}</ModelStructure></fmiModelDescription>"
    )


def made(path, *, version="2.0", lacks=None, slopes=True, **flags):
    """Write the FMU ``path`` of a version of FMI, without one of its functions, and return the path.

    ``flags`` are "state" and "variable", of the size of its steps; it can do what is not said.
    """
    said = dict.fromkeys(("canGetAndSetFMUstate", "canSerializeFMUstate"), flags.get("state", True))
    said["canHandleVariableCommunicationStepSize"] = flags.get("variable", True)
    if version == "2.0":
        folder, said["canInterpolateInputs"] = "linux64", slopes
    else:
        folder, said = "x86_64-linux", {name.replace("state", "State"): value for name, value in said.items()}
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", _description(version, **said))
        archive.writestr(f"binaries/{folder}/oscillator.so", _library(lacks))
    return path
