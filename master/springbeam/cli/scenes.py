"""``springbeam scenes``."""

from __future__ import annotations

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..scene import load_scene, shipped_scenes
from .common import bad_input_reported


def register(app: typer.Typer) -> None:
    app.command()(scenes)


def scenes() -> None:
    """List the scenes that come with the package."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("scene", no_wrap=True)
    table.add_column("contains", no_wrap=True)
    table.add_column(Text("t_end [s]"), justify="right", no_wrap=True)
    table.add_column("title")
    with bad_input_reported():
        for name, path in shipped_scenes().items():
            scene = load_scene(path)
            parts = {"beam": scene.beam, "spring": scene.spring, "stop": scene.stop}
            contents = ", ".join(part for part, there in parts.items() if there is not None)
            table.add_row(name, contents, f"{scene.time.t_end:g}", Text(scene.title))
    Console(highlight=False).print(table)
