"""Writes docs/scene.md and docs/scene.schema.json from the declarations of the keys: python docs/scene.py"""

from __future__ import annotations

import json
from pathlib import Path

from pages import DOCS, table  # beside this script

from springbeam.scene import reference

HEAD = """# Scene files

Made by `python docs/scene.py` from the declarations that `springbeam keys` lists.

A scene is a TOML file of tables. All values are SI, up is positive. A missing `[beam]`, `[spring]` or `[stop]` is a
scene without it. Invalid keys and values are rejected; the error names the key and the allowed values. A
key that plays no part in the scene (`rho_inf` with the modal integrator, `stiffness` of a tie) is named in a warning.
`springbeam new NAME` writes a commented scene to start from. The symbols are those of [model.md](model.md), the
schemes those of [coupling.md](coupling.md).

**Editors** complete and check keys by the JSON Schema [scene.schema.json](scene.schema.json), which
`springbeam keys --schema` prints: with Taplo or Even Better TOML, the first line of a scene beside it is
`#:schema scene.schema.json`.
"""


def page() -> str:
    """Return the text of scene.md."""
    lines = [HEAD]
    for name, model in reference.MODELS.items():
        heading = reference.heading(name)
        lines += [f"## {heading}\n\n{reference.about(name)}\n" if name else f"## {heading.capitalize()}\n"]
        for ways in model.WAYS:
            marked = ", or ".join(" and ".join(f"`{key}`" for key in group) for group in ways.groups)
            lines.append(f"Give the {ways.thing} one way: {marked}.\n")
        rows = [
            (f"`{key.name}`", key.unit, key.allowed, key.default, key.meaning.replace("|", "\\|"))
            for key in reference.listed(name)
        ]
        lines += [*table(("key", "unit", "value", "default", "meaning"), rows), ""]
    return "\n".join(lines)


def files() -> dict[Path, str]:
    """Return the text of each file."""
    schema = json.dumps(reference.schema(), indent=1, ensure_ascii=False)
    return {DOCS / "scene.md": page(), DOCS / "scene.schema.json": f"{schema}\n"}


if __name__ == "__main__":
    for path, text in files().items():
        path.write_text(text, encoding="utf-8")
