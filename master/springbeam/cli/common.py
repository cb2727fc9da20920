"""What the commands share: arguments, exit codes, errors.

Results go to stdout, progress and errors to stderr.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, Any, NoReturn

import typer

from ..checkpoint import CheckpointRefused
from ..fmu import FmuError
from ..recording import ResultsExist, ResultsInUse, ResultsUnreadable
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
    except (SceneError, FmuError, CheckpointRefused, ResultsInUse, ResultsUnreadable) as error:
        fail(BAD_INPUT, str(error))
    except OSError as error:
        fail(BAD_INPUT, f"{error.filename or 'results'}: {error.strerror or error}")


@contextmanager
def interruptible() -> Iterator[None]:
    """Ctrl-C, and SIGTERM, which batch systems send, end the command with exit code 3."""
    main_thread = threading.current_thread() is threading.main_thread()
    before = signal.signal(signal.SIGTERM, _interrupt) if main_thread else None
    try:
        yield
    except KeyboardInterrupt:
        fail(STOPPED, "interrupted")
    finally:
        if main_thread:
            signal.signal(signal.SIGTERM, before)


def _interrupt(*_: Any) -> NoReturn:
    raise KeyboardInterrupt


def fail(code: int, message: str) -> NoReturn:
    typer.echo(f"error: {message}", err=True)
    raise typer.Exit(code)
