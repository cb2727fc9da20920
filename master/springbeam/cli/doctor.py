"""``springbeam doctor``."""

from __future__ import annotations

import platform
import shutil
import sys
import textwrap
import zipfile
from dataclasses import asdict
from importlib import metadata
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.text import Text

from ..bodies.archive import fmu_directory
from ..bodies.protocol import FmuError
from ..scene import Beam, Scene, Spring, load_scene
from ..scene.partners import kind_of
from ..studies.tables import table
from .common import BAD_INPUT, DISAGREES, JsonOption, SettingsOption, bad_input_reported, console_for, fail, print_json

_REQUIRED = ("fmpy", "numpy", "scipy", "pydantic", "typer", "rich", "matplotlib", "plotly", "pebble", "pyarrow")
_FOR_CLUSTERS = ("distributed",)


def doctor(
    scene: Annotated[
        str | None, typer.Argument(metavar="[SCENE]", help="Examine the FMUs that this scene names instead.")
    ] = None,
    settings: SettingsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show versions, and whether the FMUs are found and can be loaded here. Exit code 1 if they cannot.

    With a scene, examine the FMUs of others that it names, and show what they can do and what that allows. Exit code 2
    if one is not what the scene or itself says, or cannot do what the scene asks for.

    Example: springbeam doctor my-scene.toml
    """
    if scene is not None:
        with bad_input_reported():
            _examine(load_scene(scene, settings or ()), as_json)
        return
    found = _found()
    if as_json:
        print_json(found)
    console = console_for(silent=as_json)

    def line(name: str, text: str) -> None:
        console.print(Text(f"{name:<12}{text}"), soft_wrap=True)

    line("springbeam", f"{found['version']} in {found['path']}")
    line("Python", f"{found['python']['version']} ({found['python']['executable']})")
    line("system", f"{found['system']}, {found['machine']}")
    for name, remedy in (
        ("packages", "pip install --upgrade springbeam"),
        ("cluster", "pip install distributed"),
    ):
        versions = found[name]
        absent = [package for package, number in versions.items() if number is None]
        there = [f"{package} {number}" for package, number in versions.items()]
        lines = [f"not available: {', '.join(absent)} missing; {remedy}"] if absent else _wrapped(there)
        for k, text in enumerate(lines):
            line("" if k else name, text)
    line("ffmpeg", found["ffmpeg"] or "not found: springbeam animate then writes GIFs only, no MP4")
    for name, fmu in found["fmus"].items():
        state = f"loads; binaries for {', '.join(fmu['platforms'])}" if fmu["error"] is None else "FAILED"
        line(f"{name}.fmu", f"{state}\n{'':<12}{fmu['error'] or fmu['path']}")
    if any(fmu["error"] is not None for fmu in found["fmus"].values()):
        raise typer.Exit(DISAGREES)


def _examine(scene: Scene, as_json: bool) -> None:
    """Print what the bodies of ``scene`` can do; end the command if the scene cannot be run with them."""
    from ..bodies.abilities import OFFERED, refusals
    from ..bodies.factory import findings

    found = findings(scene)
    bodies = {"beam": scene.upper, "spring": scene.lower}
    console = console_for(silent=as_json)
    for name, body in bodies.items():
        if body is None:
            continue
        finding = found.get(name)
        if finding is None:
            console.print(Text(f"[{name}] {kind_of(body).replace('_', ' ')}: everything is offered"))
            continue
        path, told = scene.foreign[name].fmu, asdict(finding.abilities)
        mass = scene.foreign[name].mass
        console.print(Text(f"[{name}] {path}", style="bold"), soft_wrap=True)
        given = f"{finding.mass:.9g} kg" + (" (measured)" if mass is None else f" measured, {mass:.9g} kg given")
        console.print(Text(f"mass that a force or an impulse meets: {given}"))
        names = ("", "capability", "shown by", "what is offered")
        rows = [
            ("yes", key, shown_by, having) if told[key] > 0 else ("no", key, shown_by, lacking)
            for key, shown_by, having, lacking in OFFERED
        ]
        console.print(table(names, rows, words=names))
    faults = [fault for finding in found.values() for fault in finding.faults]
    refused = refusals(scene, {table: finding.abilities for table, finding in found.items()})
    if as_json:
        print_json({"bodies": {name: asdict(finding) for name, finding in found.items()}, "refused": refused})
    if faults or refused:
        fail(BAD_INPUT, "\n".join([*faults, *refused]))
    console.print("The checks found nothing wrong, and the scene can be run.")


def _found() -> dict[str, Any]:
    """Return everything that `doctor` prints."""
    from ..bodies.fmu_bodies import FmuBeam, FmuSpring

    fmus = {}
    for name in ("beam", "spring"):
        path = fmu_directory() / f"{name}.fmu"
        platforms: list[str] = []
        error = None
        try:
            (FmuBeam(Beam.with_ones(), 0.0, 0.0) if name == "beam" else FmuSpring(Spring.with_ones(), 0.0)).close()
            platforms = _platforms(path)
        except FmuError as failure:
            error = str(failure)
        fmus[name] = {"path": path, "platforms": platforms, "error": error}
    return {
        "version": metadata.version("springbeam"),
        "path": Path(__file__).parents[1],
        "python": {"version": platform.python_version(), "executable": sys.executable},
        "system": platform.platform(),
        "machine": platform.machine(),
        "packages": {name: _version(name) for name in _REQUIRED},
        "cluster": {name: _version(name) for name in _FOR_CLUSTERS},
        "ffmpeg": shutil.which("ffmpeg"),
        "fmus": fmus,
    }


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _wrapped(words: list[str]) -> list[str]:
    return textwrap.wrap(", ".join(words), width=66, break_on_hyphens=False)


def _platforms(path: Path) -> list[str]:
    with zipfile.ZipFile(path) as archive:
        return sorted({name.split("/")[1] for name in archive.namelist() if name.startswith("binaries/")})
