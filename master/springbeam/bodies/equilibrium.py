"""Where ends rest when a run starts under loads, and the force between them."""

from __future__ import annotations

from math import inf

from ..scene import Beam, Scene, SceneError
from ..scene.energies import hilltop
from ..scene.partners import RigidWallElement, SpringDamperElement
from ..scene.statics import mesh_compliance, resting_height


def contact_at_rest(scene: Scene, free: float) -> float:
    """Return the contact force C [N] under which the bodies of ``scene`` start at rest; 0 if they do not touch.

    The upper end is linear, u = u₀ + c C, with u₀ = ``free`` [m] and the c of its mesh; C satisfies the law, or closes
    the gap of a rigid one. Raises SceneError if the spring has no equilibrium.
    """
    if scene.lower is None and scene.stop is None:
        return 0.0
    deep = _top(scene, 0.0) - free
    if deep == 0.0 or (deep < 0.0 and not scene.contact.lasting):
        return 0.0
    from scipy.optimize import brentq  # takes a tenth of a second to load: only for ends that touch at rest

    law = scene.soft_law
    compliance = 0.0  # of a wall
    if isinstance(scene.upper, Beam):
        compliance = mesh_compliance(scene.upper)
    elif isinstance(scene.upper, SpringDamperElement):
        compliance = 1.0 / scene.upper.stiffness
    # The force that closes the gap to a rigid lower end; for a wall above any force will do.
    scale = deep / (compliance or 1.0)

    def too_small(contact: float) -> float:
        p = _top(scene, contact) - free - compliance * contact
        return p if law is None else law.force(p) - contact

    while too_small(scale) * deep > 0.0:
        scale *= 2.0
    contact: float = brentq(too_small, 0.0, scale, xtol=1e-300, rtol=1e-15)
    return contact


def lower_at_rest(scene: Scene, contact_force: float, tip: float | None) -> float:
    """Return the height [m] at which the lower end starts under ``contact_force`` [N].

    A rigid law holds it at the ``tip`` [m], unless a stop does at its own height. Raises SceneError if the spring has
    no equilibrium.
    """
    top = _top(scene, contact_force)
    on_stop = scene.stop is not None and top == scene.stop.position
    return top if tip is None or contact_force == 0.0 or on_stop or not scene.contact.rigid else tip


def _top(scene: Scene, contact_force: float) -> float:
    """Return the equilibrium [m] of the lower end under ``contact_force`` [N]: of a spring, a wall or a stop.

    A spring that would rest below the stop rests on it. Raises SceneError if the spring has no equilibrium.
    """
    floor = -inf if scene.stop is None else scene.stop.position
    if isinstance(scene.lower, SpringDamperElement):
        return max(element_at_rest(scene, scene.lower, -contact_force), floor)
    if (spring := scene.spring) is None:
        return scene.lower.position if isinstance(scene.lower, RigidWallElement) else floor
    load = _load_at_start(scene, "spring", spring.mass) - contact_force
    force = spring.external_force + load
    height = resting_height(spring, force)
    if scene.stop is not None and (height is None or height < floor) and spring.force(floor) > load:
        if spring.softens and abs(floor - spring.unloaded) > hilltop(spring):
            raise SceneError(
                f'[time] initial_state = "static": under {force:.6g} N the softening spring would rest on [stop] '
                f"position = {floor:g}, beyond |y - unloaded| = √(linear_stiffness/|cubic_stiffness|) = "
                f"{hilltop(spring):.6g} m, where it cannot start; use a smaller load, or leave initial_state out"
            )
        return floor
    if height is None:
        raise SceneError(
            f'[time] initial_state = "static": no equilibrium of the spring under {force:.6g} N; use a stiffer one, '
            "or a smaller load"
        )
    return height


def element_at_rest(scene: Scene, body: SpringDamperElement, force: float) -> float:
    """Return the equilibrium [m] of a mass on a linear spring under its loads and an upward ``force`` [N]."""
    force += body.external_force + _load_at_start(scene, "tip" if body is scene.upper else "spring", body.mass)
    return body.rest + force / body.stiffness


def _load_at_start(scene: Scene, end: str, mass: float) -> float:
    """Return the upward force [N] of the loads at t = 0 on an ``end`` with a mass."""
    shares = {end: 1.0, "base": -mass}
    return sum(shares.get(load.on, 0.0) * float(load.value(0.0)) for load in scene.loads)
