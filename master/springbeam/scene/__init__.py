"""What is simulated: scene files, their keys, and what follows from them before anything is built or loaded.

Imports nothing else of the package. Floors, from below: ``tables`` (the keys), ``loads`` (those of ``[[loads]]``, and
each load as a function of time; ``recorded`` reads its file) → ``statics`` → ``scene`` (all tables) → ``linearised``
(energies and frequencies), ``messages`` (keys and errors in words) → ``rules`` (errors and warnings) → ``reading``
(files, overrides; start here) → ``resolution`` (are steps short enough, which scheme). ``shipped/`` has the scenes that
come with the package.
"""

from .laws import Contact
from .loads import Load
from .messages import key_kind, scene_keys
from .reading import as_scene, load_scene, parse_value, scene_from_dict, shipped_scenes, with_changes
from .scene import SAME, Scene
from .suspicions import suspicions
from .tables import ArgumentError, Beam, Coupling, SceneError, Spring, Stop, Time

__all__ = [
    "SAME",
    "ArgumentError",
    "Beam",
    "Contact",
    "Coupling",
    "Load",
    "Scene",
    "SceneError",
    "Spring",
    "Stop",
    "Time",
    "as_scene",
    "key_kind",
    "load_scene",
    "parse_value",
    "scene_from_dict",
    "scene_keys",
    "shipped_scenes",
    "suspicions",
    "with_changes",
]
