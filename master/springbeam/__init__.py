"""A Timoshenko beam that strikes a Duffing spring above a rigid foundation: co-simulation of two FMUs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .lazily import attached

if TYPE_CHECKING:
    __version__: str
    from .api import RunStopped, Simulation, Trajectory, load, simulate
    from .bodies.elements import PointMass, RigidWall, SpringDamper
    from .bodies.protocol import Body, Energies, Motion
    from .motion.events import Event
    from .scene import Scene, SceneError, load_scene, with_changes
else:
    __getattr__ = attached(
        __name__,
        {
            "api": ("RunStopped", "Simulation", "Trajectory", "load", "simulate"),
            "bodies.elements": ("PointMass", "RigidWall", "SpringDamper"),
            "bodies.protocol": ("Body", "Energies", "Motion"),
            "motion.events": ("Event",),
            "scene": ("Scene", "SceneError", "load_scene", "with_changes"),
            "version": ("__version__",),
        },
    )

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


def __dir__() -> list[str]:
    return __all__
