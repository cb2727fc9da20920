"""Say in words what is wrong with a key, a value or a whole scene, and what would be allowed."""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from .loads import Load
from .partners import OWN, PARTNERS
from .reference import allowed, keys_of
from .scene import TABLES, Scene, table_of
from .tables import SceneError, Table

#: Types of values by those of the JSON Schema; others are given as texts.
_KINDS: dict[str, type] = {"integer": int, "boolean": bool, "number": float}


def scene_keys() -> list[str]:
    """Return all keys as ``table.key``."""
    tables: dict[str, type[Table]] = {**TABLES, "loads.0": Load}
    return [f"{table}.{key}" for table, model in tables.items() for key in model.model_fields]


def key_kind(table: str, key: str) -> type:
    """Return which of int, float, bool and str ``[table] key`` takes. Raises SceneError if there is no such key."""
    models = [table_of(table) or Table, *(PARTNERS.values() if table in ("beam", "spring") else ())]
    for model in models:
        if table_of(table) and key in model.model_fields:
            return _KINDS.get(keys_of(model)[key]["type"], str)
    if models[1:] and key.startswith("parameters."):
        return float
    raise SceneError(_unknown(table, key) if table_of(table) else _unknown(table, "", {}))


def at(scene: Scene, place: str) -> str:
    """Return ``[table] key = value`` for ``"table.key"`` of ``scene``."""
    table, _, key = place.rpartition(".")
    number = table.removeprefix("loads.")
    content = scene.loads[int(number)] if number.isdigit() else scene.under(table)
    return f"[{table}] {key} = {toml_of(getattr(content, key))}"


def filled(scene: Scene, text: str, **numbers: Any) -> str:
    """Return ``text`` with keys and their values in place of ``{table.key}``, and ``numbers`` of ``{name:format}``."""
    return re.sub(
        r"\{([\w.]+):?([^}]*)\}",
        lambda found: at(scene, found[1]) if "." in found[1] else format(numbers[found[1]], found[2]),
        text,
    )


class Rule(NamedTuple):
    """When something is told of a scene, and what; `filled` explains ``text``.

    ``when`` and ``numbers`` get the scene, and what of it the rule is for. If ``when`` returns a dict, these are the
    numbers. ``{load.key}`` is a key of the load that the rule is for.
    """

    when: Callable[..., object]
    text: str
    numbers: Callable[..., Mapping[str, Any]] = lambda *of: {}


def told(scene: Scene, rules: Iterable[Rule], *of: Any) -> Iterator[str]:
    """Yield what ``rules`` tell of ``scene``, and of what in it they are for."""
    for rule in rules:
        if found := rule.when(scene, *of):
            yield filled(scene, rule.text, **(found if isinstance(found, dict) else rule.numbers(scene, *of)))


def told_of_loads(scene: Scene, rules: Sequence[Rule]) -> Iterator[str]:
    """Yield what ``rules`` tell of each load of ``scene``."""
    for number, load in enumerate(scene.loads):
        here = [rule._replace(text=rule.text.replace("{load.", f"{{loads.{number}.")) for rule in rules]
        yield from told(scene, here, load)


def explain(error: Any) -> str:
    """Return a line ``[table] key = value: what is wrong and what would be allowed`` for one of pydantic's errors."""
    kind, value = error["type"], error["input"]
    table, *keys = map(str, error["loc"])
    body = keys.pop(0) if keys and table in ("beam", "spring") else OWN
    table = f"loads.{keys.pop(0)}" if keys and table == "loads" else table
    model, key = PARTNERS.get(body) or table_of(table), ".".join(map(_bare, keys))
    if kind == "value_error":
        return f"[{table}] {error['msg'].removeprefix('Value error, ')}"
    if kind == "extra_forbidden":
        return _unknown(table, key, value, body)
    if kind == "missing":
        return _missing(table, model, key, value)
    if kind == "union_tag_invalid":
        key, value = "element", value["element"]
        may_be = " or ".join(toml_of(name) for name in PARTNERS if name != "fmu")
    elif key.startswith("parameters."):  # the last word is one of the types that the value is not
        key, may_be = key.rpartition(".")[0], "a number, true or false, or a text in quotes"
    elif keys and model:
        may_be = allowed(keys_of(model)[keys[0]])
    elif table == "loads":
        may_be = "tables, written as [[loads]]"
    else:
        written = table if table in TABLES else "[loads]"
        may_be = f"a table, written as [{written}]" if model else allowed(keys_of(Scene)[table])
    return f"{f'[{table}] {key}' if key else table} = {toml_of(value)}: must be {may_be}"


