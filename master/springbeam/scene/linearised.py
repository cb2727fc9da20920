"""Energies of a scene, and its frequencies where it is stiffest, known before a run.

A hardening spring is stiffest at the largest deflection that the energy at first contact allows, a softening spring at
rest. The depth of its potential well bounds the energy of a softening spring that does not escape.
"""

from __future__ import annotations

from math import inf, sqrt

import numpy as np

from .scene import Scene
from .statics import initial_kinetic_energy, shear_stiffness, tip_compliance
from .tables import Beam, Spring


def contact_energy(scene: Scene) -> float:
    """Return the energy at first contact [J]: of the beam, the spring, and loads."""
    energy = 0.0
    if (spring := scene.spring) is not None:
        energy = spring_energy(spring) + spring.external_force * _elongation(spring)  # without its load
    return max(energy + beam_energy(scene), 0.0) + _load_energy(scene)


def beam_energy(scene: Scene) -> float:
    """Return the energy of the beam at first contact [J]: of u̇ = s₁x, and the shear of a straight u with θ = 0."""
    if (beam := scene.beam) is None:
        return 0.0
    return initial_kinetic_energy(beam) + bent_energy(scene, beam)


def bent_energy(scene: Scene, beam: Beam) -> float:
    """Return the energy of the beam's shape at first contact [J]: of the shear of a straight u with θ = 0."""
    slope = beam.initial_deflection_slope + (scene.contact_time or 0.0) * beam.initial_velocity_slope
    return 0.5 * shear_stiffness(beam) * beam.length * slope**2


def closing_speed(scene: Scene) -> float:
    """Estimate the speed [m/s] at which the ends meet first: that of the start, and of a fall under constant forces."""
    rates = []
    for body in (scene.upper, scene.lower):
        names = ("velocity", "initial_velocity")
        rates.append(next((getattr(body, name) for name in names if hasattr(body, name)), 0.0))
    if scene.beam is not None:
        rates[0] = scene.beam.initial_velocity_slope * scene.beam.length
    closing = max(rates[1] - rates[0], 0.0)
    mass = getattr(scene.upper, "mass", 0.0)
    heights = [scene.at_start(table) for table in ("beam", "spring")]
    if not mass or None in heights:
        return closing
    gap = heights[0].value - heights[1].value  # type: ignore[union-attr]
    return sqrt(max(closing**2 - 2.0 * getattr(scene.upper, "external_force", 0.0) / mass * max(gap, 0.0), 0.0))


def _load_energy(scene: Scene) -> float:
    """Estimate the energy of loads that begin at once [J]: twice the static deflection under their peaks, 2 F²/k.

    F is the tip force that would bend the slender beam as far, ∫ f ξ² (3 − ξ)/2 dx with ξ = x/L.
    """
    on_tip = on_spring = 0.0
    for load in scene.loads:
        if load.on == "spring":
            on_spring += load.peak
        elif (beam := scene.beam) is not None:
            shape = (beam.density * beam.area,) if load.on == "base" else load.shape or (1.0,)
            spread = sum(s * (1.5 / (i + 3.0) - 0.5 / (i + 4.0)) for i, s in enumerate(shape))
            at = 1.0 if load.on == "tip" else load.at
            share = beam.length * abs(spread) if at is None else at * at * (3.0 - at) / 2.0
            on_tip += load.peak * share
    energy = 0.0 if scene.beam is None else 2.0 * on_tip**2 * tip_compliance(scene.beam)
    if on_spring > 0.0 and scene.spring is not None and scene.spring.linear_stiffness > 0.0:
        energy += 2.0 * on_spring**2 / scene.spring.linear_stiffness
    return energy


def spring_stiffness(scene: Scene) -> float:
    """Return k1 + 3 k2 x² of the spring at its stiffest [N/m], x its elongation.

    That is at rest if it softens, else on the foundation or where it takes all the energy.
    """
    spring = scene.spring
    assert spring is not None
    k1 = spring.linear_stiffness
    k2 = spring.cubic_stiffness
    if k2 <= 0.0:
        x = 0.0
    elif scene.stop is not None:
        x = max(abs(scene.stop.position - spring.unloaded), abs(_elongation(spring)))
    else:
        # ½ k1 x² + ¼ k2 x⁴ = E
        x = sqrt((sqrt(k1 * k1 + 4.0 * k2 * contact_energy(scene)) - k1) / k2)
    return k1 + 3.0 * k2 * x**2


def spring_frequency(scene: Scene) -> float:
    """Return √(k/m) of the spring at its stiffest [rad/s], 0 where it does not oscillate."""
    assert scene.spring is not None
    return sqrt(max(spring_stiffness(scene), 0.0) / scene.spring.mass)


# -- the well of a softening spring ---------------------------------------------------------------------------------


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
