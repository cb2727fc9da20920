"""Say in words what is wrong with a key or a value, and what would be allowed."""

from __future__ import annotations

import datetime
import difflib
import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from types import UnionType
from typing import Any, Literal, NamedTuple, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from .loads import Load
from .partners import OWN, PARTNERS
from .scene import TABLES, Scene, table_of
from .tables import SceneError, Table


def scene_keys() -> list[str]:
    """Return all keys as ``table.key``."""
    tables: dict[str, type[Table]] = {**TABLES, "loads.0": Load}
    return [f"{table}.{key}" for table, model in tables.items() for key in model.model_fields]


def key_kind(table: str, key: str) -> type:
    """Return which of int, float, bool and str ``[table] key`` takes. Raises SceneError if there is no such key."""
    model = table_of(table)
    if model is None:
        raise SceneError(_explain_top("extra_forbidden", {}, table))
    models = [model, *(PARTNERS.values() if table in ("beam", "spring") else ())]
    field = next((model.model_fields[key] for model in models if key in model.model_fields), None)
    if field is None and models[1:] and key.startswith("parameters."):
        return float
    if field is None:
        raise SceneError(f"[{table}] {key}: unknown key; {_nearest_key(table, key)}")
    kinds = {
        type(get_args(part)[0]) if get_origin(part) is Literal else part for part in _alternatives(field.annotation)
    }
    return next((kind for kind in (int, bool, float) if kind in kinds), str)


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

    ``when`` and ``numbers`` get the scene. Of a rule for loads they get scene and load, and ``{load.key}`` is its key.
    """

    when: Callable[..., object]
    text: str
    numbers: Callable[..., Mapping[str, Any]] = lambda *of: {}


def told(scene: Scene, rules: Iterable[Rule], of_loads: Sequence[Rule] = ()) -> Iterator[str]:
    """Yield what ``rules`` tell of ``scene``, and ``of_loads`` of each of its loads."""
    for rule in rules:
        if rule.when(scene):
            yield filled(scene, rule.text, **rule.numbers(scene))
    for number, load in enumerate(scene.loads):
        for rule in of_loads:
            if rule.when(scene, load):
                yield filled(scene, rule.text.replace("{load.", f"{{loads.{number}."), **rule.numbers(scene, load))


def _alternatives(annotation: Any) -> tuple[Any, ...]:
    """Return the types that an annotation allows, None last."""
    return get_args(annotation) if get_origin(annotation) in (Union, UnionType) else (annotation,)


def explain(error: Any) -> list[str]:
    """Return lines ``[table] key = value: what is wrong and what would be allowed`` for one of pydantic's errors."""
    kind, value, loc = error["type"], error["input"], [str(part) for part in error["loc"]]
    if loc[:1] == ["loads"] and len(loc) > 1:
        loc = [f"loads.{loc[1]}", *loc[2:]]
    if loc[0] in ("beam", "spring"):
        if kind == "union_tag_invalid":
            elements = " or ".join(toml_of(name) for name in PARTNERS if name != "fmu")
            return [f"[{loc[0]}] element = {toml_of(value['element'])}: must be {elements}"]
        loc, body = [loc[0], *loc[2:]], loc[1]
    else:
        body = OWN
    if kind == "value_error":
        prefix = f"[{loc[0]}] " if loc else ""
        return [prefix + line for line in error["msg"].removeprefix("Value error, ").splitlines()]
    if len(loc) == 1:
        return [_explain_top(kind, value, loc[0])]
    table, name, key = loc[0], loc[1], ".".join(map(_bare, loc[1:]))
    model = PARTNERS.get(body) or table_of(table)
    assert model is not None
    if kind == "extra_forbidden":
        beside = {OWN: "", "fmu": " beside fmu"}.get(body, f' of element = "{body}"')
        return [f"[{table}] {key}: unknown key{beside}; {_nearest_key(table, key, body)}"]
    if kind == "missing":
        return [f"[{table}] {_missing(model, key, value)}"]
    may_be = allowed(model.model_fields[name])
    if name == "parameters" and len(loc) > 2:  # the last word is one of the types that the value is not
        key, may_be = key.rpartition(".")[0], "a number, true or false, or a text in quotes"
    return [f"[{table}] {key} = {toml_of(value)}: must be {may_be}"]


def _missing(model: type[Table], key: str, given: Any) -> str:
    """Return what is missing and the ways to give it; ``given`` is the content of the table."""
    for ways in model.WAYS:
        if key in ways.groups[0]:
            begun = ways.taken(given)
            names = [name for name in begun[0] if name not in given] if begun else [ways.thing]
            return f"{' and '.join(names)}: missing; give {ways}"
    field = model.model_fields[key]
    also = f" ({words})" if (words := extra(field, "otherwise")) else ""
    return f"{key}: missing; give the {field.description} [{extra(field, 'unit')}]{also}: {allowed(field)}"


