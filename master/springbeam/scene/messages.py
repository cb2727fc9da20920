"""Say in words what is wrong with a key, a value or a whole scene, and what would be allowed."""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from .partners import OWN, PARTNERS
from .reference import allowed, keys_of, model_of
from .scene import TABLES, Scene
from .tables import SceneError

#: Types of values by those of the JSON Schema; others are given as texts.
_KINDS: dict[str, type] = {"integer": int, "boolean": bool, "number": float}


def scene_keys() -> list[str]:
    """Return all keys as ``table.key``."""
    return [f"{table}.{key}" for table in (*TABLES, "loads.0") for key in keys_of(model_of(table) or Scene)]


def key_kind(table: str, key: str) -> type:
    """Return which of int, float, bool and str ``[table] key`` takes. Raises SceneError if there is no such key."""
    own = model_of(table)
    if own is None:
        raise SceneError(_unknown(f"[{table}]", table, TABLES))
    for model in (own, *(PARTNERS.values() if table in ("beam", "spring") else ())):
        if key in keys_of(model):
            return _KINDS.get(keys_of(model)[key]["type"], str)
        if key.startswith("parameters.") and "parameters" in keys_of(model):
            return float
    raise SceneError(_unknown(f"[{table}] {key}", key, keys_of(own)))


def explain(error: Any) -> str:
    """Return a line ``[table] key = value: what is wrong and what would be allowed`` for one of pydantic's errors."""
    kind, value = error["type"], error["input"]
    table, *keys = map(str, error["loc"])
    body = keys.pop(0) if keys and table in ("beam", "spring") else OWN
    if keys and table == "loads":
        table = f"loads.{keys.pop(0)}"
    if kind == "value_error":  # one of ours, which says all
        return f"[{table}] {error['msg'].removeprefix('Value error, ')}"
    there = keys_of(PARTNERS.get(body) or model_of(table) or Scene) if keys else keys_of(Scene)
    name = keys[0] if keys else table
    said = there.get(name, {"type": "table"})
    if kind == "union_tag_invalid":
        keys, value, said = ["element"], value["element"], {"enum": [body for body in PARTNERS if body != "fmu"]}
    if name == "parameters" and len(keys) > 1:
        keys, said = keys[:2], {"type": "parameter"}
    place = one_line(f"[{table}] {'.'.join(keys)}" if keys else table)
    if kind == "extra_forbidden":
        return _unknown(place, name, there)
    if kind == "missing":
        otherwise = f" ({said['otherwise']})" if "otherwise" in said else ""
        what = f"the {said['description']} [{said['unit']}]{otherwise}: " if keys else ""
        return f"{place}: missing; give {what}{allowed(said)}"
    return f"{place} = {toml_of(value)}: must be {allowed(said)}"


def _unknown(place: str, name: str, there: Iterable[str]) -> str:
    return f"{place}: unknown key; {nearest(name, there)}allowed: {', '.join(there)}"


def nearest(name: str, candidates: Iterable[str]) -> str:
    """Return a question after the candidate that is most like ``name``, "" if none is."""
    close = difflib.get_close_matches(name, candidates, n=1)
    return f"did you mean {close[0]}? " if close else ""


def toml_of(value: Any) -> str:
    """Return a value as it may stand in a file, in one line of at most 60 characters."""
    try:
        return one_line(json.dumps(value, ensure_ascii=False, default=str))
    except (ValueError, RecursionError):
        return "…"  # an integer of more digits than Python converts, or lists nested too deeply


def one_line(text: str, longest: int = 60) -> str:
    """Return ``text`` with what cannot be printed replaced, cut to ``longest`` characters."""
    text = "".join(c if c.isprintable() else "�" for c in text)
    return text if len(text) <= longest else text[: longest - 1] + "…"


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
