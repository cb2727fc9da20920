"""Estimate by hand what a scene is."""

from __future__ import annotations

from math import pi, sqrt
from typing import NamedTuple

from .scene import Scene
from .statics import locking, lowest_frequency, tip_compliance, tip_inertia


class Estimates(NamedTuple):
    """What a scene is, by hand calculation; ``None`` where it has no such thing."""

    beam_mass: float | None  #: ρAL [kg]
    frequency: float | None  #: lowest of the beam, tip free, without a mesh [Hz]
    tip_stiffness: float | None  #: static, 1/(L³/3EI + L/KAG) [N/m]
    locking: float | None  #: the static stiffness of the mesh over that of the beam
    spring_mass: float | None  #: [kg]
    spring_stiffness: float | None  #: k1 [N/m]
    contact_time: float | None  #: first contact of an undeformed approach [s]
    contact_duration: float | None  #: half a period of spring and beam together [s]


def estimates(scene: Scene) -> Estimates:
    """Return what ``scene`` is, by hand calculation."""
    beam, spring = scene.beam, scene.spring
    duration = None
    if beam is not None and spring is not None and not scene.contact.lasting:
        stiffness = spring.linear_stiffness + 1.0 / tip_compliance(beam)
        if stiffness > 0.0:
            duration = pi * sqrt((spring.mass + tip_inertia(beam)) / stiffness)
    return Estimates(
        None if beam is None else beam.density * beam.area * beam.length,
        None if beam is None or beam.fidelity == "quasi_static" else lowest_frequency(beam) / (2.0 * pi),
        None if beam is None else 1.0 / tip_compliance(beam),
        None if beam is None else locking(beam),
        None if spring is None else spring.mass,
        None if spring is None else spring.linear_stiffness,
        scene.contact_time,
        duration,
    )
