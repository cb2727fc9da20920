"""Texts about keys, values and scenes: the JSON Schema of the keys, and error messages.

The text about a key, in errors as in tables, is read from the JSON Schema of its declaration.
"""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Iterable, Mapping
from functools import lru_cache
from math import inf
from typing import Any

from .laws import LAW
from .loads import SIGNAL
from .partners import LOWER, UPPER
from .scene import TABLES, Scene
from .schemes import SCHEME
from .tables import OneOf, SceneError, Table

#: Alternatives for a table, by its name.
VARIANTS: dict[str, OneOf] = {"beam": UPPER, "spring": LOWER, "contact": LAW, "coupling": SCHEME, "loads": SIGNAL}
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


@lru_cache(maxsize=1)
def schema() -> dict[str, Any]:
    """Return the JSON Schema of a scene file (draft 2020-12), for editors and other programs.

    It has meaning, type and range of each key alone; conditions on several keys are in `springbeam.scene.rules`.
    """
    whole = {"$schema": "https://json-schema.org/draft/2020-12/schema", **Scene.model_json_schema()}
    for described in (whole, *whole["$defs"].values()):
        described.pop("required", None)
        for key in described["properties"].values():
            # Left out: null, which TOML does not have, and titles, which repeat the names.
            key |= key.pop("anyOf", [{}])[0]
            for name, empty in (("title", key.get("title")), ("default", None), ("otherwise", "")):
                if name in key and (key[name] == empty or isinstance(key[name], dict)):
                    del key[name]
    for choice in VARIANTS.values():
        for kind in set(choice.named) - {choice.default}:  # a table without the key is the default
            whole["$defs"][choice.tables[kind].__name__]["required"] = [choice.name]
    return whole


def models_of(table: str) -> dict[str, type[Table]]:
    """Return the alternatives for the table of that name, by the value of the key that chooses.

    ``"loads.0"`` is the first of ``[[loads]]``. Empty if there is no such table.
    """
    name = table.partition(".")[0]
    model = VARIANTS.get(name) or TABLES.get(name)
    return model.tables if isinstance(model, OneOf) else {"": model} if model else {}


def keys_of(*models: type[Table]) -> dict[str, dict[str, Any]]:
    """Return the JSON Schema of each key of tables; of a key that several have, that of the first."""
    keys: dict[str, dict[str, Any]] = {}
    for model in models:
        keys = {**schema()["$defs"].get(model.__name__, schema())["properties"], **keys}
    return keys


def allowed(key: Mapping[str, Any]) -> str:
    """Return in words the allowed values of a key of `keys_of`."""
    if choices := key.get("enum") or [key[name] for name in ("const",) if name in key]:
        return either(choices)
    bounds = " and ".join(f"{words} {key[name]:.15g}" for name, words in _BOUNDS.items() if name in key)
    kind = "tables" if "oneOf" in key.get("items", ()) else key.get("type", "table")
    return f"{_NOUNS[kind]} {bounds}".strip()


def either(values: Iterable[Any]) -> str:
    """Return a choice of values for an error: ``"a" or "b"``."""
    return " or ".join(json.dumps(value, ensure_ascii=False) for value in values)


def unit_of(table: str, key: str) -> str:
    """Return the unit of a key of a table, or of a load by its number ("loads.0"); "–" if it has none."""
    return str(keys_of(*models_of(table).values())[key]["unit"])


# -- errors ------------------------------------------------------------------------------------------------------------

#: Former keys and values, as ``[table] key`` or ``[table] key = value``, and their replacement.
GONE: dict[str, str] = {
    '[coupling] scheme = "hermite"': 'is gone; use "energy", whose velocities now agree at every row',
    '[coupling] scheme = "auto"': "is gone; leave scheme and degree out: the highest degree that fits is the default",
    '[beam] integrator = "generalized_alpha"': 'is gone; use "midpoint", which is what it was with rho_inf = 1',
    "[beam] rho_inf": 'is gone; leave it out: integrator = "midpoint" is rho_inf = 1, alpha_b > 0 damps',
    '[contact] law = "paper"': "is no law of a run; use springbeam paper 2, 3, 4 or 5 for Algorithm 1",
    "[contact] impact": "is gone; leave it out: ends that a rigid law joins meet inelastically",
    "[coupling] feedback": "is gone; leave it out: the contact force always acts on both bodies",
    "[coupling] feedback_tolerance": "is gone with feedback; leave it out",
}
#: Types of values by those of the JSON Schema; others are given as texts.
_KINDS: dict[str, type] = {"integer": int, "boolean": bool, "number": float}


def scene_keys() -> list[str]:
    """Return all keys of our own bodies and of the other tables as ``table.key``."""
    models = {**{table: [TABLES[table]] for table in ("beam", "spring")}, "loads.0": models_of("loads").values()}
    tables = [*TABLES, "loads.0"]
    return [f"{table}.{name}" for table in tables for name in keys_of(*models.get(table, models_of(table).values()))]


