"""A Timoshenko beam that strikes a Duffing spring above a rigid foundation: co-simulation of two FMUs."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .api import simulate
    from .results.trajectory import Event, Trajectory
    from .run.outcome import RunStopped
    from .run.runner import resume
    from .scene import Scene, SceneError, load_scene, with_changes

__all__ = [
    "Event",
    "RunStopped",
    "Scene",
    "SceneError",
    "Trajectory",
    "load_scene",
    "resume",
    "simulate",
    "with_changes",
]

_HOME = {
    "Event": "results.trajectory",
    "RunStopped": "run.outcome",
    "Scene": "scene",
    "SceneError": "scene",
    "Trajectory": "results.trajectory",
    "load_scene": "scene",
    "resume": "run.runner",
    "simulate": "api",
    "with_changes": "scene",
}


def __getattr__(name: str) -> Any:
    # FMPy and scipy take a second to load: only for what needs them.
    if name in _HOME:
        return getattr(import_module(f".{_HOME[name]}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
