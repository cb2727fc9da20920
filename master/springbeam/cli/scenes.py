"""``springbeam scenes``."""

from __future__ import annotations

from rich.table import Table
from rich.text import Text

from ..scene import load_scene, shipped_scenes
from .common import JsonOption, bad_input_reported, console_for, print_json


def scenes(as_json: JsonOption = False) -> None:
    """List the scenes that come with the package.

    Example: springbeam scenes
    """
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("scene", no_wrap=True)
    table.add_column("contains", no_wrap=True)
    table.add_column(Text("t_end [s]"), justify="right", no_wrap=True)
    table.add_column("title")
    listed = []
    with bad_input_reported():
        for name, path in shipped_scenes().items():
            scene = load_scene(path)
            parts = {"beam": scene.beam, "spring": scene.spring, "stop": scene.stop}
            contents = [part for part, there in parts.items() if there is not None]
            table.add_row(name, ", ".join(contents), f"{scene.time.t_end:g}", Text(scene.title))
            listed.append({
                "name": name, "contains": contents, "t_end": scene.time.t_end, "title": scene.title, "file": path
            })  # fmt: skip
    if as_json:
        print_json(listed)
    console = console_for(silent=as_json)
    console.print(table)
    console.print(Text(f"\nfiles: {path.parent}"), soft_wrap=True)
