"""The force between ends that are at rest when a run starts."""

from __future__ import annotations

from contextlib import closing

from ..scene import Scene
from ..scene.laws import SoftLaw
from ..scene.partners import SpringDamperElement
from ..scene.statics import tip_compliance
from .factory import load_bodies, top_at_rest


def contact_at_rest(scene: Scene, degree: int, law: SoftLaw | None) -> float:
    """Return the contact force C [N] under which the bodies of ``scene`` start at rest; 0 if they do not touch.

    The upper end is linear, u = u₀ + c C with the c of its mesh; C satisfies the law, or closes the gap of a rigid one.

    Parameters
    ----------
    scene, degree
        As of `load_bodies`.
    law
        That between the ends, if it is soft.

    Raises SceneError if the spring has no equilibrium, FmuError.
    """
    if not scene.static or scene.upper is None or (scene.lower is None and scene.stop is None):
        return 0.0
    from scipy.optimize import brentq  # takes a tenth of a second to load: only for a start at rest

    free = _tip(scene, degree, 0.0)
    deep = top_at_rest(scene, 0.0) - free
    if deep == 0.0 or (deep < 0.0 and not scene.contact.lasting):
        return 0.0
    # The force that closes the gap to a rigid lower end; for a wall above any force will do.
    scale = deep
    if scene.beam is not None:
        scale /= tip_compliance(scene.beam)
    elif isinstance(scene.upper, SpringDamperElement):
        scale *= scene.upper.stiffness
    compliance = (_tip(scene, degree, scale) - free) / scale

    def too_small(contact: float) -> float:
        p = top_at_rest(scene, contact) - free - compliance * contact
        return p if law is None else law.force(p) - contact

    while too_small(scale) * deep > 0.0:
        scale *= 2.0
    found: float = brentq(too_small, 0.0, scale, xtol=1e-300, rtol=1e-15)
    return found


def _tip(scene: Scene, degree: int, contact: float) -> float:
    upper, _ = load_bodies(scene.model_copy(update={"lower": None}), 0.0, degree, contact)
    assert upper is not None
    with closing(upper):
        return upper.motion().displacement
