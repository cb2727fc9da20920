"""Scenes: files, their keys, and values that follow from them before anything is built or loaded.

Imports nothing else of the package. Modules, from below: ``tables`` (the keys), ``laws``, ``loads`` and ``schemes``
(those of ``[contact]``, ``[[loads]]`` and ``[coupling]``; ``recorded`` reads the file of a load) → ``scene`` (all
tables) → ``messages`` (errors in words): these load numpy when they compute. ``statics`` → ``energies``,
``frequencies`` → ``plausibility`` (warnings), ``rules`` (errors) → ``reading`` (files, overrides; start here).
``files`` reads TOML; ``shipped/`` has the scenes that come with the package.
"""

from typing import TYPE_CHECKING

from ..lazily import attached

if TYPE_CHECKING:
    from .files import parse_value, shipped_scenes
    from .laws import Contact
    from .loads import Load
    from .messages import key_kind, scene_keys
    from .reading import as_scene, load_scene, scene_from_dict, with_changes
    from .scene import SAME, Scene
    from .tables import ArgumentError, Beam, SceneError, Spring, Stop, Time
else:
    __getattr__ = attached(
        __name__,
        {
            "files": ("parse_value", "shipped_scenes"),
            "laws": ("Contact",),
            "loads": ("Load",),
            "messages": ("key_kind", "scene_keys"),
            "reading": ("as_scene", "load_scene", "scene_from_dict", "with_changes"),
            "scene": ("SAME", "Scene"),
            "tables": ("ArgumentError", "Beam", "SceneError", "Spring", "Stop", "Time"),
        },
    )

__all__ = [
    "SAME",
    "ArgumentError",
    "Beam",
    "Contact",
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
    "with_changes",
]
