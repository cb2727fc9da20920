"""Refuse bodies that a scene cannot be run with, whoever made them: our FMUs, FMUs of others, bodies of the caller's.

The rules of the scene see what its keys tell. This gate asks the bodies themselves, once, before the first step.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf
from typing import Any, NamedTuple

from ..scene import Scene, SceneError
from ..scene.messages import Rule, told
from .abilities import Abilities, refusals
from .protocol import Body

#: Velocities closer than this share are one where an end takes no impulse: told, and measured from displacements.
_SAME_SPEED, _SAME_SPEED_MEASURED = 1e-13, 1e-6
#: Heights closer than this share are one.
_SAME_PLACE = 1e-12


class Start(NamedTuple):
    """How the ends of two bodies start."""

    time: float  #: [s]
    u: float  #: height of the upper end [m]
    y: float  #: height of the lower end [m]
    z: float  #: velocity of the lower end [m/s]
    mass: float  #: of the lower end [kg]
    apart: bool  #: whether more than rounding is between them


def _numbers(scene: Scene, start: Start) -> dict[str, Any]:
    return start._asdict()


_ENDS = "the upper end starts at {u:.9g} m and the lower one at {y:.9g} m"
#: How ends cannot start; a rule is asked of the scene and the `Start`.
FORBIDDEN_STARTS = (
    Rule(
        lambda s, start: s.contact.lasting and s.contact.rigid and start.apart,
        f'{{contact.law}}: {_ENDS}; let them start at one height, or use "link"',
        _numbers,
    ),
    Rule(
        lambda s, start: s.contact.facts.strikes and s.contact.impact == "tip" and start.mass == inf,
        "{contact.impact}: gives the lower body the velocity of the tip, and the body in [spring] has an infinite "
        'mass; use impact = "inelastic"',
    ),
    Rule(
        lambda s, start: not s.contact.lasting and start.time > 0.0 and start.z != 0.0,
        "{beam.approach}: the body in [spring] starts with {z:.6g} m/s, but nothing moves until the tip arrives at "
        't = {time:.6g} s; let it start at rest, or use approach = "elastic"',
        _numbers,
    ),
    Rule(
        lambda s, start: not s.contact.lasting and start.apart and start.u < start.y,
        f"[beam]: {_ENDS}; it must start there or above",
        _numbers,
    ),
    Rule(
        lambda s, start: (
            not s.contact.lasting
            and start.apart
            and start.u > start.y
            and s.beam is not None
            and s.beam.approach == "undeformed"
        ),
        f"{{beam.approach}}: {_ENDS}, and where the body below is when they meet is not known beforehand; use "
        'approach = "elastic", or let them start at one height',
        _numbers,
    ),
)


def admit(scene: Scene, start_time: float, upper: Body | None, lower: Body | None) -> None:
    """Raise SceneError if ``scene`` cannot be run with these bodies as they are at ``start_time`` [s].

    That is where it needs what a body cannot do, or where the bodies start in places or with velocities from which the
    contact law, the foundation or an undeformed approach cannot begin.
    """
    bodies = {name: body for name, body in (("beam", upper), ("spring", lower)) if body is not None}
    lines = refusals(scene, {table: _abilities(body) for table, body in bodies.items()})
    if scene.stop is not None and (bodies.keys() & {"spring"} or not scene.static):  # else the stop holds the tip up
        table, end = list(bodies.items())[-1]
        w, floor = end.motion().displacement, scene.stop.position
        if floor - w > _SAME_PLACE * max(abs(w), abs(floor)):
            lines.append(
                f"[stop] position = {floor:g}: the body in [{table}] starts below the foundation, at {w:.9g} m; "
                "it must start there or above"
            )
    if upper is not None and lower is not None and not lines:
        (u, v, *_), (y, z, *_) = upper.motion(), lower.motion()
        # An undeformed tip has come down by v t, which rounds.
        apart = not scene.static and abs(u - y) > _SAME_PLACE * max(abs(u), abs(y), start_time * abs(v))
        lines += told(scene, FORBIDDEN_STARTS, Start(start_time, u, y, z, lower.mass, apart))
        if scene.contact.lasting and scene.contact.rigid:
            lines += _joined(scene, upper, lower)
    if lines:
        raise SceneError("\n".join(lines))


def _abilities(body: Body) -> Abilities:
    """Return what ``body`` can do; one that leaves `Body.apply_impulse` out takes no impulses."""
    takes = getattr(body.apply_impulse, "__func__", None) is not Body.apply_impulse
    return body.abilities if takes else replace(body.abilities, impulse=False)


def _joined(scene: Scene, upper: Body, lower: Body) -> list[str]:
    """Join ends that are to be tied, where one takes no impulse; return why, if their velocities forbid it."""
    v, z, lines = upper.motion().velocity, lower.motion().velocity, []
    for table, body, other in (("beam", upper, lower), ("spring", lower, upper)):
        if (abilities := _abilities(body)).impulse:
            continue
        if abs(v - z) > (_SAME_SPEED if abilities.velocity else _SAME_SPEED_MEASURED) * max(abs(v), abs(z)):
            lines.append(
                f'[contact] law = "{scene.contact.law}": the ends start with {v:.6g} and {z:.6g} m/s and are joined by '
                f"an impulse, which the body in [{table}] does not take; give it one (impulse of an FMU, apply_impulse "
                'of a body of your own), let both start with one velocity, or use "link"'
            )
        body.join(other.motion().velocity)
    return lines
