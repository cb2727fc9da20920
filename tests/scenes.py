"""Scenes of tests: `soft` with changes; and scenes in units of their own, where what a body does not say is 1."""

from pathlib import Path

from springbeam import scene
from springbeam.scene.files import tomllib
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
    """Return the tables of a scene with what they leave out; of the contact a stiffness of 1e4 and an exponent of 3.

    A beam that is given by its width has all that it needs.
    """
    contact = LAW.kept(CONTACT, LAW.kind(tables.get("contact", {})))
    below = {"beam": scene.Beam.ones(), "spring": scene.Spring.ones(), "contact": contact}
    return {
        name: {**below[name], **content}
        if isinstance(content, dict) and name in below and "width" not in content
        else content
        for name, content in tables.items()
    }


def scene_from_dict(tables):
    """Return the scene of `completed` tables."""
    return scene.scene_from_dict(completed(tables))


def table(name):
    """Return a table of this folder."""
    return tomllib.loads((Path(__file__).parent / name).read_text(encoding="utf-8"))


TABLE = table("scenes.toml")


def without_false(tables):
    """Return tables of the table of scenes, where false takes one out."""
    return {
        key: without_false(value) if isinstance(value, dict) else None if value is False else value
        for key, value in tables.items()
    }


def made(tables):
    """Return the scene of tables; ``of`` names the scene that they change."""
    above = tables.get("of")
    changes = without_false({name: content for name, content in tables.items() if name != "of"})
    return scene_from_dict(changes) if above is None else scene.with_changes(named(above), **changes)


def named(name):
    """Return a scene of the table, one of a group as ``group/name``, or one that is shipped."""
    group, _, member = name.rpartition("/")
    own = TABLE["groups"][group][member] if group else TABLE["scenes"].get(name)
    return scene.load_scene(name) if own is None or own.get("of") == name else made(own)


def group(name):
    """Return the scenes of a group, by their names, but for the one that the others change."""
    return {member: named(f"{name}/{member}") for member in TABLE["groups"][name] if member != "base"}


def load_of(**keys):
    """Return a load of these keys."""
    return SIGNALS[keys.get("signal", "constant")](**keys)


def kinds(trajectory):
    """Return the kinds of its events."""
    return [event.kind for event in trajectory.events]
