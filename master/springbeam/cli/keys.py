"""The keys of scene files in words, for ``springbeam keys`` and ``docs/scene.md``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from ..scene import Scene
from ..scene.laws import LAW
from ..scene.loads import SIGNAL
from ..scene.messages import allowed, either, keys_of
from ..scene.partners import PARTNERS, UPPER, ForeignFmu
from ..scene.scene import TABLES
from ..scene.schemes import SCHEME
from ..scene.tables import OneOf, Table

_ELEMENTS = replace(UPPER, tables={name: PARTNERS[name] for name in UPPER.named}, default="")
#: Tables by their names ("" for the keys outside of tables), and bodies that are not our own by theirs; or the
#: alternatives for a table.
MODELS: dict[str, type[Table] | OneOf] = {
    "": Scene,
    **TABLES,
    "contact": LAW,
    "coupling": SCHEME,
    "loads": SIGNAL,
    "fmu": ForeignFmu,
    "element": _ELEMENTS,
}


class Key(NamedTuple):
    """One key of a scene file; ``table`` is "" for those outside a table.

    ``of`` names the alternatives of the table that have the key, if not all do.
    """

    table: str
    name: str
    unit: str
    allowed: str
    default: str
    meaning: str
    of: str = ""


def listed(table: str | None = None) -> list[Key]:
    """Return the keys of one table, or all."""
    return [key for name in MODELS if table in (None, name) for key in _keys(name)]


def _keys(table: str) -> Iterator[Key]:
    """Yield the keys of one of `MODELS`; a key that several of its tables share once."""
    model = MODELS[table]
    choice = model if isinstance(model, OneOf) else OneOf(model, "", "", {"": model}, "")
    kinds_of: dict[Key, list[str]] = {}
    for kind, one in choice.tables.items():
        for name, described in keys_of(one).items():
            if not table and name in MODELS:  # a table, not a key
                continue
            if name == choice.name:
                key = Key(table, name, "–", either(choice.named), choice.default or "needed", choice.meaning)
            else:
                key = Key(
                    table,
                    name,
                    described["unit"],
                    allowed(described),
                    _default(one, name, described),
                    described["description"],
                )
            kinds_of.setdefault(key, []).append(kind)
    for key, kinds in kinds_of.items():
        yield key if len(kinds) == len(choice.tables) else key._replace(of=f"{choice.name} = {either(kinds)}")


def heading(table: str) -> str:
    """Return the heading of a table of `MODELS` in a file."""
    if table in ("fmu", "element"):
        return f"[beam] or [spring] with {table}"
    return "outside the tables" if not table else "[[loads]], any number" if table == "loads" else f"[{table}]"


def about(table: str) -> str:
    """Return the description of a table and of each of its alternatives."""
    model = MODELS[table]
    if not isinstance(model, OneOf):
        return described(model)
    kinds = [f'`{model.name} = "{kind}"`: {described(one)}' for kind, one in model.tables.items()]
    return "\n".join([described(model.common), "", *(f"* {kind}" for kind in kinds)]).strip()


def described(model: type) -> str:
    """Return the docstring of a table as one line."""
    return " ".join((model.__doc__ or "").split()).replace("``", "`")


def _default(model: type[Table], name: str, key: Mapping[str, Any]) -> str:
    if "otherwise" in key:
        return str(key["otherwise"])
    if model.model_fields[name].is_required():
        return "needed" + (", or dimensionless" if name in model.SCALES else "")
    default = key.get("default")
    return "none" if default in (None, "") else str(default).lower()
