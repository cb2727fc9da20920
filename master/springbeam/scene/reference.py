"""All keys of a scene: in words, as a JSON Schema, and a file to start from, made of `springbeam.scene.tables`.

What is said of a key, in errors as in tables, is read from the JSON Schema of its declaration.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import tomli_w

from .loads import Load
from .partners import PARTNERS
from .scene import TABLES, Scene
from .tables import Table

#: Tables by their names, "" is what stands outside of them, and by theirs the bodies that are not our own.
MODELS: dict[str, type[Table]] = {"": Scene, **TABLES, "loads": Load, **PARTNERS}
#: Values by their types in the JSON Schema, in words.
_NOUNS = {
    "number": "a finite number",
    "integer": "a whole number",
    "boolean": "true or false",
    "string": "a text in quotes",
    "array": "a list of 1 to 4 finite numbers",
    "object": "a table, as { k = 3.0e4 }",
    "parameter": "a number, true or false, or a text in quotes",
    "table": "a table, written as [name] above its keys",
    "tables": "tables, each written as [[loads]] above its keys",
}
_BOUNDS = {
    "exclusiveMinimum": "greater than",
    "minimum": "at least",
    "maximum": "at most",
    "exclusiveMaximum": "less than",
}


class Key(NamedTuple):
    """One key of a scene file; ``table`` is "" for those outside a table."""

    table: str
    name: str
    unit: str
    allowed: str
    default: str
    meaning: str


@lru_cache(maxsize=1)
def schema() -> dict[str, Any]:
    """Return the JSON Schema of a scene file (draft 2020-12), for editors and other programs.

    It has each key alone: meaning, type and range. What several keys decide together, as which of them a table needs,
    is left to `springbeam.scene.rules`.
    """
    found = {"$schema": "https://json-schema.org/draft/2020-12/schema", **Scene.model_json_schema()}
    for described in (found, *found["$defs"].values()):
        described.pop("required", None)
        for key in described["properties"].values():
            # What says nothing about a file is left out: TOML has no null, and names are titles enough.
            key |= key.pop("anyOf", [{}])[0]
            for name, empty in (("title", key.get("title")), ("default", None), ("otherwise", "")):
                if name in key and (key[name] == empty or isinstance(key[name], dict)):
                    del key[name]
    return found


def model_of(table: str) -> type[Table] | None:
    """Return the table of that name, ``"loads.0"`` being the first of ``[[loads]]``; ``None`` if there is none."""
    return MODELS.get(table.partition(".")[0])


def keys_of(model: type[Table]) -> dict[str, dict[str, Any]]:
    """Return what the JSON Schema says of each key of a table."""
    properties: dict[str, dict[str, Any]] = schema()["$defs"].get(model.__name__, schema())["properties"]
    return properties


def allowed(key: Mapping[str, Any]) -> str:
    """Return in words what a key of `keys_of` may be."""
    if choices := key.get("enum") or [key[name] for name in ("const",) if name in key]:
        return " or ".join(json.dumps(choice, ensure_ascii=False) for choice in choices)
    bounds = " and ".join(f"{words} {key[name]:.15g}" for name, words in _BOUNDS.items() if name in key)
    kind = "tables" if "$ref" in key.get("items", ()) else key.get("type", "table")
    return f"{_NOUNS[kind]} {bounds}".strip()


def listed(table: str | None = None) -> list[Key]:
    """Return the keys of one table, or all."""
    return [
        Key(name, key, said["unit"], allowed(said), _default(model, key, said), said["description"])
        for name, model in MODELS.items()
        for key, said in keys_of(model).items()
        if table in (None, name) and key not in MODELS
    ]


def heading(table: str) -> str:
    """Return how a table of `MODELS` stands in a file."""
    if table in PARTNERS:
        return "[beam] or [spring] with " + ("fmu" if table == "fmu" else f'element = "{table}"')
    return "outside the tables" if not table else "[[loads]], any number" if table == "loads" else f"[{table}]"


def unit_of(table: str, key: str) -> str:
    """Return the unit of a key of a table, or of a load by its number ("loads.0"); "–" if it has none."""
    return str(keys_of(model_of(table) or Scene)[key]["unit"])


def about(table: str) -> str:
    """Return what a table describes."""
    return " ".join((MODELS[table].__doc__ or "").split()).replace("``", "`")


def _default(model: type[Table], name: str, key: Mapping[str, Any]) -> str:
    if "otherwise" in key:
        return str(key["otherwise"])
    if model.model_fields[name].is_required():
        return "needed" + (", or dimensionless" if name in model.SCALES else "")
    default = key.get("default")
    return "none" if default in (None, "") else str(default).lower()


def beginning(title: str) -> str:
    """Return a commented scene file to start from: an aluminium beam above a rubber bumper above a stop."""
    return tomli_w.dumps({"title": title}) + Path(__file__).with_name("beginning.toml").read_text(encoding="utf-8")
