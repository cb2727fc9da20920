"""``springbeam doctor``."""

from __future__ import annotations

import platform
import sys
import zipfile
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

import typer
from rich.console import Console
from rich.text import Text

from ..fmu import FmuBeam, FmuError, FmuSpring, fmu_directory
from ..scene import Beam, Spring
from .common import DISAGREES

_REQUIRED = ("fmpy", "numpy", "scipy", "pydantic", "typer", "rich", "matplotlib", "plotly")
_FOR_SWEEPS = ("distributed", "pyarrow")


def register(app: typer.Typer) -> None:
    app.command()(doctor)


def doctor() -> None:
    """Show versions, and whether the FMUs are found and can be loaded here. Exit code 1 if they cannot."""
    console = Console(highlight=False)
    console.print(Text(f"springbeam  {metadata.version('springbeam')} in {Path(__file__).parents[1]}"), soft_wrap=True)
    console.print(Text(f"Python      {platform.python_version()} ({sys.executable})"), soft_wrap=True)
    console.print(Text(f"system      {platform.platform()}, {platform.machine()}"), soft_wrap=True)
    console.print(Text("packages    " + ", ".join(f"{name} {metadata.version(name)}" for name in _REQUIRED)))
    if absent := [name for name in _FOR_SWEEPS if find_spec(name) is None]:
        console.print(Text(f"sweep       not available: {', '.join(absent)} missing; pip install 'springbeam[sweep]'"))
    else:
        console.print(Text("sweep       " + ", ".join(f"{name} {metadata.version(name)}" for name in _FOR_SWEEPS)))
    healthy = True
    for name in ("beam", "spring"):
        path = fmu_directory() / f"{name}.fmu"
        try:
            (FmuBeam(Beam(), 0.0, 0.0) if name == "beam" else FmuSpring(Spring(), 0.0)).close()
            said = f"loads; binaries for {', '.join(_platforms(path))}"
        except FmuError as error:
            healthy, said = False, f"FAILED: {error}"
        console.print(Text(f"{name + '.fmu':<12}{path}: {said}"), soft_wrap=True)
    if not healthy:
        raise typer.Exit(DISAGREES)


def _platforms(path: Path) -> list[str]:
    with zipfile.ZipFile(path) as archive:
        return sorted({name.split("/")[1] for name in archive.namelist() if name.startswith("binaries/")})
