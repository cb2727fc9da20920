"""What a run shows of how well its macro steps follow the motion, for `springbeam.run.resolution`."""

from __future__ import annotations

from collections.abc import Collection
from math import inf, sqrt

import numpy as np

from ..bodies.protocol import Body
from ..scene.laws import stiffest
from .resolution import window_of
from .stepping import Pair

#: Columns whose sum is the energy that both bodies and the contact law store [J].
_STORED = ("beam_kinetic", "beam_potential", "spring_kinetic", "spring_potential", "law_stored")


def unknown(pair: Pair) -> str | None:
    """Return a warning that names what cannot be judged, since a body does not say how stiff it is."""
    setup = pair.setup
    there = [body for body, is_given in zip(pair.bodies, (setup.upper, setup.lower), strict=True) if is_given]
    silent = _tables_of(pair, [body for body in there if body.oscillation() is None])
    if not silent:
        return None
    said = (
        f"the body in {silent} does not say its stiffness and damping; how far ends are misplaced, and "
        "how far it turns in a macro step, is not known"
    )
    if setup.force_window is None and setup.law is not None:
        said += "; contact.force_window says over which time the peak contact force is a mean"
    return said


def _tables_of(pair: Pair, bodies: Collection[Body]) -> str:
    """Return the tables of ``bodies`` in words."""
    tables = zip(("[beam]", "[spring]"), pair.bodies, strict=True)
    return " and ".join(table for table, body in tables if body in bodies)


def coarse_force(pair: Pair) -> str | None:
    """Return a warning that names a body of unknown acceleration or damping, so that C is that of the steps."""
    silent = _tables_of(pair, pair.without_acceleration)
    if not silent:
        return None
    return (
        f"the body in {silent} does not say its acceleration, or how damping changes it; the force "
        "between joined ends, and when they part, is only as exact as the force of a step: name its variable in "
        "acceleration, or take a smaller coupling.macro_step"
    )


def force_window(pair: Pair, steps: np.ndarray) -> float:
    """Return over which time the contact force is averaged before its peak is taken [s].

    It is ``contact.force_window``, or `springbeam.run.resolution.WINDOW` of a period: that of a contact by a soft law
    that opens where it has taken all the energy, whose peak is the law's; else the slowest of the upper body alone;
    that of both together where that does not oscillate; the run where nothing does.
    """
    if pair.setup.force_window is not None:
        return pair.setup.force_window
    upper = pair.upper
    lower = pair.lower
    if pair.opens_softly and pair.law is not None:
        deepest = float((steps["y"] - steps["u_tip"]).max(initial=0.0))
        energy = sum(steps[name] for name in _STORED)
        stiffness = max(stiffest(pair.law, float(np.max(energy, initial=0.0))), pair.law.slope(deepest))
        omega = sqrt(stiffness * (1.0 / upper.inertia + 1.0 / lower.inertia))
    else:
        omega, _ = upper.oscillation() or (0.0, 0.0)
        omega = omega or _together(pair, steps)
    return window_of(pair, omega)


def _together(pair: Pair, steps: np.ndarray) -> float:
    """Return the frequency of both ends as one [rad/s], where they have been stiffest; 0 if none is known."""
    known = [body.stiffness(steps[name]) for body, name in ((pair.upper, "u_tip_after"), (pair.lower, "y_after"))]
    stiffness = sum(float(np.max(k)) for k in known if k is not None) if len(steps) else 0.0
    inertia = pair.upper.inertia + pair.lower.inertia
    return sqrt(stiffness / inertia) if 0.0 < stiffness < inf and 0.0 < inertia < inf else 0.0
