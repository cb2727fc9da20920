"""Scenes of tests, in units of their own: what a body does not say is 1, a stiffness of contact 1e4, its exponent 3."""

from __future__ import annotations

from typing import Any

from springbeam import scene

CONTACT = {"stiffness": 1.0e4, "exponent": 3.0}


def completed(tables: dict[str, Any]) -> dict[str, Any]:
    """Return the tables of a scene with what they leave out."""
    below = {"beam": scene.Beam.ones(), "spring": scene.Spring.ones(), "contact": CONTACT}
    return {
        name: {**below[name], **content} if name in below and isinstance(content, dict) else content
        for name, content in tables.items()
    }


def scene_from_dict(tables: dict[str, Any]) -> scene.Scene:
    """Return the scene of `completed` tables."""
    return scene.scene_from_dict(completed(tables))
