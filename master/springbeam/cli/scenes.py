"""``springbeam scenes``, ``keys``, ``new`` and ``predict``: scenes before they are run."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import asdict
from itertools import groupby
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.text import Text

from ..scene import load_scene, shipped_scenes
from ..scene.messages import nearest
from ..scene.reference import MODELS
from ..studies.tables import table
from .common import (
    BAD_INPUT,
    JsonOption,
    SceneArgument,
    SettingsOption,
    bad_input_reported,
    console_for,
    fail,
    print_json,
    say,
)


def _complete_table(incomplete: str) -> list[str]:
    return [name for name in MODELS if name and name.startswith(incomplete)]


def scenes(as_json: JsonOption = False) -> None:
    """List the scenes that come with the package.

    Example: springbeam scenes
    """
    listed: list[dict[str, Any]] = []
    with bad_input_reported():
        for name, path in shipped_scenes().items():
            scene = load_scene(path)
            parts = {"beam": scene.upper, "spring": scene.lower, "stop": scene.stop}
            contents = [part for part, there in parts.items() if there is not None]
            listed.append({
                "name": name, "contains": contents, "t_end": scene.time.t_end, "title": scene.title, "file": path
            })  # fmt: skip
    rows = [(row["name"], ", ".join(row["contains"]), f"{row['t_end']:g}", row["title"]) for row in listed]
    shown = table(("scene", "contains", "t_end [s]", "title"), rows, words=("contains", "title"))
    say(listed, [shown, ""], [("files:", path.parent)], as_json=as_json)


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
    metrics: Annotated[
        bool, typer.Option("--metrics", help="List the numbers of a run that sweep and converge know instead.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """List every key of a scene with unit, allowed values, default and meaning.

    Example: springbeam keys beam
    """
    from ..scene import reference

    if schema:
        print_json(reference.schema())
        return
    if metrics:
        from ..studies.metrics import METRICS

        if as_json:
            print_json([{"name": name, "unit": m.unit, "meaning": m.words} for name, m in METRICS.items()])
        for name, m in () if as_json else METRICS.items():
            typer.echo(f"{name}{f' [{m.unit}]' if m.unit else ''}: {m.words}")
        return
    found = reference.listed()
    if what is not None:
        wanted = re.sub(r"\.\d+", "", what)  # loads.0.frequency is a key of loads
        found = [key for key in found if wanted in (key.table, f"{key.table}.{key.name}".lstrip("."))]
        if not found:
            table, _, name = wanted.partition(".")
            there = [key.name for key in reference.listed(table)] if table in MODELS else [*filter(None, MODELS)]
            kind, hint = ("key", nearest(name, there)) if table in MODELS else ("table", nearest(table, there))
            fail(BAD_INPUT, f"{what}: unknown {kind}; {hint}allowed: {', '.join(there)}")
    if as_json:
        print_json([key._asdict() for key in found])
    console = console_for(silent=as_json)
    for name, group in groupby(found, lambda key: key.table):
        console.print(
            Text(
                f"\n{reference.heading(name)}  {reference.about(name)}" if name else reference.heading(name),
                style="bold",
            )
        )
        for ways in MODELS[name].WAYS:
            console.print(Text(f"give the {ways.thing} one way: {ways}"))
        for key in group:
            unit = "" if key.unit == "–" else f" [{key.unit}]"
            console.print(Text(f"{key.name}{unit}: {key.meaning}"), style="")
            left_out = key.default if key.default.startswith("needed") else f"default: {key.default}"
            console.print(Text(f"    {key.allowed}; {left_out}"), style="dim")


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="The file is NAME.toml; it must not be there yet.")],
) -> None:
    """Write a commented scene to start from: an aluminium beam above a rubber bumper above a stop.

    Example: springbeam new my_scene
    """
    from ..scene.reference import beginning

    path = Path(name).with_suffix(".toml")
    with bad_input_reported():
        try:
            with path.open("x", encoding="utf-8") as file:
                file.write(beginning(path.stem))
        except FileExistsError:
            fail(BAD_INPUT, f"{path}: already there; give another NAME")
    typer.echo(f"{path}: a scene to change; springbeam predict checks its values")


if TYPE_CHECKING:
    from ..studies.stability.predict import Prediction, SchemePrediction

#: A mesh that is so much too stiff is said to lock.
_LOCKS = 1.05


def predict(
    scene: SceneArgument,
    settings: SettingsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Predict, without a run, frequencies, stable macro steps, whether the motion is resolved, and the best scheme.

    Example: springbeam predict soft --set coupling.macro_step=4e-3
    """
    from ..studies.stability.predict import predict as prediction_of
    from ..studies.tables import table

    with bad_input_reported():
        what = load_scene(scene, settings or ())
        prediction = prediction_of(what)
    shown: list[Any] = [Text(what.title or "(untitled scene)", style="bold")]
    shown += [Text(f"{name:<10}{text}") for name, text in _lines(prediction)]
    if prediction.schemes:
        names = ("scheme", "degree", "spectral radius − 1", "critical H [s]", "")
        shown.append(table(names, [_scheme(s, prediction.threshold) for s in prediction.schemes], words=("",)))
    shown += [Text(f"note      {note}") for note in prediction.notes]
    if prediction.auto is not None:
        scheme, degree, because = prediction.auto
        shown.append(Text(f'fits      {scheme} {degree}, which coupling.scheme = "auto" takes: {because}'))
    say(asdict(prediction), shown, as_json=as_json)


