"""``springbeam doctor``."""

from __future__ import annotations

import platform
import shutil
import sys
import textwrap
from dataclasses import asdict
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.text import Text

from ..studies.tables import Findings, table
from ..version import __version__
from .common import BAD_INPUT, DISAGREES, JsonOption, SettingsOption

if TYPE_CHECKING:
    from ..scene import Scene

_PACKAGES = (
    *("fmpy", "numpy", "scipy", "pydantic", "typer", "rich", "matplotlib", "pebble", "pyarrow"),
    "distributed",  # for clusters
)

#: Abilities in words: (ability, how a body shows it, possible couplings with it, and without it).
_OFFERED = (
    ("state", "canGetAndSetFMUstate", 'scheme "energy", rigid laws, foundation', '"jacobi", "gauss_seidel"'),
    ("any_size", "canHandleVariableCommunicationStepSize", "events, adaptive steps", "equal macro steps only"),
    ("slopes", "canInterpolateInputs", "degree 1, 2", "degree 0"),
    ("integrals", "integral, integral_2", "degree 1, 2; adaptive steps", "degree 0"),
    ("velocity", "velocity", "events, adaptive steps, the force at an instant", "the mean over a step in its place"),
    ("impulse", "impulse", "rigid impacts, foundation", '"compliance", "link", "tie" of equal velocities'),
    ("energies", "kinetic_energy, potential_energy", "the whole ledger", "the ledger of the interface"),
)


def doctor(
    scene: Annotated[
        str | None, typer.Argument(metavar="SCENE", help="Check the FMUs that this scene names instead.")
    ] = None,
    settings: SettingsOption = None,
    as_json: JsonOption = False,
) -> Findings:
    """Check the installation: versions, and both FMUs against exact solutions. Exit code 1 if a check fails.

    With a scene, check the FMUs of others that it names, and show their abilities. Exit code 2 if one contradicts its
    declarations or the scene, or cannot be run in it.

    Example: springbeam doctor my-scene.toml
    """
    if scene is not None:
        from ..scene import load_scene

        return _examine(load_scene(scene, settings or ()))
    from ..bodies.archive import ENDINGS, fmi_version, fmu_directory

    installed = {package.name.lower(): package.version for package in metadata.distributions()}
    versions = {name: installed.get(name) for name in _PACKAGES}
    fmus = [_asked(name, version) for version in ENDINGS for name in ("beam", "spring")]
    document = {
        "version": __version__,
        "path": Path(__file__).parents[1],
        "python": {"version": platform.python_version(), "executable": sys.executable},
        "system": f"{platform.platform()}, {platform.machine()}",
        "packages": versions,
        "ffmpeg": shutil.which("ffmpeg"),
        "fmus": fmus,
    }
    there = ", ".join(f"{package} {number}" for package, number in versions.items() if number is not None)
    lines = [
        ("springbeam", f"{document['version']} in {document['path']}"),
        ("Python", f"{platform.python_version()} ({sys.executable})"),
        ("system", document["system"]),
        ("packages", textwrap.fill(there, 66, break_on_hyphens=False, subsequent_indent=" " * 12)),
        *(("missing", f"{name}: pip install --upgrade {name}") for name, number in versions.items() if number is None),
        ("ffmpeg", document["ffmpeg"] or "not found: springbeam animate then writes GIFs only, no MP4"),
        ("FMUs", f"of {fmu_directory()}; a run takes those for FMI {fmi_version()}"),
        *((fmu["path"].name, f"{'FAILED: ' * (not fmu['passed'])}{fmu['state']}") for fmu in fmus),
    ]
    failed = not all(fmu["passed"] for fmu in fmus)
    return Findings(document, (), [(f"{name:<12}", text) for name, text in lines], code=DISAGREES if failed else 0)


def _asked(name: str, version: str) -> dict[str, Any]:
    """Return the error of our FMU against an exact solution, or why it has none."""
    from ..bodies.archive import own_fmu
    from ..bodies.protocol import FmuError, StepRefused
    from ..studies.known_answers import QUESTIONS

    question = QUESTIONS[name]
    path = own_fmu(name, version)
    answer = {"path": path, "fmi": version, "answer": question.words, "exact": question.exact, "bound": question.bound}
    try:
        error = question.ask(name, version)
    except (FmuError, StepRefused) as failure:
        return {**answer, "error": None, "passed": False, "state": str(failure)}
    state = f"error {abs(error):.1e} of {question.exact:.6g} m (at most {question.bound:.1e}): {question.words}"
    return {**answer, "error": error, "passed": abs(error) <= question.bound, "state": state}


def _examine(scene: Scene) -> Findings:
    """Return the abilities of the bodies of ``scene``; it is an error if the scene cannot be run with them."""
    from ..bodies.factory import findings
    from ..bodies.units import described
    from ..run.setup import set_up
    from ..run.validation import refusals
    from ..scene.partners import kind_of

    found = findings(scene)
    shown = list[Any]()
    for name, body in {"beam": scene.upper, "spring": scene.lower}.items():
        if name not in found:
            if body is not None:
                shown.append(f"[{name}] {kind_of(body).replace('_', ' ')}: all couplings are possible")
            continue
        finding = found[name]
        given = scene.foreign[name]
        mass = "(measured)" if given.mass is None else f"measured, {given.mass:.9g} kg given"
        shown.append(Text(f"[{name}] {given.fmu}", style="bold"))
        shown.append(f"mass that an impulse moves: {finding.mass:.9g} kg {mass}")
        shown += described(given.named, finding.units)
        names = ("", "capability", "shown by", "what is offered")
        has = asdict(finding.abilities)
        rows = [
            ("yes", key, shown_by, having) if has[key] > 0 else ("no", key, shown_by, lacking)
            for key, shown_by, having, lacking in _OFFERED
        ]
        shown.append(table(names, rows))
        shown += [f"warning: {text}" for text in finding.warnings]
    able = {table: finding.abilities for table, finding in found.items()}
    refused = refusals(set_up(scene, *able.values()), able)
    document = {"bodies": {name: asdict(finding) for name, finding in found.items()}, "refused": refused}
    if faults := [*(fault for finding in found.values() for fault in finding.faults), *refused]:
        return Findings(document, shown, code=BAD_INPUT, error="\n".join(faults))
    warned = any(finding.warnings for finding in found.values())
    passed = (
        "The scene can be run, with these warnings."
        if warned
        else "The checks found nothing wrong, and the scene can be run."
    )
    return Findings(document, [*shown, passed])
