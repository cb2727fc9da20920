"""Scenes that the references are tested with, and what their exact solutions need of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from springbeam.monolithic.semi_discrete import assemble
from springbeam.results.trajectory import Trajectory
from springbeam.scene import Scene, load_scene, with_changes


def soft(n_elements: int = 6, **tables: Any) -> Scene:
    """The scene `soft` on a coarser beam, with changes."""
    tables["beam"] = {"n_elements": n_elements, **tables.get("beam", {})}
    tables.setdefault("coupling", {"macro_step": 1e-3})
    return with_changes(load_scene("soft"), **tables)


def linear(**tables: Any) -> Scene:
    """Return the scene of `soft` with a linear spring."""
    return soft(**{**tables, "spring": {"cubic_stiffness": 0.0, **tables.get("spring", {})}})


def kinds(trajectory: Trajectory) -> list[str]:
    return [event.kind for event in trajectory.events]


def matrices(scene: Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return M and K of the beam, and u = x, θ = 0."""
    assert scene.beam is not None
    mesh = assemble(scene.beam)
    return mesh.M.toarray(), mesh.K.toarray(), mesh.slope_shape


def tip_mass(scene: Scene) -> float:
    """Return what a tip impulse meets [kg]."""
    return float(1.0 / np.linalg.inv(matrices(scene)[0])[-1, -1])
