"""A Timoshenko beam that strikes a Duffing spring above a rigid foundation: co-simulation of two FMUs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .lazily import attached

if TYPE_CHECKING:
    __version__: str
    from .api import Check, RunStopped, Simulation, Trajectory, check, load, simulate
    from .api_studies import converge, crosscheck, fit, sweep
    from .bodies.elements import MovingWall, PointMass, RigidWall, SpringDamper
    from .bodies.protocol import Body, Energies, Motion
    from .motion.events import Event
    from .scene import Beam, Contact, Scene, SceneError, Spring, Stop, load_scene, with_changes
    from .scene.function_load import FunctionLoad
    from .scene.laws import SoftLaw
else:
    __getattr__ = attached(
        __name__,
        {
            "api": ("Check", "RunStopped", "Simulation", "Trajectory", "check", "load", "simulate"),
            "api_studies": ("converge", "crosscheck", "fit", "sweep"),
            "bodies.elements": ("MovingWall", "PointMass", "RigidWall", "SpringDamper"),
            "bodies.protocol": ("Body", "Energies", "Motion"),
            "motion.events": ("Event",),
            "scene": ("Beam", "Contact", "Scene", "SceneError", "Spring", "Stop", "load_scene", "with_changes"),
            "scene.laws": ("SoftLaw",),
            "scene.function_load": ("FunctionLoad",),
            "version": ("__version__",),
        },
    )

__all__ = [
    "Beam",
    "Body",
    "Check",
    "Contact",
    "Energies",
    "Event",
    "FunctionLoad",
    "Motion",
    "MovingWall",
    "PointMass",
    "RigidWall",
    "RunStopped",
    "Scene",
    "SceneError",
    "Simulation",
    "SoftLaw",
    "Spring",
    "SpringDamper",
    "Stop",
    "Trajectory",
    "__version__",
    "check",
    "converge",
    "crosscheck",
    "fit",
    "load",
    "load_scene",
    "simulate",
    "sweep",
    "with_changes",
]


def __dir__() -> list[str]:
    return __all__