def key_kind(table: str, key: str) -> type:
    """Return which of int, float, bool and str ``[table] key`` takes. Raises SceneError if there is no such key."""
    models = models_of(table)
    if not models:
        raise SceneError(_unknown(f"[{table}]", table, TABLES))
    keys = keys_of(*models.values())
    if key in keys:
        return _KINDS.get(keys[key]["type"], str)
    if key.startswith("parameters.") and "parameters" in keys:
        return float
    raise SceneError(_unknown(f"[{table}] {key}", key, keys_of(next(iter(models.values())))))


def key_bounds(table: str, key: str) -> tuple[float, float]:
    """Return the lowest and the highest value that ``[table] key`` takes, infinite where there is no bound."""
    bounds = keys_of(*models_of(table).values()).get(key, {})
    low = bounds.get("minimum", bounds.get("exclusiveMinimum", -inf))
    return low, bounds.get("maximum", bounds.get("exclusiveMaximum", inf))


def explain(error: Any) -> str:
    """Return a line ``[table] key = value: fault and allowed values`` for one of pydantic's errors."""
    kind = error["type"]
    value = error["input"]
    table, *keys = map(str, error["loc"])
    choice = VARIANTS.get(table)
    if keys and table == "loads":
        table = f"loads.{keys.pop(0)}"
    variant = keys.pop(0) if keys and choice is not None else ""
    if kind == "value_error":  # one of ours, which says all
        return f"[{table}] {error['msg'].removeprefix('Value error, ')}"
    there = keys_of(models_of(table)[variant]) if keys else keys_of(Scene)
    name = keys[0] if keys else table
    described = there.get(name, {"type": "table"})
    meant = ""
    if kind == "union_tag_invalid" and choice is not None:
        keys = [choice.name]
        value = value[choice.name]
        described = {"enum": choice.named}
        known = choice.elsewhere.get(re.sub(r"[\W_]", "", str(value).lower()))
        meant = f'{one_line(str(value))} is "{known}" here; ' if known else nearest(str(value).lower(), choice.named)
    if name == "parameters" and len(keys) > 1:
        keys = keys[:2]
        described = {"type": "parameter"}
    place = one_line(f"[{table}] {'.'.join(keys)}" if keys else table)
    given = f"{place} = {toml_of(value)}"
    chosen = f'{choice.name} = "{variant}"' if choice is not None and variant in choice.named else ""
    if kind == "extra_forbidden":
        if choice is not None and chosen and (others := choice.that_have(name)):
            return f"{given}: is for {either(others)}, this is {chosen}, which takes {', '.join(there)}"
        return _unknown(place, name, there)
    if kind == "missing":
        needed = f"{chosen} needs it; " if chosen else ""
        otherwise = f" ({described['otherwise']})" if "otherwise" in described else ""
        what = f"the {described['description']} [{described['unit']}]{otherwise}: " if keys else ""
        return f"{place}: missing; {needed}give {what}{allowed(described)}"
    return f"{given}: {GONE.get(given) or meant + 'must be ' + allowed(described)}"


def _unknown(place: str, name: str, there: Iterable[str]) -> str:
    remedy = GONE.get(place) or f"unknown key; {nearest(name, there)}allowed: {', '.join(there)}"
    return f"{place}: {remedy}"


def nearest(name: str, candidates: Iterable[str]) -> str:
    """Return a question that offers the candidate most similar to ``name``, or ""."""
    close = difflib.get_close_matches(name, candidates, n=1)
    return f"did you mean {close[0]}? " if close else ""


def toml_of(value: Any) -> str:
    """Return a value in TOML syntax, in one line of at most 60 characters."""
    return one_line(json.dumps(value, ensure_ascii=False, default=str))


def one_line(text: str, longest: int = 60) -> str:
    """Return ``text`` with unprintable characters replaced, cut to ``longest`` characters."""
    text = "".join(c if c.isprintable() else "�" for c in text)
    return text if len(text) <= longest else text[: longest - 1] + "…"


def at(scene: Scene, place: str) -> str:
    """Return ``[table] key = value`` for ``"table.key"`` of ``scene``."""
    table, _, key = place.rpartition(".")
    number = table.removeprefix("loads.")
    content = scene.loads[int(number)] if number.isdigit() else scene.under(table)
    return f"[{table}] {key} = {toml_of(getattr(content, key))}"


def filled(scene: Scene, text: str, number: int = 0) -> str:
    """Return ``text`` with each ``[table.key]`` replaced by `at`; ``[load.key]`` is of the load of this ``number``."""

    def value(found: re.Match[str]) -> str:
        return at(scene, re.sub(r"^load\.", f"loads.{number}.", found[1]))

    return re.sub(r"\[(\w+\.\w+)\]", value, text)
