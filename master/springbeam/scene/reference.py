"""All keys of a scene: in words, as a JSON Schema, and a file to start from, made of `springbeam.scene.tables`."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import tomli_w
from pydantic.fields import FieldInfo

from .loads import Load
from .messages import allowed, extra
from .partners import PARTNERS
from .scene import TABLES, Scene
from .tables import Table

#: Tables by their names, "" is what stands outside of them, and by theirs the bodies that are not our own.
MODELS: dict[str, type[Table]] = {"": Scene, **TABLES, "loads": Load, **PARTNERS}


class Key(NamedTuple):
    """One key of a scene file; ``table`` is "" for those outside a table."""

    table: str
    name: str
    unit: str
    allowed: str
    default: str
    meaning: str


def listed(table: str | None = None) -> list[Key]:
    """Return the keys of one table, or all."""
    return [
        Key(name, key, extra(field, "unit"), allowed(field), _default(model, key, field), field.description or "")
        for name, model in MODELS.items()
        for key, field in model.model_fields.items()
        if table in (None, name) and (field.alias or key) not in MODELS
    ]


def heading(table: str) -> str:
    """Return how a table of `MODELS` stands in a file."""
    if table in PARTNERS:
        return "[beam] or [spring] with " + ("fmu" if table == "fmu" else f'element = "{table}"')
    return "outside the tables" if not table else "[[loads]], any number" if table == "loads" else f"[{table}]"


def unit_of(table: str, key: str) -> str:
    """Return the unit of a key of a table, or of a load by its number ("loads.0"); "–" if it has none."""
    return str(extra(MODELS[table.partition(".")[0]].model_fields[key], "unit"))


def about(table: str) -> str:
    """Return what a table describes."""
    return " ".join((MODELS[table].__doc__ or "").split()).replace("``", "`")


def _default(model: type[Table], name: str, field: FieldInfo) -> str:
    if otherwise := extra(field, "otherwise"):
        return str(otherwise)
    for ways in model.WAYS:
        if any(name in group for group in ways.groups) and model.model_fields[ways.groups[0][0]].is_required():
            return f"needed: the {ways.thing} one way"
    if field.is_required():
        return "needed" + (", or dimensionless" if name in model.SCALES else "")
    default = field.default
    return "none" if default in (None, "") else str(default).lower() if isinstance(default, bool) else f"{default}"


def schema() -> dict[str, Any]:
    """Return the JSON Schema of a scene file (draft 2020-12), for editors and other programs.

    It has each key alone: meaning, type and range. What several keys decide together, as which of them a table needs,
    is left to `springbeam.scene.rules`.
    """
    found = {"$schema": "https://json-schema.org/draft/2020-12/schema", **Scene.model_json_schema()}
    for described in (found, *found["$defs"].values()):
        described.pop("required", None)
        for key in described["properties"].values():
            _plain(key)
    return found


def _plain(key: dict[str, Any]) -> None:
    """Take out what says nothing about a file: TOML has no null, and names are titles enough."""
    key |= next((way for way in key.pop("anyOf", ()) if way.get("type") != "null"), {})
    for name, empty in (("title", key.get("title")), ("default", None), ("otherwise", "")):
        if name in key and (key[name] == empty or isinstance(key[name], dict)):
            del key[name]


def beginning(title: str) -> str:
    """Return a scene file to start from: ``beginning.toml``, with the meaning and unit of each key beside it.

    It has an aluminium beam, 0.8 m × 30 × 3 mm, above a rubber bumper above a stop.
    """
    lines = [
        tomli_w.dumps({"title": title}).strip(),
        "",
        "# All values are SI, up is positive. springbeam keys lists every key, springbeam predict checks the values.",
        "",
    ]
    table = ""
    for line in Path(__file__).with_name("beginning.toml").read_text(encoding="utf-8").splitlines():
        name, comment = line.partition(" = ")[0].strip("[]"), ""
        if line.startswith("["):
            table, comment = name, f"  # {about(name).partition('. ')[0].rstrip('.')}."
        elif line:
            field = TABLES[table].model_fields[name]
            unit = extra(field, "unit")
            comment = " " * (32 - len(line)) + f"# {field.description}" + ("" if unit == "–" else f" [{unit}]")
        lines.append(line + comment)
    return "\n".join(lines) + "\n"
