"""Energies of a scene at the start, and the well of a softening spring, whose depth bounds the energy in it."""

from __future__ import annotations

from math import inf, sqrt

import numpy as np

from .scene import Scene
from .statics import initial_kinetic_energy, shear_stiffness
from .tables import Beam, Spring


def beam_energy(scene: Scene) -> float:
    """Return the energy of the beam at first contact [J]: of u̇ = s₁x, and the shear of a straight u with θ = 0."""
    if (beam := scene.beam) is None:
        return 0.0
    return initial_kinetic_energy(beam) + bent_energy(scene, beam)


def bent_energy(scene: Scene, beam: Beam) -> float:
    """Return the energy of the beam's shape at first contact [J]: of the shear of a straight u with θ = 0."""
    slope = beam.initial_deflection_slope + (scene.contact_time or 0.0) * beam.initial_velocity_slope
    return 0.5 * shear_stiffness(beam) * beam.length * slope**2


def _elongation(spring: Spring) -> float:
    """Return the elongation of the spring at the start [m]."""
    return spring.equilibrium - spring.unloaded


def _potential(spring: Spring, x: float) -> float:
    """Return the potential of the spring and its load at the elongation ``x`` [J]."""
    k1 = spring.linear_stiffness
    k2 = spring.cubic_stiffness
    return x * (x * (0.5 * k1 + 0.25 * k2 * x * x) - spring.external_force)


def spring_energy(spring: Spring) -> float:
    """Return the energy of the spring and its load at the start [J]."""
    return 0.5 * spring.mass * spring.initial_velocity**2 + _potential(spring, _elongation(spring))


def hilltop(spring: Spring) -> float:
    """Return the elongation at the top of a softening spring's potential without load, √(k1/|k2|) [m]."""
    return sqrt(spring.linear_stiffness / -spring.cubic_stiffness)


def largest_load(spring: Spring) -> float:
    """Return the largest load under which a softening spring has an equilibrium, 2/3 k1 √(k1/3|k2|) [N]."""
    return 2.0 / 3.0 * spring.linear_stiffness * sqrt(spring.linear_stiffness / (-3.0 * spring.cubic_stiffness))


def well_depth(scene: Scene) -> float:
    """Return the potential [J] at the lower rim of a softening spring's well; a rim below the foundation is none.

    −∞ where a side has neither. The rims are the outer roots of k1 x + k2 x³ = f_s, that is of 4 r³ − 3 r + f_s/F = 0
    with x = 2 r √(k1/3|k2|) and the `largest_load` F; beyond F only one side has a rim.
    """
    spring = scene.spring
    assert spring is not None
    r = np.roots([4.0, 0.0, -3.0, spring.external_force / largest_load(spring)])
    rims = 2.0 / sqrt(3.0) * hilltop(spring) * r.real[(r.imag == 0.0) & (np.abs(r.real) > 0.5)]
    barred = scene.stop is not None and all(scene.stop.position > spring.unloaded + x for x in rims if x < 0.0)
    sides = [rims[rims > 0.0], *([] if barred else [rims[rims < 0.0]])]
    return min(_potential(spring, float(side[0])) if len(side) else -inf for side in sides)
