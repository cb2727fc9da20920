"""Writes lists that the package has into the pages, such as commands and results: python docs/lists.py"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pathlib import Path

from pages import DOCS, table, with_section  # beside this script

from springbeam import Body, cli, load_scene
from springbeam.contact.phases import TRANSITIONS
from springbeam.pictures.drawing import GLOSSARY
from springbeam.results.totals import LOSS_NAMES, TOTALS
from springbeam.results.trajectory import BODY_COLUMNS, COLUMNS
from springbeam.scene import shipped_scenes


def scenes() -> list[str]:
    return table(("scene", "title"), [(f"`{name}`", str(load_scene(name).title)) for name in shipped_scenes()])


def commands() -> list[str]:
    made = {name: make() for name, make in cli.common.Commands.makers.items()}
    rows = [(f"`{name}`", command.help.split("\n\n")[0].replace("\n", " ")) for name, command in made.items()]
    return table(("command", ""), rows)


def options() -> list[str]:
    rows = []
    for option in cli.common.Commands.makers["run"]().params:
        if option.opts[0].startswith("-"):
            name = " ".join(filter(None, (option.opts[0], option.metavar)))
            rows.append((", ".join(f"`{word}`" for word in (name, *option.opts[1:])), option.help.replace("\\[", "[")))
    return table(("option of `run`", "meaning, the same in all commands that have it"), rows)


def columns() -> list[str]:
    return table(
        ("column", "unit", ""),
        [(f"`{name}`", column.unit or "–", column.words) for name, column in (COLUMNS | BODY_COLUMNS).items()],
    )


def body() -> list[str]:
    rows = []
    for name in MEMBERS:
        member = getattr(Body, name)
        arguments = ", ".join(list(inspect.signature(member).parameters)[1:])
        said = inspect.cleandoc(member.__doc__).replace("``", "`").split("\n\n")[0].replace("\n", " ")
        rows.append((f"`{name}({arguments})`", said))
    return table(("method", ""), rows)


def results() -> list[str]:
    rows = [(f"`{key}`", quantity.unit or "–", quantity.words) for key, quantity in TOTALS.items()]
    rows += [(f"`{key}`", "J", f"energy lost by {words}") for key, words in LOSS_NAMES.items()]
    return table(("key", "unit", ""), rows)


def words() -> list[str]:
    return table(("word", "meaning"), [(name.replace("_", " "), meaning) for name, meaning in GLOSSARY.items()])


def phases() -> list[str]:
    rows = []
    seats: dict[tuple[bool, ...], list[str]] = {(True,): ["*seated*"], (False,): ["not *seated*"]}
    for row in TRANSITIONS:
        seat = seats.get(row.seated, [])
        phase = ", ".join([*([] if row.joint is None else [f"*{row.joint}*"]), *seat])
        said = [" ".join((part.__doc__ or "").split()).rstrip(".") for part in (row.guard, row.effect)]
        rows.append((row.where.__doc__, phase, said[0], f"`{row.kind}`", said[1]))
    return table(("where", "phase", "lasts while", "else", "what happens, and the next phase"), rows)


#: Methods of a body of one's own, the needed ones first.
MEMBERS = (
    *("advance", "motion", "mark", "rewind", "apply_impulse", "holding_force", "energies", "stiffness"),
    *("take_place", "expect_loads", "set_loads", "load_on_end"),
)

#: By page: the blocks and what makes their lines.
BLOCKS: dict[Path, dict[str, Callable[[], list[str]]]] = {
    DOCS.parent / "README.md": {"scenes": scenes},
    DOCS / "api.md": {"body": body},
    DOCS / "commands.md": {"commands": commands, "options": options},
    DOCS / "files.md": {"columns": columns, "results": results},
    DOCS / "model.md": {"phases": phases, "words": words},
}


def files() -> dict[Path, str]:
    """Return the text of each page."""
    found = {}
    for path, blocks in BLOCKS.items():
        text = path.read_text(encoding="utf-8")
        for name, lines in blocks.items():
            text = with_section(text, name, lines())
        found[path] = text
    return found


if __name__ == "__main__":
    for path, text in files().items():
        path.write_text(text, encoding="utf-8")
