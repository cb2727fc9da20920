"""Reject bodies with which a run cannot be made: our FMUs, FMUs of others, bodies of the caller.

The rules of the scene check its keys. This module checks the bodies, once, before the first step: their abilities,
initial positions and velocities.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from math import inf

import numpy as np

from ..bodies.protocol import Abilities, Body, BodyFailed, StepRefused
from ..contact.interface import Rigid
from .setup import SAME, SceneError, Setup

# -- abilities ---------------------------------------------------------------------------------------------------------

#: Texts about missing abilities.
_LACKS = {
    "state": "its state cannot be saved (canGetAndSetFMUstate = false)",
    "any_size": "its steps have one size (canHandleVariableCommunicationStepSize = false, or steps inside)",
    "velocity": "it has no velocity",
    "integrals": "its Motion has wrong integrals, its solver is of order 1, or it has not integral and integral_2",
    "impulse": "it has no impulse, or of a body of your own no apply_impulse",
}
_TO_BE_STRUCK = ("state", "any_size", "velocity", "impulse")
#: The abilities of our own bodies, which are all there are.
_ALL = Abilities()
_LEFT_OUT = 'leave it out, or use scheme = "energy"'

#: What a run needs: the key that asks for it, what may be given instead, and the abilities.
Need = tuple[str, str, tuple[str, ...]]


def _needs(setup: Setup) -> Iterator[Need]:
    """Yield what ``setup`` needs of both bodies."""
    degree = f"[coupling] degree = {setup.degree}"
    if not setup.exchanges:
        instead = 'use scheme = "jacobi" or "gauss_seidel" with [contact] law = "link" or "compliance", without [stop]'
        yield f'[coupling] scheme = "{setup.scheme}"', instead, ("state",)
    else:
        if setup.degree > 0:
            yield degree, _LEFT_OUT, ("velocity",)
        if setup.soft is not None and setup.soft.damped:
            yield "[contact] damping", _LEFT_OUT, ("velocity",)
    if isinstance(setup.law, Rigid) and not setup.lasting:
        yield f'[contact] law = "{setup.law_name}"', 'use "compliance", "link" or "tie"', _TO_BE_STRUCK
    if setup.floor is not None:
        yield "[stop]", "leave it out", _TO_BE_STRUCK
    H = setup.macro_step
    if H is None:
        tolerances = "[coupling] relative_tolerance, absolute_tolerance"
        yield tolerances, "use macro_step", ("any_size", "velocity", "integrals")
        return
    multiple = f"use a multiple of [coupling] macro_step = {H}"
    if _between_steps(setup, [setup.end]):
        yield f"[time] t_end = {setup.end}", multiple, ("any_size",)
    kinks = (time for load in setup.loads if not load.is_finer_than(H) for time in load.kinks)
    if _between_steps(setup, (time for time in kinks if time < setup.end)):
        yield "[[loads]]: a step ends where each jumps or bends", multiple, ("any_size",)


def _between_steps(setup: Setup, times: Iterable[float]) -> bool:
    """Return whether one of the ``times`` [s] lies in the run, but not where a whole macro step ends."""
    assert setup.macro_step is not None
    steps = [(time - setup.start) / setup.macro_step for time in times if time >= setup.start]
    return any(abs(number - round(number)) > SAME for number in steps)


def refusals(setup: Setup, abilities: Mapping[str, Abilities]) -> list[str]:
    """Return why a run cannot be made with bodies of these ``abilities``, by table, each with a remedy."""
    needs = list(_needs(setup))
    return [line for table, body in abilities.items() for line in _lacking(setup, needs, table, body)]


def _lacking(setup: Setup, needs: Iterable[Need], table: str, body: Abilities) -> Iterator[str]:
    for key, instead, names in needs:
        for name in names:
            if getattr(body, name) < getattr(_ALL, name):
                yield f"{key}: the body in [{table}] cannot do that, {_LACKS[name]}; {instead}"
    if setup.exchanges:  # which sets no integrals of the gap to 0, and conserves no energy
        body = replace(body, integrals=_ALL.integrals, order=_ALL.order)
    if body.order < _ALL.order:
        yield (
            f'[coupling] scheme = "{setup.scheme}": the body in [{table}] cannot do that, a force moves its end by '
            "less or more than its velocity says, as by a solver of order 1 (Euler's), and a contact would create or "
            "lose energy in each step; name the velocity of an FMU, or give a body of your own a method of order 2"
        )
    degree = f"[coupling] degree = {setup.degree}: the body in [{table}] cannot do that"
    followed = min(body.integrals, body.slopes)
    if setup.degree > body.slopes:
        yield (
            f"{degree}, it follows derivatives of the force of order {body.slopes} at most (canInterpolateInputs; "
            f"FMI 3.0 has none; a body of your own, in advance); use degree = {followed}"
        )
    if setup.degree > body.integrals:
        yield f"{degree}, {_LACKS['integrals']}; use degree = {followed}"


#: Length of a trial step over a macro step.
_TRIAL = 2.0**-8
#: Displacement by a force in it, over that of the body or 1 m.
_MOVED = 1e-6
#: Length of a trial step that shows the order of a solver, over a macro step: also the fastest waves are slow in it.
_SHORT = 2.0**-14
#: Largest relative difference of a displacement by a force from that of a free mass.
_AS_FREE = 0.05


def tried(body: Body, time: float, macro_step: float) -> Abilities:
    """Return the abilities of a ``body`` of the caller, by short steps from ``time`` [s] that are undone.

    They show whether it follows a force that grows over a step, returns the integrals of its motion, and by a force
    moves as far as its velocity says. If it refuses them, its declared abilities count.
    """
    able = body.can()
    if not able.state or not 0.0 < body.mass < inf:
        return able
    h, short = (share * macro_step if able.any_size else macro_step for share in (_TRIAL, _SHORT))
    w, v, _, _ = body.motion()
    length = _MOVED * (max(abs(w), h * abs(v)) or 1.0)

    def response(size: float, *force: float) -> np.ndarray:
        """Return the change of the motion by a ``force`` as large as moves a free mass by ``length``."""

        def after(push: float) -> np.ndarray:
            body.rewind()
            return np.array(body.advance(time, size, (push * force[0], push * force[1], push * force[2])))

        moved: np.ndarray = after(2.0 * body.mass * length / (size * size)) - after(0.0)
        return moved

    body.mark()
    try:
        held, grown, bent = np.abs(
            [response(h, 1.0, 0.0, 0.0), response(h, 0.0, 1.0 / h, 0.0), response(h, 0.0, 0.0, 2.0 / h**2)]
        )
        displaced, faster, *_ = response(short, 1.0, 0.0, 0.0)
    except (BodyFailed, StepRefused, OverflowError):
        return able
    finally:
        body.rewind()
    if able.any_size and able.velocity and abs(displaced - 0.5 * short * faster) > _AS_FREE * abs(0.5 * short * faster):
        able = replace(able, order=1)
    if held[0] == 0.0:
        return able
    # Of a free mass the responses are 1/3, 1/6 and L h/3, L h²/12: a stiff body's are larger.
    slopes = (grown[0] > held[0] / 6.0, bent[0] > held[0] / 12.0, False)
    integrals = (held[2] > held[0] * h / 6.0, held[3] > held[0] * h * h / 24.0, False)
    return replace(
        able,
        slopes=min(able.slopes, slopes.index(False)),
        integrals=min(able.integrals, integrals.index(False)),
    )


# -- starts ------------------------------------------------------------------------------------------------------------

#: Velocities closer than this share are equal for an end without impulses: given, and measured from displacements.
_SAME_SPEED = 1e-13
_SAME_SPEED_MEASURED = 1e-6
#: Heights closer than this share are equal.
_SAME_PLACE = 1e-12


def validate(
    setup: Setup, upper: Body | None, lower: Body | None, measured: Mapping[str, Abilities] | None = None
) -> None:
    """Raise SceneError if a run cannot be made with these bodies as they are at its start.

    That is if a body lacks a needed ability, or if the contact law, the foundation or an undeformed approach cannot
    begin from the initial positions and velocities. Abilities ``measured``, by table, replace the declared ones.
    """
    bodies = {name: body for name, body in (("beam", upper), ("spring", lower)) if body is not None}
    able = {table: body.can() for table, body in bodies.items()}
    lines = refusals(setup, {**able, **(measured or {})})
    lines += [
        f"the body in [{table}]: mass = 0: only an upper end can be without inertia, tied by a rigid law to one that "
        "has some; give it a mass greater than 0 [kg]"
        for table, body in bodies.items()
        if body.massless and (table == "spring" or not isinstance(setup.law, Rigid))
    ]
    if setup.floor is not None and (lower is not None or not setup.at_rest):  # else the stop holds the tip up
        table, end = list(bodies.items())[-1]
        w = end.motion().displacement
        if setup.floor - w > _SAME_PLACE * max(abs(w), abs(setup.floor)):
            lines.append(
                f"[stop] position = {setup.floor:g}: the body in [{table}] starts below the foundation, at {w:.9g} m; "
                "it must start there or above"
            )
    if upper is not None and lower is not None and not lines:
        lines += _starts(setup, upper, lower)
        if isinstance(setup.law, Rigid) and setup.lasting:
            lines += _joined(setup, upper, lower)
    if lines:
        raise SceneError("\n".join(lines))


def _starts(setup: Setup, upper: Body, lower: Body) -> Iterator[str]:
    """Yield why two bodies cannot begin where they are."""
    u, v, _, _ = upper.motion()
    y, z, _, _ = lower.motion()
    # An undeformed tip has come down by v t, which rounds.
    apart = not setup.at_rest and abs(u - y) > _SAME_PLACE * max(abs(u), abs(y), setup.start * abs(v))
    ends = f"the upper end starts at {u:.9g} m and the lower one at {y:.9g} m"
    undeformed = '[beam] approach = "undeformed"'
    elastic = 'use approach = "elastic"'
    if setup.lasting:
        if apart and isinstance(setup.law, Rigid):
            yield f'[contact] law = "{setup.law_name}": {ends}; let them start at one height, or use "link"'
        return
    if setup.start > 0.0 and z != 0.0:
        yield (
            f"{undeformed}: the body in [spring] starts with {z:.6g} m/s, but nothing moves until the tip arrives at "
            f"t = {setup.start:.6g} s; let it start at rest, or {elastic}"
        )
    if apart and u < y:
        yield f"[beam]: {ends}; it must start there or above"
    elif apart and setup.undeformed:
        yield (
            f"{undeformed}: {ends}, and where the body below is when they meet is not known beforehand; {elastic}, or "
            "let them start at one height"
        )


def _joined(setup: Setup, upper: Body, lower: Body) -> Iterator[str]:
    """Join ends that are to be tied, if one takes no impulse; yield an error if their velocities differ."""
    v = upper.motion().velocity
    z = lower.motion().velocity
    for table, body, other in (("beam", upper, lower), ("spring", lower, upper)):
        abilities = body.can()
        if abilities.impulse:
            continue
        if abs(v - z) > (_SAME_SPEED if abilities.velocity else _SAME_SPEED_MEASURED) * max(abs(v), abs(z)):
            yield (
                f'[contact] law = "{setup.law_name}": the ends start with {v:.6g} and {z:.6g} m/s and are joined by an '
                f"impulse, which the body in [{table}] does not take; give it one (impulse of an FMU, apply_impulse "
                'of a body of your own), let both start with one velocity, or use "link"'
            )
        body.join(other.motion().velocity)