def _missing(table: str, model: type[Table] | None, key: str, given: Any) -> str:
    """Return what is missing and the ways to give it; ``given`` is the content of the table."""
    assert model is not None
    if not key:
        needed = [name for name, field in model.model_fields.items() if field.is_required()]
        return f"[{table}]: missing table; it must have {', '.join(needed)}"
    for ways in model.WAYS:
        if key in ways.groups[0]:
            begun = ways.taken(given)
            names = [name for name in begun[0] if name not in given] if begun else [ways.thing]
            return f"[{table}] {' and '.join(names)}: missing; give {ways}"
    said = keys_of(model)[key]
    also = f" ({said['otherwise']})" if "otherwise" in said else ""
    return f"[{table}] {key}: missing; give the {said['description']} [{said['unit']}]{also}: {allowed(said)}"


def nearest(name: str, candidates: Iterable[str]) -> str:
    """Return a question after the candidate that is most like ``name``, "" if none is."""
    close = difflib.get_close_matches(name, candidates, n=1)
    return f"did you mean {close[0]}? " if close else ""


def _unknown(table: str, key: str, value: Any = None, body: str = OWN) -> str:
    """Return that there is no such table, or no such key in one, and those that there are."""
    if not key and isinstance(value, dict):
        return f"[{_bare(table)}]: unknown table; {nearest(table, TABLES)}allowed: {', '.join(TABLES)}"
    model, name = PARTNERS.get(body) or table_of(table), key or table
    own = body != OWN and name in TABLES[table].model_fields
    others = [f"our own {table}"] if own else [f"[{other}]" for other in TABLES if name in TABLES[other].model_fields]
    here = list(model.model_fields) if model else ["title", *(f"[{name}]" for name in TABLES)]
    hints = [f"did you mean {longer}? " for longer in here if longer.endswith(f"_{name}")]
    hints += [f"it belongs to {other}; " for other in others]
    if key:
        kind = {OWN: "", "fmu": " beside fmu"}.get(body, f' of element = "{body}"')
        place = f"[{table}] {key}"
    else:
        kind, place = " outside a table", f"{_bare(table)} = {toml_of(value)}"
    return f"{place}: unknown key{kind}; {[*hints, nearest(name, here)][0]}allowed: {', '.join(here)}"


def toml_of(value: Any) -> str:
    """Return a value as it may stand in a file, in one line of at most 60 characters."""
    match value:
        case dict():
            shown = "{…}"
        case list() | tuple():
            shown = f"[{', '.join(map(toml_of, value))}]"
        case bool() | str():
            shown = json.dumps(value, ensure_ascii=False)
        case int() if value.bit_length() > 1000:  # more digits than Python may convert
            shown = hex(value)
        case _:
            shown = str(value)
    return one_line(shown)


def _bare(key: str) -> str:
    """Return a key as it may stand in a file."""
    return one_line(key if re.fullmatch("[A-Za-z0-9_.-]+", key) else json.dumps(key, ensure_ascii=False))


def one_line(text: str, longest: int = 60) -> str:
    """Return ``text`` with what cannot be printed replaced, cut to ``longest`` characters."""
    text = "".join(c if c.isprintable() else "�" for c in text)
    return text if len(text) <= longest else text[: longest - 1] + "…"
