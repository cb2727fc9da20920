"""The ``springbeam`` command: one module per group of commands.

A command is a thin function: it reads its input, calls the library, prints.
Exit codes: 0 done, 1 a check failed, 2 bad input, 3 the run stopped early (what was computed is on disk).
"""

from __future__ import annotations

from importlib import metadata
from typing import Annotated

import typer

from . import checks, doctor, report, resume, run, scenes, stability, sweep, tradeoff

app = typer.Typer(
    help="A Timoshenko beam that strikes a Duffing spring above a rigid foundation: co-simulation of two FMUs.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def main() -> None:
    """Entry point of the console script."""
    app()


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"springbeam {version()}")
        raise typer.Exit


def version() -> str:
    """Version of the installed package."""
    try:
        return metadata.version("springbeam")
    except metadata.PackageNotFoundError:
        return "(not installed)"


@app.callback()
def _common(
    show_version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    pass


for module in (run, resume, scenes, checks, tradeoff, report, sweep, doctor, stability):
    module.register(app)
