"""A Timoshenko beam that strikes a Duffing spring above a rigid foundation: co-simulation of two FMUs."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__: str

if TYPE_CHECKING:
    from .api import RunStopped, Simulation, Trajectory, load, simulate
    from .bodies.elements import PointMass, RigidWall, SpringDamper
    from .bodies.protocol import Body, Energies, Motion
    from .results.trajectory import Event
    from .scene import Scene, SceneError, load_scene, with_changes

__all__ = [
    "Body",
    "Energies",
    "Event",
    "Motion",
    "PointMass",
    "RigidWall",
    "RunStopped",
    "Scene",
    "SceneError",
    "Simulation",
    "SpringDamper",
    "Trajectory",
    "__version__",
    "load",
    "load_scene",
    "simulate",
    "with_changes",
]

_HOME = {
    name: home
    for home, names in {
        "api": ("RunStopped", "Simulation", "Trajectory", "load", "simulate"),
        "bodies.elements": ("PointMass", "RigidWall", "SpringDamper"),
        "bodies.protocol": ("Body", "Energies", "Motion"),
        "results.trajectory": ("Event",),
        "scene": ("Scene", "SceneError", "load_scene", "with_changes"),
    }.items()
    for name in names
}


def __getattr__(name: str) -> Any:
    # FMPy and scipy take a second to load: only for what needs them.
    if name in _HOME:
        return getattr(import_module(f".{_HOME[name]}", __name__), name)
    if name == "__version__":
        from importlib.metadata import version

        globals()[name] = found = version("springbeam")
        return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
