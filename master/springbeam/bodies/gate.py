"""Refuse bodies that a scene cannot be run with, whoever made them: our FMUs, FMUs of others, bodies of the caller's.

The rules of the scene see what its keys tell. This gate asks the bodies themselves, once, before the first step.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf

from ..scene import Scene, SceneError
from .abilities import Abilities, refusals
from .protocol import Body

#: Velocities closer than this share are one where an end takes no impulse: told, and measured from displacements.
_SAME_SPEED, _SAME_SPEED_MEASURED = 1e-13, 1e-6
#: Heights closer than this share are one.
_SAME_PLACE = 1e-12


def admit(scene: Scene, start_time: float, upper: Body | None, lower: Body | None) -> None:
    """Raise SceneError if ``scene`` cannot be run with these bodies as they are at ``start_time`` [s].

    That is where it needs what a body cannot do, or where the bodies start in places or with velocities from which the
    contact law, the foundation or an undeformed approach cannot begin.
    """
    bodies = {name: body for name, body in (("beam", upper), ("spring", lower)) if body is not None}
    if lines := refusals(scene, {table: _abilities(body) for table, body in bodies.items()}):
        raise SceneError("\n".join(lines))
    if not bodies:
        return
    end = lower or upper
    assert end is not None
    if scene.stop is not None:
        w, table = end.motion().displacement, "beam" if lower is None else "spring"
        found = scene.static and lower is None  # held up by the stop
        if not found and scene.stop.position - w > _SAME_PLACE * max(abs(w), abs(scene.stop.position)):
            raise SceneError(
                f"[stop] position = {scene.stop.position:g}: the body in [{table}] starts below the foundation, at "
                f"{w:.9g} m; it must start there or above"
            )
    if upper is not None and lower is not None:
        _refuse_start(scene, start_time, upper, lower)


def _abilities(body: Body) -> Abilities:
    """Return what ``body`` can do; one that leaves `Body.apply_impulse` out takes no impulses."""
    takes = getattr(body.apply_impulse, "__func__", None) is not Body.apply_impulse
    return body.abilities if takes else replace(body.abilities, impulse=False)


def _refuse_start(scene: Scene, start_time: float, upper: Body, lower: Body) -> None:
    """Raise SceneError if the ends cannot start where they do."""
    (u, v, *_), (y, z, *_) = upper.motion(), lower.motion()
    # An undeformed tip has come down by v t, which rounds.
    apart = not scene.static and abs(u - y) > _SAME_PLACE * max(abs(u), abs(y), start_time * abs(v))
    contact, starts = scene.contact, f"the upper end starts at {u:.9g} m and the lower one at {y:.9g} m"
    if contact.lasting and contact.rigid:
        if apart:
            raise SceneError(f'[contact] law = "{contact.law}": {starts}; let them start at one height, or use "link"')
        _refuse_speeds(scene, upper, lower)
    if contact.lasting:
        return
    if contact.rigid and contact.impact == "tip" and lower.mass == inf:
        raise SceneError(
            '[contact] impact = "tip": gives the lower body the velocity of the tip, and the body in [spring] has an '
            'infinite mass; use impact = "inelastic"'
        )
    if start_time > 0.0 and z != 0.0:
        raise SceneError(
            f'[beam] approach = "undeformed": the body in [spring] starts with {z:.6g} m/s, but nothing moves until '
            f'the tip arrives at t = {start_time:.6g} s; let it start at rest, or use approach = "elastic"'
        )
    if apart and u < y:
        raise SceneError(f"[beam]: {starts}; it must start there or above")
    if apart and scene.beam is not None and scene.beam.approach == "undeformed":
        raise SceneError(
            f'[beam] approach = "undeformed": {starts}, and where the body below is when they meet is not known '
            'beforehand; use approach = "elastic", or let them start at one height'
        )


def _refuse_speeds(scene: Scene, upper: Body, lower: Body) -> None:
    """Raise SceneError if ends that are to be tied start with two velocities, and one takes no impulse."""
    v, z = upper.motion().velocity, lower.motion().velocity
    for table, body, other in (("beam", upper, lower), ("spring", lower, upper)):
        abilities = _abilities(body)
        if abilities.impulse:
            continue
        same = _SAME_SPEED if abilities.velocity else _SAME_SPEED_MEASURED
        if abs(v - z) > same * max(abs(v), abs(z)):
            raise SceneError(
                f'[contact] law = "{scene.contact.law}": the ends start with {v:.6g} and {z:.6g} m/s and are joined by '
                f"an impulse, which the body in [{table}] does not take; give it one (impulse of an FMU, apply_impulse "
                'of a body of your own), let both start with one velocity, or use "link"'
            )
        body.join(other.motion().velocity)
