"""``springbeam scenes``, ``springbeam keys`` and ``springbeam new``."""

from __future__ import annotations

import re
from itertools import groupby
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.text import Text

from ..scene import load_scene, shipped_scenes
from ..scene.messages import nearest
from ..scene.reference import MODELS
from ..studies.tables import table
from .common import BAD_INPUT, JsonOption, bad_input_reported, console_for, fail, print_json


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
    if as_json:
        print_json(listed)
    console = console_for(silent=as_json)
    rows = [(row["name"], ", ".join(row["contains"]), f"{row['t_end']:g}", row["title"]) for row in listed]
    console.print(table(("scene", "contains", "t_end [s]", "title"), rows, words=("contains", "title")))
    console.print(Text(f"\nfiles: {path.parent}"), soft_wrap=True)


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
