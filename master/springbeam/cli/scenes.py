"""``springbeam scenes``, ``keys``, ``new`` and ``predict``: scenes before they are run."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import groupby
from math import inf
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.text import Text

from ..scene.files import beginning, shipped_scenes, tables_of
from ..studies.tables import Findings, table
from .common import BAD_INPUT, JsonOption, SceneArgument, SettingsOption, fail, in_time, progress


def _complete_table(incomplete: str) -> list[str]:
    from .keys import MODELS

    return [name for name in MODELS if name and name.startswith(incomplete)]


def scenes(as_json: JsonOption = False) -> Findings:
    """List the scenes that come with the package.

    Example: springbeam scenes
    """
    listed: list[dict[str, Any]] = []
    for name, path in shipped_scenes().items():
        scene = tables_of(path)
        contents = [part for part in ("beam", "spring", "stop") if part in scene]
        listed.append({
            "name": name, "contains": contents, "t_end": scene["time"]["t_end"], "title": scene["title"], "file": path
        })  # fmt: skip
    rows = [(row["name"], row["contains"], row["t_end"], row["title"]) for row in listed]
    shown = table(("scene", "contains", "t_end [s]:g", "title"), rows)
    return Findings(listed, [shown, ""], [("files:", path.parent)])


def keys(
    what: Annotated[
        str | None,
        typer.Argument(
            metavar="TABLE[.KEY]", help="Only the keys of this table, or this key.", autocompletion=_complete_table
        ),
    ] = None,
    schema: Annotated[
        bool, typer.Option("--schema", help="Print the JSON Schema of scene files, for editors.")
    ] = False,
    metrics: Annotated[bool, typer.Option("--metrics", help="List metrics of sweep and converge instead.")] = False,
    as_json: JsonOption = False,
) -> Findings:
    """List every key of a scene with unit, allowed values, default and meaning.

    Example: springbeam keys beam
    """
    from . import keys as described

    if schema:
        from ..results.document import as_json as json_of
        from ..scene.messages import schema as schema_of_scenes

        document = schema_of_scenes()
        return Findings(document, files=[("", json_of(document).decode())])
    if metrics:
        from ..studies.metrics import METRICS, heading

        listed = [{"name": name, "unit": m.unit, "meaning": m.words} for name, m in METRICS.items()]
        return Findings(listed, files=[("", f"{heading(name)}: {m.words}") for name, m in METRICS.items()])
    known = described.listed()
    if what is not None:
        wanted = re.sub(r"\.\d+", "", what)  # loads.0.frequency is a key of loads
        known = [key for key in known if wanted in (key.table, f"{key.table}.{key.name}".lstrip("."))]
        if not known:
            fail(BAD_INPUT, f"{what}: no table and no key; springbeam keys lists all")
    shown: list[Any] = []
    for name, group in groupby(known, lambda key: key.table):
        title = f"\n{described.heading(name)}  {described.about(name)}" if name else described.heading(name)
        shown.append(Text(title, style="bold"))
        for key in group:
            unit = "" if key.unit == "–" else f" [{key.unit}]"
            left_out = key.default if key.default.startswith("needed") else f"default: {key.default}"
            of = f" (with {key.of})" if key.of else ""
            shown += [f"{key.name}{unit}: {key.meaning}{of}", Text(f"    {key.allowed}; {left_out}", style="dim")]
    return Findings([key._asdict() for key in known], shown)


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="The file is NAME.toml; it must not exist.")],
) -> Findings:
    """Write a commented scene to start from: an aluminium beam above a rubber bumper above a stop.

    Example: springbeam new my_scene
    """
    path = Path(name).with_suffix(".toml")
    if path.exists():
        fail(BAD_INPUT, f"{path}: already there; give another NAME")
    path.write_text(beginning(path.stem), encoding="utf-8")
    return Findings(files=[("", f"{path}: a scene to change; springbeam predict checks its values")])


#: Relative stiffness above which a mesh locks.
_LOCKS = 1.05


def predict(
    scene: SceneArgument,
    settings: SettingsOption = None,
    as_json: JsonOption = False,
) -> Findings:
    """Check a scene without a run: mass, frequencies, first contact, probable mistakes, stability, cost.

    Example: springbeam predict soft --set coupling.macro_step=4e-3
    """
    from ..scene import load_scene
    from ..studies.predict import cost_of
    from ..studies.predict import predict as prediction_of

    what = load_scene(scene, settings or ())
    with progress("modes and stability", None, silent=as_json):
        p = prediction_of(what)
        p["cost"] = cost_of(what)
    shown: list[Any] = [Text(what.title or "(untitled scene)", style="bold")]
    shown += [f"{name:<10}{text}" for name, text in _lines(p)]
    shown += [f"note      {note}" for note in p["notes"]]
    return Findings(p, shown)


def _lines(p: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield the predictions, a line per subject."""
    e = p["estimates"]
    H = p["macro_step"]
    yield "mass", _listed(("beam {:.4g} kg", e["beam_mass"]), ("spring {:.4g} kg", e["spring_mass"]))
    if e["frequency"] is not None and p["frequencies"]:
        frequencies = ", ".join(f"{frequency:.4g}" for frequency in p["frequencies"])
        yield "vibrates", f"at {frequencies} Hz on this mesh; first without a mesh {e['frequency']:.4g} Hz"
    locks = e["locking"] if e["locking"] is not None and e["locking"] > _LOCKS else None
    yield (
        "stiffness",
        _listed(
            ("tip {:.4g} N/m (static)", e["tip_stiffness"]),
            ("{:.3g} times that on this mesh, which locks", locks),
            ("spring {:.4g} N/m", e["spring_stiffness"]),
        ),
    )
    begins = e["contact_time"] if e["contact_time"] != inf else None
    lasts = "lasts about {:.2g} s (half a period together)"
    if contact := _listed(("first at t = {:.4g} s", begins), (lasts, e["contact_duration"])):
        yield "contact", contact
    yield "H", f"{H:g} s"
    if p["omega_1"] is not None:
        beside = f" and {p['static_shapes']} static shapes" if p["static_shapes"] else ""
        yield "beam", (f"ω₁H = {p['omega_1'] * H:.3g}, ω_max H = {p['omega_max'] * H:.3g}; "
                       f"{p['slow_modes']} of {p['modes']} modes with ωH ≤ 1{beside}")  # fmt: skip
        yield "", f"tip mass {p['tip_mass']:.3g} kg, impedance Z = {p['impedance']:.3g} N·s/m"
    for name in ("spring", "contact"):
        if p[f"{name}_frequency"] is not None:
            yield name, f"ωH = {p[f'{name}_frequency'] * H:.3g} at its stiffest"
    if p["exchange"] is not None:
        yield "scheme", _exchange(**p["exchange"])
    seconds = p["cost"]["seconds"]
    about = "" if seconds is None else f", about {in_time(seconds)} with the companion run"
    yield "run", f"{p['cost']['macro_steps']} macro steps{about}"


def _listed(*parts: tuple[str, float | None]) -> str:
    """Return the known numbers with their words."""
    return ", ".join(words.format(value) for words, value in parts if value is not None)


def _exchange(scheme: str, degree: int, spectral_radius: float, critical_step: float | None, threshold: float) -> str:
    """Return whether an exchange is stable, in words."""
    excess = spectral_radius - 1.0
    state = f"unstable: amplitudes grow by {excess:.1e} a step" if excess > threshold else "stable at this H"
    known = "none is unstable" if critical_step is None else f"unstable from H = {critical_step:.3g} s on"
    return f"{scheme} of degree {degree}, {state}; {known}"
