"""``springbeam doctor`` and ``springbeam verify``."""

from __future__ import annotations

import platform
import shutil
import sys
import textwrap
import zipfile
from collections.abc import Iterable
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
from ..studies.tables import number, table
from .common import (
    BAD_INPUT,
    DISAGREES,
    JsonOption,
    SettingsOption,
    bad_input_reported,
    console_for,
    fail,
    print_json,
    say,
)

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
    versions, python, fmus = found["packages"] | found["cluster"], found["python"], found["fmus"]
    absent = [package for package, number in versions.items() if number is None]
    there = ", ".join(f"{package} {number}" for package, number in versions.items() if number is not None)
    lines = [
        ("springbeam", f"{found['version']} in {found['path']}"),
        ("Python", f"{python['version']} ({python['executable']})"),
        ("system", f"{found['system']}, {found['machine']}"),
        ("packages", textwrap.fill(there, 66, break_on_hyphens=False, subsequent_indent=" " * 12)),
        *(("missing", f"{package}: pip install --upgrade {package}") for package in absent),
        ("ffmpeg", found["ffmpeg"] or "not found: springbeam animate then writes GIFs only, no MP4"),
    ]
    for name, fmu in fmus.items():
        state = (
            f"FMI {fmu['fmi']}, loads; binaries for {', '.join(fmu['platforms'])}" if fmu["error"] is None else "FAILED"
        )
        file = fmu["path"].name if fmu["path"] else f"{name}.fmu"
        lines.append((file, f"{state}\n{'':<12}{fmu['error'] or fmu['path']}"))
    say(found, [], [(f"{name:<12}", text) for name, text in lines], as_json=as_json)
    if any(fmu["error"] is not None for fmu in fmus.values()):
        raise typer.Exit(DISAGREES)


def _examine(scene: Scene, as_json: bool) -> None:
    """Print what the bodies of ``scene`` can do; end the command if the scene cannot be run with them."""
    from ..bodies.abilities import OFFERED, refusals
    from ..bodies.factory import findings

    found, shown = findings(scene), list[Any]()
    for name, body in {"beam": scene.upper, "spring": scene.lower}.items():
        if name not in found:
            if body is not None:
                shown.append(Text(f"[{name}] {kind_of(body).replace('_', ' ')}: everything is offered"))
            continue
        finding, given = found[name], scene.foreign[name]
        mass = "(measured)" if given.mass is None else f"measured, {given.mass:.9g} kg given"
        shown.append(Text(f"[{name}] {given.fmu}", style="bold"))
        shown.append(Text(f"mass that a force or an impulse meets: {finding.mass:.9g} kg {mass}"))
        names, told = ("", "capability", "shown by", "what is offered"), asdict(finding.abilities)
        rows = [
            ("yes", key, shown_by, having) if told[key] > 0 else ("no", key, shown_by, lacking)
            for key, shown_by, having, lacking in OFFERED
        ]
        shown.append(table(names, rows, words=names))
    faults = [fault for finding in found.values() for fault in finding.faults]
    refused = refusals(scene, {table: finding.abilities for table, finding in found.items()})
    bodies = {name: asdict(finding) for name, finding in found.items()}
    say({"bodies": bodies, "refused": refused}, shown, as_json=as_json)
    if faults or refused:
        fail(BAD_INPUT, "\n".join([*faults, *refused]))
    if not as_json:
        typer.echo("The checks found nothing wrong, and the scene can be run.")


def _found() -> dict[str, Any]:
    """Return everything that `doctor` prints."""
    from ..bodies.fmu_bodies import FmuBeam, FmuSpring

    fmus = {}
    for name, body in (("beam", lambda: FmuBeam(Beam.with_ones(), 0.0, 0.0)),
                       ("spring", lambda: FmuSpring(Spring.with_ones(), 0.0))):  # fmt: skip
        found: dict[str, Any] = {"path": None, "fmi": None, "platforms": [], "error": None}
        try:
            found["path"] = own_fmu(name)
            made = body()
            found["fmi"] = made.fmu.version
            made.close()
            with zipfile.ZipFile(found["path"]) as archive:
                binaries = {file.split("/")[1] for file in archive.namelist() if file.startswith("binaries/")}
            found["platforms"] = sorted(binaries)
        except FmuError as failure:
            found["error"] = str(failure)
        fmus[name] = found
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


if TYPE_CHECKING:
    from ..studies.verify.check import Check, Section


_COLUMNS = ("quantity", "exact", "computed", "error", "bound", "")


def verify(as_json: JsonOption = False) -> None:
    """Check the FMUs against exact solutions. Exit code 1 if a check fails.

    Example: springbeam verify
    """
    from ..studies.verify import SECTIONS

    with bad_input_reported():
        found = report(SECTIONS, console_for(silent=as_json))
    passed = all(check.passed for checks in found.values() for check in checks)
    if as_json:
        described = [
            {"title": title, "checks": [{**asdict(c), "error": c.error, "passed": c.passed} for c in checks]}
            for title, checks in found.items()
        ]
        print_json({"passed": passed, "sections": described})
    if not passed:
        raise typer.Exit(DISAGREES)


def report(sections: Iterable[Section], console: Console) -> dict[str, list[Check]]:
    """Print each section's table as it comes and a last line that counts; return the checks by title."""
    began = perf_counter()
    found: dict[str, list[Check]] = {}
    for section in sections:
        checks = found[section.title] = list(section())
        reasons = dict.fromkeys(check.reason for check in checks)
        marks = dict(zip(reasons, "abcdefghijklmnopqrstuvwxyz", strict=False))
        console.print(table(_COLUMNS, [_row(check, marks) for check in checks], section.title))
        notes = Table.grid(padding=(0, 1))
        for reason, mark in marks.items():
            notes.add_row(Text(mark), Text(reason))
        console.print(notes, "")
    verdicts = [check.passed for checks in found.values() for check in checks]
    counts = f"{verdicts.count(True)} passed, {verdicts.count(False)} failed"
    console.print(f"{counts}; {perf_counter() - began:.0f} s")
    return found


def _row(check: Check, marks: dict[str, str]) -> tuple[str, ...]:
    """Return a check in words, with the mark of its reason."""
    numbers = ((check.exact, ".6g"), (check.computed, ".6g"), (check.error, ".1e"), (check.bound, ".1e"))
    verdict = f"{'pass' if check.passed else 'FAIL'} {marks[check.reason]}"
    return check.quantity, *(number(value, form, "–") for value, form in numbers), verdict