def extra(field: FieldInfo, name: str) -> Any:
    """Return what `springbeam.scene.tables.key` noted of a key: its "unit", "otherwise" or "enum"; "" if nothing."""
    return field.json_schema_extra.get(name, "") if isinstance(field.json_schema_extra, dict) else ""


def _explain_top(kind: str, value: Any, name: str) -> str:
    if kind == "missing":
        needed = [key for key, field in TABLES[name].model_fields.items() if field.is_required()]
        return f"[{name}]: missing table; it must have {', '.join(needed)}"
    if kind == "extra_forbidden" and isinstance(value, dict):
        return f"[{_bare(name)}]: unknown table; {nearest(name, TABLES)}allowed: {', '.join(TABLES)}"
    if kind == "extra_forbidden":
        return f"{_bare(name)} = {toml_of(value)}: unknown key outside a table; {_nearest_key('', name)}"
    if table_of(name):
        may_be = f"a table, written as [{'[loads]' if name not in TABLES else name}]"
    else:
        may_be = allowed(Scene.model_fields[name])
    return f"{name} = {toml_of(value)}: must be {may_be}"


def nearest(name: str, candidates: Iterable[str]) -> str:
    close = difflib.get_close_matches(name, candidates, n=1)
    return f"did you mean {close[0]}? " if close else ""


def _nearest_key(table: str, key: str, body: str = OWN) -> str:
    model = PARTNERS.get(body) or table_of(table)
    here = list(model.model_fields) if model else ["title", *(f"[{name}]" for name in TABLES)]
    elsewhere = [f"[{name}]" for name, other in TABLES.items() if key in other.model_fields]
    if body != OWN and key in TABLES[table].model_fields:
        elsewhere = [f"our own {table}"]
    longer = [name for name in here if name.endswith(f"_{key}")]
    if longer:
        hint = f"did you mean {longer[0]}? "
    else:
        hint = f"it belongs to {elsewhere[0]}; " if elsewhere else nearest(key, here)
    return f"{hint}allowed: {', '.join(here)}"


def allowed(field: FieldInfo) -> str:
    """Return in words what a key may be, from its declaration."""
    if field.annotation == tuple[Load, ...]:
        return "tables, written as [[loads]]"
    if tuple[float, ...] in _alternatives(field.annotation):
        return "a list of 1 to 4 finite numbers"
    if get_origin(field.annotation) is dict:
        return "a table, as { k = 3.0e4 }"
    if names := extra(field, "enum"):
        return " or ".join(toml_of(name) for name in names)
    for part in _alternatives(field.annotation):
        if get_origin(part) is Literal:
            return " or ".join(toml_of(choice) for choice in get_args(part))
    nouns: dict[Any, str] = {bool: "true or false", str: "a text in quotes", int: "a whole number"}
    noun = next((nouns[part] for part in _alternatives(field.annotation) if part in nouns), "a finite number")
    bounds = {
        name: value
        for m in field.metadata
        for name in ("gt", "ge", "le", "lt")
        if (value := getattr(m, name, None)) is not None
    }
    words = {"gt": "greater than", "ge": "at least", "le": "at most", "lt": "less than"}
    return " ".join([noun, " and ".join(f"{words[name]} {value:.15g}" for name, value in bounds.items())]).strip()


def toml_of(value: Any) -> str:
    """Return a value as it may stand in a file, in one line of at most 60 characters."""
    if isinstance(value, dict):
        return "{…}"
    if isinstance(value, (bool, str)):
        return one_line(json.dumps(value, ensure_ascii=False))
    if isinstance(value, (datetime.date, datetime.time)):
        return value.isoformat()
    if isinstance(value, list):
        shown = [toml_of(item) if not isinstance(item, list) else "[…]" for item in value[:8]]
        return one_line(f"[{', '.join(shown)}{', …' if len(value) > 8 else ''}]")
    if isinstance(value, int) and value.bit_length() > 1000:  # more digits than Python may convert
        return one_line(hex(value)[:50] + "…")
    return one_line(repr(value))


def _bare(key: str) -> str:
    """Return a key as it may stand in a file."""
    return one_line(key if re.fullmatch("[A-Za-z0-9_.-]+", key) else json.dumps(key, ensure_ascii=False))


def one_line(text: str, longest: int = 60) -> str:
    text = "".join(c if c.isprintable() else "�" for c in text)
    return text if len(text) <= longest else text[: longest - 1] + "…"
