"""A Timoshenko beam that strikes a Duffing spring above a rigid foundation: co-simulation of two FMUs."""

from .runner import RunStopped, simulate
from .scene import Scene, SceneError, load_scene
from .trajectory import Event, Trajectory

__all__ = ["Event", "RunStopped", "Scene", "SceneError", "Trajectory", "load_scene", "simulate"]
