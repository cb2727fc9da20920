"""Reject bodies with which a scene cannot be run: our FMUs, FMUs of others, bodies of the caller.

The rules of the scene check its keys. This gate checks the bodies, once, before the first step: their abilities,
initial positions and velocities.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from math import inf
from typing import Any

import numpy as np

from ..scene import SAME, Scene, SceneError
from ..scene.messages import Rule, texts_of
from .protocol import NO_FORCE, Abilities, Body, BodyFailed, Force, StepRefused

# -- abilities ---------------------------------------------------------------------------------------------------------

#: Texts about missing abilities.
_LACKS = {
    "state": "its state cannot be saved (canGetAndSetFMUstate = false)",
    "any_size": "its steps have one size (canHandleVariableCommunicationStepSize = false)",
    "velocity": "it has no velocity",
    "integrals": "its Motion has wrong integrals, or it has not integral and integral_2",
    "impulse": "it has no impulse, or of a body of your own no apply_impulse",
}
_TO_BE_STRUCK = ("state", "any_size", "velocity", "impulse")
_LEFT_OUT, _MULTIPLE = 'leave it out, or use scheme = "energy"', "use a multiple of {coupling.macro_step}"


def _exchanges(scene: Scene) -> bool:
    return scene.coupling.exchanges


def _falls_between(scene: Scene) -> bool:
    """Return whether a load jumps or bends between equal macro steps."""
    H = scene.coupling.H
    start = scene.contact_time or 0.0
    kinks = [t for load in scene.loads if not load.is_finer_than(H) for t in load.kinks]
    steps = [(t - start) / H for t in kinks if start <= t < scene.time.t_end]
    return any(abs(n - round(n)) > SAME for n in steps)


def _followed(scene: Scene, body: Abilities, table: str) -> dict[str, Any]:
    followed = body.slopes if _exchanges(scene) else min(body.integrals, body.slopes)
    return {"table": table, "slopes": body.slopes, "followed": followed}


def _needs(asked: str, when: Callable[[Scene], bool], instead: str, *abilities: str) -> list[Rule]:
    """Return a rule for each of the ``abilities`` that a body must have for the key ``asked``."""
    most = Abilities()
    return [
        Rule(
            lambda s, body, table, ability=ability: when(s) and getattr(body, ability) < getattr(most, ability),
            f"{asked}: the body in [{{table}}] cannot do that, {_LACKS[ability]}; {instead}",
            _followed,
        )
        for ability in abilities
    ]


#: Rules for abilities; arguments are the scene, the abilities of the body, and its table.
LACKING: tuple[Rule, ...] = (
    *_needs(
        "{coupling.scheme}",
        lambda s: not _exchanges(s),
        'use scheme = "jacobi" or "gauss_seidel" with [contact] law = "link" or "compliance", without [stop]',
        "state",
    ),
    *_needs("{coupling.degree}", lambda s: _exchanges(s) and s.degree > 0, _LEFT_OUT, "velocity"),
    *_needs("{contact.damping}", lambda s: _exchanges(s) and s.contact.damped, _LEFT_OUT, "velocity"),
    *_needs(
        "{contact.law}",
        lambda s: s.joins and s.contact.strikes,
        'use "compliance", "link" or "tie"',
        *_TO_BE_STRUCK,
    ),
    *_needs("[stop]", lambda s: s.stop is not None, "leave it out", *_TO_BE_STRUCK),
    *_needs(
        "[coupling] relative_tolerance, absolute_tolerance",
        lambda s: s.coupling.adaptive,
        "use macro_step",
        *("any_size", "velocity", "integrals"),
    ),
    Rule(
        lambda s, body, table: s.degree > body.slopes,
        "{coupling.degree}: the body in [{table}] cannot do that, it follows derivatives of the force of order "
        "{slopes} at most (canInterpolateInputs; FMI 3.0 has none; a body of your own, in advance); use "
        "degree = {followed}",
        _followed,
    ),
    Rule(  # of so many integrals of the gap that the scheme sets to 0
        lambda s, body, table: not _exchanges(s) and s.degree > body.integrals,
        f"{{coupling.degree}}: the body in [{{table}}] cannot do that, {_LACKS['integrals']}; "
        "use degree = {followed}",
        _followed,
    ),
    *_needs("{time.t_end}", lambda s: not s.coupling.adaptive and s.equal_steps[1] != 0.0, _MULTIPLE, "any_size"),
    *_needs(
        "[[loads]]: a step ends where each jumps or bends",
        lambda s: not s.coupling.adaptive and _falls_between(s),
        _MULTIPLE,
        "any_size",
    ),
)


def refusals(scene: Scene, abilities: Mapping[str, Abilities]) -> list[str]:
    """Return why ``scene`` cannot be run with bodies of these ``abilities``, by table, each with a remedy."""
    return [line for table, body in abilities.items() for line in texts_of(scene, LACKING, body, table)]


#: Abilities in words: (ability, how a body shows it, possible couplings with it, and without it).
OFFERED = (
    ("state", "canGetAndSetFMUstate", 'scheme "energy", tie, transmission, foundation', '"jacobi", "gauss_seidel"'),
    ("any_size", "canHandleVariableCommunicationStepSize", "events, adaptive steps", "equal macro steps only"),
    ("slopes", "canInterpolateInputs", "degree 1, 2", "degree 0"),
    ("integrals", "integral, integral_2", "degree 1, 2; adaptive steps", "degree 0"),
    ("velocity", "velocity", "events, adaptive steps, the force at an instant", "the mean over a step in its place"),
    ("impulse", "impulse", "rigid impacts, foundation", '"compliance", "link", "tie" of equal velocities'),
    ("energies", "kinetic_energy, potential_energy", "the whole ledger", "the ledger of the interface"),
)


#: Length of a trial step over a macro step; displacement by a force in it, over that of the body or 1 m.
_TRIAL, _MOVED = 2.0**-8, 1e-6


# -- starts ------------------------------------------------------------------------------------------------------------

#: Velocities closer than this share are equal for an end without impulses: given, and measured from displacements.
_SAME_SPEED, _SAME_SPEED_MEASURED = 1e-13, 1e-6
#: Heights closer than this share are equal.
_SAME_PLACE = 1e-12
_ENDS = "the upper end starts at {u:.9g} m and the lower one at {y:.9g} m"
#: Rules for the start of the ends; arguments are the scene and the positions and velocities of `admit`.
FORBIDDEN_STARTS = (
    Rule(
        lambda s, start: s.contact.lasting and s.contact.rigid and start["apart"],
        f'{{contact.law}}: {_ENDS}; let them start at one height, or use "link"',
        lambda s, start: start,
    ),
    Rule(
        lambda s, start: not s.contact.lasting and start["time"] > 0.0 and start["z"] != 0.0,
        "{beam.approach}: the body in [spring] starts with {z:.6g} m/s, but nothing moves until the tip arrives at "
        't = {time:.6g} s; let it start at rest, or use approach = "elastic"',
        lambda s, start: start,
    ),
    Rule(
        lambda s, start: not s.contact.lasting and start["apart"] and start["u"] < start["y"],
        f"[beam]: {_ENDS}; it must start there or above",
        lambda s, start: start,
    ),
    Rule(
        lambda s, start: (
            not s.contact.lasting
            and start["apart"]
            and start["u"] > start["y"]
            and s.beam is not None
            and s.beam.approach == "undeformed"
        ),
        f"{{beam.approach}}: {_ENDS}, and where the body below is when they meet is not known beforehand; use "
        'approach = "elastic", or let them start at one height',
        lambda s, start: start,
    ),
)


def tried(body: Body, time: float, macro_step: float) -> Abilities:
    """Return the abilities of a ``body`` of the caller, by four short steps from ``time`` [s] that are undone.

    They show whether it follows a force that grows over a step, and returns the integrals of its motion. If it refuses
    them, its declared abilities count.
    """
    able = body.can()
    if not able.state or not 0.0 < body.mass < inf:
        return able
    h = _TRIAL * macro_step if able.any_size else macro_step
    w, v, _, _ = body.motion()
    moved = _MOVED * (max(abs(w), h * abs(v)) or 1.0)
    push = 2.0 * body.mass * moved / (h * h)  # constant, it moves a free mass as far
    forces: list[Force] = [NO_FORCE, (push, 0.0, 0.0), (0.0, push / h, 0.0), (0.0, 0.0, 2.0 * push / h**2)]
    body.mark()
    ends = []
    try:
        for force in forces:
            ends.append(body.advance(time, h, force))
            body.rewind()
    except (BodyFailed, StepRefused, OverflowError):
        body.rewind()
        return able
    alone, *others = np.array(ends)
    held, grown, bent = (np.abs(end - alone) for end in others)
    if held[0] == 0.0:
        return able
    # Of a free mass the responses are 1/3, 1/6 and L h/3, L h²/12: a stiff body's are larger.
    slopes = [grown[0] > held[0] / 6.0, bent[0] > held[0] / 12.0]
    integrals = [held[2] > held[0] * h / 6.0, held[3] > held[0] * h * h / 24.0]
    return replace(
        able,
        slopes=min(able.slopes, [*slopes, False].index(False)),
        integrals=min(able.integrals, [*integrals, False].index(False)),
    )


def admit(
    scene: Scene,
    start_time: float,
    upper: Body | None,
    lower: Body | None,
    found: Mapping[str, Abilities] | None = None,
) -> None:
    """Raise SceneError if ``scene`` cannot be run with these bodies as they are at ``start_time`` [s].

    That is if a body lacks a needed ability, or if the contact law, the foundation or an undeformed approach cannot
    begin from the initial positions and velocities. Abilities ``found``, by table, replace the declared ones.
    """
    bodies = {name: body for name, body in (("beam", upper), ("spring", lower)) if body is not None}
    able = {table: body.can() for table, body in bodies.items()}
    lines = refusals(scene, {**able, **(found or {})})
    lines += [
        f"the body in [{table}]: mass = 0: only an upper end can be without inertia, tied by a rigid law to one that "
        "has some; give it a mass greater than 0 [kg]"
        for table, body in bodies.items()
        if body.massless and (table == "spring" or lower is None or scene.contact.soft)
    ]
    if scene.stop is not None and (bodies.keys() & {"spring"} or not scene.static):  # else the stop holds the tip up
        table, end = list(bodies.items())[-1]
        w = end.motion().displacement
        floor = scene.stop.position
        if floor - w > _SAME_PLACE * max(abs(w), abs(floor)):
            lines.append(
                f"[stop] position = {floor:g}: the body in [{table}] starts below the foundation, at {w:.9g} m; "
                "it must start there or above"
            )
    if upper is not None and lower is not None and not lines:
        (u, v, *_), (y, z, *_) = upper.motion(), lower.motion()
        # An undeformed tip has come down by v t, which rounds.
        apart = not scene.static and abs(u - y) > _SAME_PLACE * max(abs(u), abs(y), start_time * abs(v))
        start = {"time": start_time, "u": u, "y": y, "z": z, "mass": lower.mass, "apart": apart}
        lines += texts_of(scene, FORBIDDEN_STARTS, start)
        if scene.contact.lasting and scene.contact.rigid:
            lines += _joined(scene, upper, lower)
    if lines:
        raise SceneError("\n".join(lines))


def _joined(scene: Scene, upper: Body, lower: Body) -> list[str]:
    """Join ends that are to be tied, if one takes no impulse; return an error if their velocities differ."""
    v = upper.motion().velocity
    z = lower.motion().velocity
    lines = []
    for table, body, other in (("beam", upper, lower), ("spring", lower, upper)):
        if (abilities := body.can()).impulse:
            continue
        if abs(v - z) > (_SAME_SPEED if abilities.velocity else _SAME_SPEED_MEASURED) * max(abs(v), abs(z)):
            lines.append(
                f'[contact] law = "{scene.contact.law}": the ends start with {v:.6g} and {z:.6g} m/s and are joined by '
                f"an impulse, which the body in [{table}] does not take; give it one (impulse of an FMU, apply_impulse "
                'of a body of your own), let both start with one velocity, or use "link"'
            )
        body.join(other.motion().velocity)
    return lines
