"""``springbeam doctor`` and ``springbeam verify``."""

from __future__ import annotations

import platform
import shutil
import sys
import textwrap
from collections.abc import Callable, Iterable
from contextlib import closing
from dataclasses import asdict
from importlib import metadata
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..bodies.archive import own_fmu
from ..bodies.protocol import FmuError
from ..scene import Beam, Scene, Spring, load_scene
from ..scene.partners import kind_of
from ..studies.tables import Findings, table
from .common import BAD_INPUT, DISAGREES, JsonOption, SettingsOption, console_for

_PACKAGES = (
    *("fmpy", "numpy", "scipy", "pydantic", "typer", "rich", "matplotlib", "plotly", "pebble", "pyarrow"),
    "distributed",  # for clusters
)


def doctor(
    scene: Annotated[
        str | None, typer.Argument(metavar="[SCENE]", help="Examine the FMUs that this scene names instead.")
    ] = None,
    settings: SettingsOption = None,
    as_json: JsonOption = False,
) -> Findings:
    """Show versions, and whether the FMUs are found and can be loaded here. Exit code 1 if they cannot.

    With a scene, examine the FMUs of others that it names, and show what they can do and what that allows. Exit code 2
    if one is not what the scene or itself says, or cannot do what the scene asks for.

    Example: springbeam doctor my-scene.toml
    """
    from ..bodies.fmu_bodies import FmuBeam, FmuSpring

    if scene is not None:
        return _examine(load_scene(scene, settings or ()))
    installed = {package.name.lower(): package.version for package in metadata.distributions()}
    versions = {name: installed.get(name) for name in _PACKAGES}
    fmus = {
        "beam": _loaded("beam", lambda: FmuBeam(Beam.with_ones(), 0.0, 0.0)),
        "spring": _loaded("spring", lambda: FmuSpring(Spring.with_ones(), 0.0)),
    }
    document = {
        "version": metadata.version("springbeam"),
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
        *((fmu["file"], f"{fmu['state']}\n{'':<12}{fmu['error'] or fmu['path']}") for fmu in fmus.values()),
    ]
    failed = any(fmu["error"] is not None for fmu in fmus.values())
    return Findings(document, (), [(f"{name:<12}", text) for name, text in lines], code=DISAGREES if failed else 0)


def _loaded(name: str, make: Callable[[], OwnBody]) -> dict[str, Any]:
    """Return how our FMU of ``name`` is found and loaded."""
    found: dict[str, Any] = {"path": None, "file": f"{name}.fmu", "fmi": None, "state": "FAILED", "error": None}
    try:
        found["path"] = path = own_fmu(name)
        found["file"] = path.name
        with closing(make()) as body:
            found["fmi"] = body.fmu.version
        found["state"] = f"FMI {found['fmi']}, loads"
    except FmuError as failure:
        found["error"] = str(failure)
    return found


def _examine(scene: Scene) -> Findings:
    """Return what the bodies of ``scene`` can do; it is an error if the scene cannot be run with them."""
    from ..bodies.factory import findings
    from ..bodies.gate import OFFERED, refusals
    from ..bodies.units import described

    found, shown = findings(scene), list[Any]()
    for name, body in {"beam": scene.upper, "spring": scene.lower}.items():
        if name not in found:
            if body is not None:
                shown.append(f"[{name}] {kind_of(body).replace('_', ' ')}: everything is offered")
            continue
        finding, given = found[name], scene.foreign[name]
        mass = "(measured)" if given.mass is None else f"measured, {given.mass:.9g} kg given"
        shown.append(Text(f"[{name}] {given.fmu}", style="bold"))
        shown.append(f"mass that a force or an impulse meets: {finding.mass:.9g} kg {mass}")
        shown += described(given.named, finding.units)
        names, told = ("", "capability", "shown by", "what is offered"), asdict(finding.abilities)
        rows = [
            ("yes", key, shown_by, having) if told[key] > 0 else ("no", key, shown_by, lacking)
            for key, shown_by, having, lacking in OFFERED
        ]
        shown.append(table(names, rows))
    refused = refusals(scene, {table: finding.abilities for table, finding in found.items()})
    document = {"bodies": {name: asdict(finding) for name, finding in found.items()}, "refused": refused}
    if faults := [*(fault for finding in found.values() for fault in finding.faults), *refused]:
        return Findings(document, shown, code=BAD_INPUT, error="\n".join(faults))
    return Findings(document, [*shown, "The checks found nothing wrong, and the scene can be run."])


if TYPE_CHECKING:
    from ..bodies.fmu_bodies import OwnBody
    from ..studies.verify.alone import Check, Section


_COLUMNS = ("quantity", "exact:.6g", "computed:.6g", "error:.1e", "bound:.1e", "")


def verify(as_json: JsonOption = False) -> Findings:
    """Check the FMUs against exact solutions. Exit code 1 if a check fails.

    Example: springbeam verify
    """
    from ..studies.verify import SECTIONS

    found = report(SECTIONS, console_for(silent=as_json))
    passed = all(check.passed for checks in found.values() for check in checks)
    described = [
        {"title": title, "checks": [{**asdict(c), "error": c.error, "passed": c.passed} for c in checks]}
        for title, checks in found.items()
    ]
    return Findings({"passed": passed, "sections": described}, code=0 if passed else DISAGREES)


def report(sections: Iterable[Section], console: Console) -> dict[str, list[Check]]:
    """Print each section's table as it comes and a last line that counts; return the checks by title."""
    began = perf_counter()
    found: dict[str, list[Check]] = {}
    for section in sections:
        checks = found[section.title] = list(section())
        reasons = dict.fromkeys(check.reason for check in checks)
        marks = dict(zip(reasons, "abcdefghijklmnopqrstuvwxyz", strict=False))
        rows = [
            (c.quantity, c.exact, c.computed, c.error, c.bound, f"{'pass' if c.passed else 'FAIL'} {marks[c.reason]}")
            for c in checks
        ]
        console.print(table(_COLUMNS, rows, section.title))
        notes = Table.grid(padding=(0, 1))
        for reason, mark in marks.items():
            notes.add_row(Text(mark), Text(reason))
        console.print(notes, "")
    verdicts = [check.passed for checks in found.values() for check in checks]
    counts = f"{verdicts.count(True)} passed, {verdicts.count(False)} failed"
    console.print(f"{counts}; {perf_counter() - began:.0f} s")
    return found
