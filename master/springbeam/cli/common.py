"""What the commands share: arguments, exit codes, errors.

Results go to stdout, progress and errors to stderr.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, NoReturn

import typer

from ..recording import ResultsExist, ResultsUnreadable
from ..scene import SceneError, shipped_scenes

DISAGREES = 1
BAD_INPUT = 2
STOPPED = 3


def complete_scene(incomplete: str) -> list[str]:
    return [name for name in shipped_scenes() if name.startswith(incomplete)]


SceneArgument = Annotated[
    str,
    typer.Argument(
        metavar="SCENE",
        help="A scene file (.toml), or the name of a shipped scene (springbeam scenes lists them).",
        autocompletion=complete_scene,
    ),
]
SettingsOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="TABLE.KEY=VALUE", help="Change a value of the scene; may be repeated."),
]


@contextmanager
def bad_input_reported() -> Iterator[None]:
    try:
        yield
    except ResultsExist as error:
        fail(BAD_INPUT, f"{error}; --force replaces them, --out DIR puts the new ones elsewhere")
    except (SceneError, ResultsUnreadable) as error:
        fail(BAD_INPUT, str(error))
    except OSError as error:
        fail(BAD_INPUT, f"{error.filename or 'results'}: {error.strerror or error}")


def fail(code: int, message: str) -> NoReturn:
    typer.echo(f"error: {message}", err=True)
    raise typer.Exit(code)
