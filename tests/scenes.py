"""Scenes of tests: `soft` with changes; and scenes in units of their own, where what a body does not say is 1."""

from springbeam import scene
from springbeam.scene.laws import LAW
from springbeam.scene.loads import SIGNALS

CONTACT = {"stiffness": 1.0e4, "exponent": 3.0}
SOFT = scene.load_scene("soft")


def soft(n_elements=6, **tables):
    """Return the scene `soft` on a coarser beam, in steps of 1 ms unless ``coupling`` says otherwise, with changes."""
    tables["beam"] = {"n_elements": n_elements, **tables.get("beam", {})}
    tables.setdefault("coupling", {"macro_step": 1e-3})
    return scene.with_changes(SOFT, **tables)


def completed(tables):
    """Return the tables of a scene with what they leave out; of the contact a stiffness of 1e4 and an exponent of 3."""
    contact = LAW.kept(CONTACT, LAW.kind(tables.get("contact", {})))
    below = {"beam": scene.Beam.ones(), "spring": scene.Spring.ones(), "contact": contact}
    return {
        name: {**below[name], **content} if name in below and isinstance(content, dict) else content
        for name, content in tables.items()
    }


def scene_from_dict(tables):
    """Return the scene of `completed` tables."""
    return scene.scene_from_dict(completed(tables))


def load_of(**keys):
    """Return a load of these keys."""
    return SIGNALS[keys.get("signal", "constant")](**keys)


def kinds(trajectory):
    """Return the kinds of its events."""
    return [event.kind for event in trajectory.events]
