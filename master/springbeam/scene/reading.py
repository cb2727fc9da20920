"""Read and change scenes: TOML files, dictionaries, ``--set`` overrides; each result is validated."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from .files import parse_value, shipped_scenes, tables_of
from .laws import OwnContact, SoftLaw
from .messages import VARIANTS, explain, models_of, nearest, one_line
from .rules import impossible
from .scene import TABLES, Scene, split_key
from .schemes import PICKED_BY_ACCURACY
from .tables import ArgumentError, OfProgram, SceneError

#: Keys outside of tables.
_OUTSIDE = ("accuracy", "title")


def load_scene(
    path_or_name: str | Path, changes: Mapping[str, Any] | Iterable[str] = (), accuracy: float | None = None
) -> Scene:
    """Read and validate a scene.

    Parameters
    ----------
    path_or_name
        A TOML file, or the name of a shipped scene.
    changes
        Values as of `with_changes`, ``{"spring.mass": 2.0}``; or ``"table.key=value"`` strings, the value in TOML
        syntax, a bare word being a string.
    accuracy
        Takes the place of the scene's own ``accuracy``, if any.

    Raises
    ------
    SceneError
        If the file cannot be read or the scene cannot be run.
    """
    path = _scene_file(path_or_name)
    overrides = [] if isinstance(changes, Mapping) else list(changes)
    try:
        data = tables_of(path)
    except (OSError, ValueError, RecursionError) as error:
        raise SceneError(
            f"{path}: cannot be read as TOML: {one_line(str(error), 200)}; a line is a [table] or key = value, with "
            "numbers like 0.5 or 1e-3 and texts in quotes"
        ) from error
    if accuracy is not None:
        data["accuracy"] = accuracy
    tables = by_table(changes) if isinstance(changes, Mapping) else _settings(overrides)
    source = " ".join([str(path), *(f"--set {override}" for override in overrides)])
    try:
        _apply(data, tables)
    except SceneError as error:
        raise SceneError(f"{source}: {error}") from None
    for content, key in ((data.get("beam"), "fmu"), (data.get("spring"), "fmu"), *((q, "file") for q in _loads(data))):
        if isinstance(content, dict) and isinstance(content.get(key), str):
            content[key] = os.path.abspath(path.parent / content[key])
    return scene_from_dict(data, source)


def as_scene(scene: Scene | Mapping[str, Any] | str | Path) -> Scene:
    """Return a scene: as it is, of nested dictionaries, or what `load_scene` reads. Raises SceneError."""
    if isinstance(scene, Scene):
        return scene
    return scene_from_dict(by_table(scene)) if isinstance(scene, Mapping) else load_scene(scene)


def _scene_file(path_or_name: str | Path) -> Path:
    shipped = shipped_scenes()
    path = shipped.get(str(path_or_name), Path(path_or_name))
    if os.path.isfile(path):  # also where the name is longer than names may be
        return path
    what = "is a directory" if os.path.isdir(path) else "no such file"
    near = nearest(path.stem, shipped)
    raise SceneError(f"{one_line(str(path))}: {what}, and no shipped scene; {near}shipped scenes: {', '.join(shipped)}")


def _settings(overrides: Iterable[str]) -> dict[str, Any]:
    """Return values by table and key, and those outside of tables; the last of two for one key counts."""
    changes: dict[str, Any] = {}
    for override in overrides:
        target, separator, value = (part.strip() for part in override.partition("="))
        if not separator or (split_key(target) is None and target not in _OUTSIDE):
            raise ArgumentError(f"--set {override}: must be TABLE.KEY=VALUE, as in coupling.macro_step=1e-3")
        changes[target] = parse_value(value)
    return by_table(changes)


def with_changes(scene: Scene, changes: Mapping[str, Any] | None = None, /, **tables: Any) -> Scene:
    """Return a validated copy with keys changed.

    ``with_changes(scene, {"spring.mass": 2.0, "loads.0.frequency": 12.0})`` changes keys,
    ``with_changes(scene, spring={"mass": 2.0}, stop=None)`` keys of tables; ``None`` takes a table out, or the
    accuracy. A list ``loads`` takes the place of all loads, a `springbeam.SoftLaw` as ``contact`` that of the law.

    Raises
    ------
    SceneError
        If the changed scene cannot be run, or its ``accuracy`` would overrule a change.
    """
    data = scene.model_dump(exclude_none=True, exclude_unset=True)
    if isinstance(scene.contact, OfProgram):
        data["contact"] = scene.contact
    if any(isinstance(load, OfProgram) for load in scene.loads):
        data["loads"] = [load if isinstance(load, OfProgram) else load.model_dump() for load in scene.loads]
    _apply(data, by_table({**(changes or {}), **tables}))
    return scene_from_dict(data)


def by_table(changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return values with dotted names, as ``"spring.mass"``, in dictionaries of their tables."""
    tables: dict[str, Any] = {}
    for name, value in changes.items():
        split = None if isinstance(value, Mapping) else split_key(name)
        table, content = (name, value) if split is None else (split[0], {split[1]: value})
        there = tables.get(table)
        tables[table] = {**there, **content} if isinstance(there, dict) and isinstance(content, Mapping) else content
    return tables


