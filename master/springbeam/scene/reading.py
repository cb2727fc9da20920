"""Read and change scenes: TOML files, dictionaries, ``--set`` overrides; each result is validated."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from .loads import Load
from .messages import explain, nearest, one_line
from .partners import kind_of
from .rules import impossible
from .scene import TABLES, Scene, split_key, table_of
from .tables import PICKED_BY_ACCURACY, SceneError

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

#: Most bytes of a scene file.
LONGEST_FILE = 1_000_000


#: TOML in one line, for errors.
_TOML_IS = "a line is a [table] or key = value, with numbers like 0.5 or 1e-3 and texts in quotes"


def shipped_scenes() -> dict[str, Path]:
    """Return names and files of the scenes that come with the package."""
    folder = Path(str(resources.files("springbeam.scene") / "shipped"))
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def load_scene(path_or_name: str | Path, overrides: Iterable[str] = (), accuracy: float | None = None) -> Scene:
    """Read and validate a scene.

    Parameters
    ----------
    path_or_name
        A TOML file, or the name of a shipped scene.
    overrides
        ``"table.key=value"`` strings, the value in TOML syntax; a bare word is taken as a string.
    accuracy
        Takes the place of the scene's own ``accuracy``, if any.

    Raises
    ------
    SceneError
        If the file cannot be read or the scene cannot be run.
    """
    path = _scene_file(path_or_name)
    if (size := path.stat().st_size) > LONGEST_FILE:
        raise SceneError(f"{path}: {size} bytes, more than a scene has; at most {LONGEST_FILE} are read")
    try:
        text = path.read_text(encoding="utf-8-sig")
        data = tomllib.loads(text)
    except OSError as error:
        raise SceneError(f"{path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise SceneError(f"{path}: not TOML, which is text in UTF-8: {error.reason} at byte {error.start}") from error
    except tomllib.TOMLDecodeError as error:
        raise SceneError(f"{path}: not TOML: {error}{_line_of(error, text)}; {_TOML_IS}") from error
    except ValueError as error:  # Python's own limit on the digits of an integer
        raise SceneError(f"{path}: a number in it has more digits than can be read") from error
    except RecursionError as error:
        raise SceneError(f"{path}: nested too deeply; a scene has tables of plain values") from error
    settings = _settings(overrides)
    if accuracy is not None:
        data["accuracy"] = accuracy
    try:
        for table, given in settings.items():
            _change(data, table, {key: parse_value(text.partition("=")[2].strip()) for key, text in given.items()})
        named = ((data.get("beam"), "fmu"), (data.get("spring"), "fmu"), *((load, "file") for load in _loads(data)))
        for content, key in named:
            if isinstance(content, dict) and isinstance(content.get(key), str):
                content[key] = os.path.abspath(path.parent / content[key])
        return scene_from_dict(data, source=str(path))
    except SceneError as error:
        raise SceneError(_blamed(str(error), str(path), settings)) from None


def _line_of(error: Exception, text: str) -> str:
    """Return the line that a TOML error is about, for its message."""
    found = re.search(r"at line (\d+)", str(error))
    lines = text.splitlines()
    return f": {one_line(lines[int(found[1]) - 1].strip())}" if found and int(found[1]) <= len(lines) else ""


def _blamed(message: str, path: str, settings: Mapping[str, Mapping[str, str]]) -> str:
    """Return the message with ``--set`` named instead of the file in lines about a value given there."""
    lines = []
    for line in message.splitlines():
        said = line.removeprefix(f"{path}: ")
        found = re.match(r"\[([\w.]+)\](?: (\w+))?", said)
        there = settings.get(found[1], {}) if found else {}
        given = [text for key, text in there.items() if found and found[2] in (key, None)]
        source = f"--set {given[-1]}" if given else f"{path} with --set" if settings else path
        lines.append(f"{source}: {said}")
    return "\n".join(lines)


def scene_from_dict(data: dict[str, Any], source: str = "scene") -> Scene:
    """Validate a scene given as nested dictionaries; ``source`` names it in errors."""
    try:
        scene = Scene.model_validate(data)
        lines = impossible(scene)
    except ValidationError as error:
        lines = list(dict.fromkeys(map(explain, error.errors())))
    if lines:
        raise SceneError("\n".join(f"{source}: {line}" for line in lines))
    return scene


def with_changes(scene: Scene, **changes: Any) -> Scene:
    """Return a validated copy with keys changed: ``with_changes(scene, coupling={"macro_step": 1e-3})``.

    ``None`` takes a table out, ``with_changes(scene, stop=None)``, or the accuracy. A list ``loads`` takes the place of
    all loads, ``with_changes(scene, **{"loads.0": {"frequency": 12.0}})`` changes the first of them.

    Raises
    ------
    SceneError
        If the changed scene cannot be run, or its ``accuracy`` would overrule a change.
    """
    within = {table: keys for table, keys in changes.items() if isinstance(keys, Mapping)}
    whole = {name: content for name, content in changes.items() if name not in within}
    data = scene.model_dump(exclude_none=True, exclude_unset=True) | whole
    data = {name: content for name, content in data.items() if content is not None}
    for table, keys in within.items():
        _change(data, table, keys)
    return scene_from_dict(data)


def _scene_file(path_or_name: str | Path) -> Path:
    shipped = shipped_scenes()
    if str(path_or_name) in shipped:
        return shipped[str(path_or_name)]
    path = Path(path_or_name)
    try:
        if path.is_file():
            return path
        what = "is a directory" if path.is_dir() else "not a file" if path.exists() else "no such file"
    except OSError as error:  # a name too long
        raise SceneError(f"{one_line(str(path))}: {error.strerror}") from error
    if path.suffix != ".toml":
        what += ", and not a shipped scene"
    raise SceneError(f"{path_or_name}: {what}; {nearest(path.stem, shipped)}shipped scenes: {', '.join(shipped)}")


def _settings(overrides: Iterable[str]) -> dict[str, dict[str, str]]:
    """Return the overrides by table and key; of two for one key the last counts."""
    settings: dict[str, dict[str, str]] = {}
    for override in overrides:
        target, separator, _ = override.partition("=")
        split = split_key(target)
        if not separator or split is None:
            raise SceneError(f"--set {override}: must be TABLE.KEY=VALUE, as in coupling.macro_step=1e-3")
        table, key = split
        settings.setdefault(table, {})[key] = override
    return settings


def _loads(data: Mapping[str, Any]) -> list[Any]:
    """Return the loads; none where they are no list, which `scene_from_dict` refuses."""
    return list(loads) if isinstance(loads := data.get("loads"), (list, tuple)) else []


def _change(data: dict[str, Any], table: str, changes: Mapping[str, Any]) -> None:
    """Set keys of a table, made where it is missing.

    One way to give a thing takes the place of another, unless both are new. Raises SceneError if there is no such
    table or load, or if the scene's accuracy picks one of the keys.
    """
    loads = {f"loads.{i}": load for i, load in enumerate(_loads(data))}
    if table_of(table) is Load and table not in loads:
        raise SceneError(f"[{table}]: the scene has {len(loads)} [[loads]], and the first is loads.0")
    content = loads[table] if table in loads else data.setdefault(table, {})
    if not isinstance(content, dict):
        raise SceneError(f"[{table}]: not a table; tables: {', '.join(TABLES)}")
    for key in changes:
        if data.get("accuracy") is not None and key in PICKED_BY_ACCURACY.get(table, ()):
            raise SceneError(
                f"[{table}] {key}: accuracy = {data['accuracy']} picks {table}.{key} itself; leave one of the two out"
            )
    given = {key for key, value in changes.items() if value is not None}
    model = table_of(table)
    for ways in model.WAYS if model else ():
        if len(new := ways.taken(given)) == 1:
            for key in (key for group in ways.groups if group != new[0] for key in group):
                content.pop(key, None)
    if not {"fmu", "element"}.isdisjoint(changes) and kind_of(dict(changes)) != kind_of(content):
        content.clear()  # another body has other keys
    for key, value in changes.items():
        outer, dot, parameter = key.partition(".")
        if dot and outer == "parameters":
            content[outer] = {**content.get(outer, {}), parameter: value}
        else:
            content[key] = value


def parse_value(text: str) -> Any:
    """Return a value given in TOML syntax; a bare word is taken as a string."""
    with suppress(ValueError, RecursionError):
        parsed = tomllib.loads(f"value = {text}")
        if parsed.keys() == {"value"}:
            return parsed["value"]
    with suppress(ValueError):
        return float(text)  # ".5" and "1." are not TOML
    return text
