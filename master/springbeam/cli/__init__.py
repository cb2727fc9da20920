"""The ``springbeam`` command: one module per group of commands.

A command is a thin function: it reads its input, calls the library, prints. Modules are loaded only when a command
needs them, so that it starts fast; ``--help`` loads those of all commands. Exit codes: 0 success, 1 a check failed,
2 bad input, 3 the run stopped early (results so far are on disk), 4 a run cannot be compared (`crosscheck`).
"""

from __future__ import annotations

import errno
import gc
import os
import sys
import textwrap
from functools import partial
from importlib import import_module
from io import TextIOWrapper
from typing import Annotated, Any

# Typer uses pydantic, which would search all installed packages for plugins.
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
# On matrices as small as ours, several threads of BLAS mostly wait for each other.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import typer

from .common import STOPPED, Command, Commands

_WHAT = "A Timoshenko beam that strikes a Duffing spring above a rigid foundation: co-simulation of two FMUs."
_START = """\
springbeam scenes                 list the shipped scenes
springbeam run soft               run one; results go to results/soft
springbeam report results/soft    write an HTML page with a time slider
springbeam crosscheck soft        compare with an independent reference
springbeam doctor                 check the installation"""

#: Errors of a standard output that is a file.
_NO_ROOM = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT, errno.EIO)

app = typer.Typer(
    cls=Commands,
    help=_WHAT,
    epilog="springbeam COMMAND --help shows options and an example; springbeam alone shows how to start.",
    invoke_without_command=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def main() -> None:
    """Run the command; entry point of the console script.

    Modules and a picture are no garbage: to search them took a sixth of a run.
    """
    gc.set_threshold(300_000)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")  # with LANG=C, which has no ω
    try:
        app()
    except OSError as error:
        if error.errno not in _NO_ROOM or error.filename is not None:
            raise
        # The rest of the output that Python buffers would fail again at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        typer.echo(f"error: standard output: {error.strerror}", err=True)
        sys.exit(STOPPED)


def _show_version(wanted: bool) -> None:
    if wanted:
        from ..version import __version__

        typer.echo(f"springbeam {__version__}")
        raise typer.Exit


@app.callback()
def _common(
    ctx: typer.Context,
    show_version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    if ctx.invoked_subcommand is None:
        typer.echo(f"{_WHAT}\n\nTo start:\n\n{textwrap.indent(_START, '  ')}\n")
        typer.echo("springbeam --help lists all commands, springbeam COMMAND --help their options.")


#: Names of commands under the titles of ``--help``, by the module that has their function.
_TITLES: dict[str, dict[str, tuple[str, ...]]] = {
    "Scenes": {"scenes": ("scenes", "keys", "new")},
    "Run": {"run": ("run",), "studies": ("sweep",), "paper": ("paper",)},
    "Look": {"look": ("report", "plot", "animate", "export", "compare", "spectrum"), "studies": ("fit",)},
    "Choose step, accuracy and mesh": {"scenes": ("predict",), "studies": ("tradeoff", "converge")},
    "Check": {"studies": ("crosscheck",), "checks": ("doctor",)},
}


def _made(name: str, module: str, title: str) -> Any:
    """Return a command; this loads its module."""
    alone = typer.Typer(add_completion=False)
    function = getattr(import_module(f".{module}", __name__), name)
    alone.command(cls=Command, rich_help_panel=title)(function)
    return typer.main.get_command(alone)


Commands.makers = {
    name: partial(_made, name, module, title)
    for title, modules in _TITLES.items()
    for module, names in modules.items()
    for name in names
}