def _apply(data: dict[str, Any], changes: Mapping[str, Any]) -> None:
    """Change tables, given by their keys, and replace everything else; ``None`` takes it out. Raises SceneError."""
    whole = {
        name: OwnContact(own=content) if isinstance(content, SoftLaw) else content
        for name, content in changes.items()
        if not isinstance(content, Mapping)
    }
    data |= whole
    for name in [name for name, content in whole.items() if content is None]:
        del data[name]
    for table, keys in changes.items():
        if table not in whole:
            _change(data, table, keys)


def scene_from_dict(data: dict[str, Any], source: str = "scene") -> Scene:
    """Validate a scene given as nested dictionaries; ``source`` names it in errors."""
    try:
        scene = Scene.model_validate(data)
        lines = impossible(scene)
    except ValidationError as error:
        errors = error.errors()
        # A list with a bad item is too short without it: only the item is to be mended.
        within = {one["loc"][:depth] for one in errors for depth in range(len(one["loc"]))}
        lines = list(dict.fromkeys(explain(one) for one in errors if one["loc"] not in within))
    if lines:
        raise SceneError("\n".join(f"{source}: {line}" for line in lines))
    return scene


def _loads(data: Mapping[str, Any]) -> list[Any]:
    """Return the loads; none where they are no list, which `scene_from_dict` refuses."""
    return list(loads) if isinstance(loads := data.get("loads"), (list, tuple)) else []


def _change(data: dict[str, Any], table: str, changes: Mapping[str, Any]) -> None:
    """Set keys of a table, made where it is missing.

    A new key replaces another one that gives the same value, unless both are new. Raises SceneError if there is no such
    load, or if the scene's accuracy picks one of the keys.
    """
    loads = {f"loads.{i}": load for i, load in enumerate(_loads(data))}
    content = loads.get(table) or data.setdefault(table, {})
    models = models_of(table)
    if not isinstance(content, dict) or not models or (table not in loads and table not in TABLES):
        there = (*TABLES, *loads)
        raise SceneError(f"[{table}]: no table of this scene; {nearest(table, there)}allowed: {', '.join(there)}")
    if data.get("accuracy") is not None and (picked := changes.keys() & set(PICKED_BY_ACCURACY.get(table, ()))):
        raise SceneError(
            f"[{table}] {min(picked)}: accuracy = {data['accuracy']} picks it itself; leave one of the two out"
        )
    choice = VARIANTS.get(table.partition(".")[0])
    if choice is not None and not {"fmu", choice.name}.isdisjoint(changes):
        kind = choice.kind(dict(changes))
        kept = content if kind == choice.kind(content) else choice.kept(content, kind)
        for key in content.keys() - kept.keys():
            del content[key]
    given = {key for key, value in changes.items() if value is not None}
    for key in given:
        for model in models.values():
            for other in model.other_ways(key) - given:
                content.pop(other, None)
    for key, value in changes.items():
        outer, dot, parameter = key.partition(".")
        if dot and outer == "parameters":
            content[outer] = {**content.get(outer, {}), parameter: value}
        else:
            content[key] = value
