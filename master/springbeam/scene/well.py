"""The well of a softening spring: how deep it is, what it holds, and the energy that the spring starts with."""

from __future__ import annotations

import math

from .scene import Scene
from .tables import Spring


def _potential(spring: Spring, y: float) -> float:
    """Return the potential of the spring and its load at ``y`` [J]."""
    k1, k2 = spring.linear_stiffness, spring.cubic_stiffness
    return y * (y * (0.5 * k1 + 0.25 * k2 * y * y) - spring.external_force)


def spring_energy(spring: Spring) -> float:
    """Return the energy of the spring and its load at the start [J]."""
    return 0.5 * spring.mass * spring.initial_velocity**2 + _potential(spring, spring.equilibrium)


def largest_load(spring: Spring) -> float:
    """Return the largest load under which a softening spring has an equilibrium, 2/3 k1 √(k1/3|k2|) [N]."""
    return 2.0 / 3.0 * spring.linear_stiffness * math.sqrt(spring.linear_stiffness / (-3.0 * spring.cubic_stiffness))


def well_depth(scene: Scene) -> float:
    """Return the potential [J] at the lower rim of a softening spring's well; a rim below the foundation is none.

    −∞ where the load leaves no well. The rims are the outer roots of k1 y + k2 y³ = f_s: y = 2a cos θ with
    a² = k1/3|k2| and cos 3θ = −f_s/(2|k2|a³) (Viète).
    """
    spring = scene.spring
    assert spring is not None
    a = math.sqrt(spring.linear_stiffness / (-3.0 * spring.cubic_stiffness))
    if not abs(spring.external_force) < largest_load(spring):
        return -math.inf
    theta = math.acos(-spring.external_force / largest_load(spring)) / 3.0
    low, high = 2.0 * a * math.cos(theta + 2.0 / 3.0 * math.pi), 2.0 * a * math.cos(theta)
    barred = scene.stop is not None and scene.stop.position > low
    return min(_potential(spring, y) for y in ((high,) if barred else (low, high)))
