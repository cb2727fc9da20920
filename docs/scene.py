"""Writes docs/scene.md and docs/scene.schema.json from the declarations of the keys: python docs/scene.py"""

from __future__ import annotations

import json
from pathlib import Path

from pages import DOCS, table  # beside this script

from springbeam.cli import keys as listing
from springbeam.scene.messages import schema as schema_of_scenes
from springbeam.scene.tables import OneOf, Table

HEAD = """# Scene files

A scene is a TOML file of tables; `springbeam new NAME` writes a commented one to start from. All values are SI, up is
positive. A missing `[beam]`, `[spring]` or `[stop]` is a scene without it; a key with an empty default is optional. An
invalid key or value is an error that names the key and the allowed values; a key that plays no part in the scene is
named in a warning. Where a table is one of several, the last column says which of them have a key; a change of the law
or the signal by `--set` keeps the keys that the new one has too. Symbols are those of [model.md](model.md). (Made by
`python docs/scene.py`; `springbeam keys` lists the same.)

**Editors** complete and check keys by the JSON Schema [scene.schema.json](scene.schema.json), which
`springbeam keys --schema` prints: with Taplo or Even Better TOML, the first line of a scene beside it is
`#:schema scene.schema.json`.
"""


#: The values of a key in a narrow column.
SHORT = {
    "a finite number": "number",
    "a whole number": "integer",
    "a text in quotes": "text",
    "greater than": ">",
    "less than": "<",
    "at least": "≥",
    "at most": "≤",
    " and ": ", ",
    '" or "': '", "',
}
COLUMNS = ("key", "value", "default", "meaning")


def row(key: listing.Key) -> tuple[str, ...]:
    """Return a line of a table."""
    value = key.allowed
    for words, short in SHORT.items():
        value = value.replace(words, short)
    unit = "" if key.unit == "–" else f" [{key.unit}]"
    default = "" if key.default == "none" else key.default
    return f"`{key.name}`{unit}", value, default, key.meaning.replace("|", "\\|")


def models_of(name: str) -> list[type[Table]]:
    """Return the alternatives for a table."""
    model = listing.MODELS[name]
    return [*model.tables.values()] if isinstance(model, OneOf) else [model]


def page() -> str:
    """Return the text of scene.md."""
    lines = [HEAD]
    for name in listing.MODELS:
        heading = listing.heading(name)
        lines += [f"## {heading}\n\n{listing.about(name)}\n" if name else f"## {heading.capitalize()}\n"]
        for ways in [ways for model in models_of(name) for ways in model.WAYS]:
            marked = ", or ".join(" and ".join(f"`{key}`" for key in group) for group in ways)
            lines.append(f"Give only one of these: {marked}.\n")
        keys = listing.listed(name)
        some = any(key.of for key in keys)
        rows = [(*row(key), key.of) if some else row(key) for key in keys]
        lines += [*table((*COLUMNS, "with") if some else COLUMNS, rows), ""]
    return "\n".join(lines)


def files() -> dict[Path, str]:
    """Return the text of each file."""
    schema = json.dumps(schema_of_scenes(), indent=1, ensure_ascii=False)
    return {DOCS / "scene.md": page(), DOCS / "scene.schema.json": f"{schema}\n"}


if __name__ == "__main__":
    for path, text in files().items():
        path.write_text(text, encoding="utf-8")