def _lines(p: Prediction) -> Iterator[tuple[str, str]]:
    """Yield what is predicted, a line a subject."""
    e, H = p.estimates, p.macro_step
    masses = {"beam": e.beam_mass, "spring": e.spring_mass}
    yield "mass", ", ".join(f"{name} {mass:.4g} kg" for name, mass in masses.items() if mass is not None)
    if e.frequency is not None and p.frequencies:
        found = ", ".join(f"{frequency:.4g}" for frequency in p.frequencies)
        yield "vibrates", f"at {found} Hz on this mesh; first without a mesh {e.frequency:.4g} Hz"
    locks = e.locking is not None and e.locking > _LOCKS
    yield "stiffness", ", ".join([
        *([] if e.tip_stiffness is None else [f"tip {e.tip_stiffness:.4g} N/m (static)"]),
        *([f"{e.locking:.3g} times that on this mesh, which locks"] if locks else []),
        *([] if e.spring_stiffness is None else [f"spring {e.spring_stiffness:.4g} N/m"]),
    ])  # fmt: skip
    if e.contact_time not in (None, inf) or e.contact_duration is not None:
        yield "contact", ", ".join([
            *([] if e.contact_time in (None, inf) else [f"first at t = {e.contact_time:.4g} s"]),
            *([] if e.contact_duration is None
              else [f"lasts about {e.contact_duration:.2g} s (half a period together)"]),
        ])  # fmt: skip
    yield "H", f"{H:g} s"
    if p.omega_1 is not None and p.omega_max is not None:
        beside = f", beside {p.static_shapes} static shapes" if p.static_shapes else ""
        yield "beam", (f"ω₁H = {p.omega_1 * H:.3g}, ω_max H = {p.omega_max * H:.3g}; "
                       f"{p.resolved_modes} of {p.modes} modes resolved (ωH ≤ 1){beside}")  # fmt: skip
        yield "", f"tip mass {p.tip_mass:.3g} kg, impedance Z = {p.impedance:.3g} N·s/m"
    for name, omega in (("spring", p.spring_frequency), ("contact", p.contact_frequency)):
        if omega is not None:
            yield name, f"ωH = {omega * H:.3g} at its stiffest"
    if p.displacement_gain is not None:
        verdict = "diverges" if p.displacement_gain > 1.0 else "converges"
        yield "exchange", f"of displacement against force: gain 2m/(ZH) = {p.displacement_gain:.3g}, {verdict}"


def _scheme(s: SchemePrediction, threshold: float) -> tuple[str, ...]:
    """Return the row of a scheme."""
    excess = s.spectral_radius - 1.0
    return (
        s.scheme,
        str(s.degree),
        "0" if abs(excess) < 1e-11 else f"{excess:.1e}",
        "none" if s.critical_step is None else f"{s.critical_step:.3g}",
        "unstable" if excess > threshold else "",
    )
