"""Energies and frequencies of a scene where it is stiffest, estimated before a run.

A hardening spring is stiffest at the largest deflection that the energy at first contact allows, a softening spring at
rest.
"""

from __future__ import annotations

from math import sqrt

from ..scene import Scene
from ..scene.energies import beam_energy, spring_energy
from ..scene.laws import SoftLaw
from ..scene.statics import tip_compliance


def contact_energy(scene: Scene) -> float:
    """Return the energy at first contact [J]: of the beam, the spring, and loads."""
    energy = 0.0
    if (spring := scene.spring) is not None:
        load = spring.external_force * (spring.equilibrium - spring.unloaded)
        energy = spring_energy(spring) + load  # without its load
    return max(energy + beam_energy(scene), 0.0) + _load_energy(scene)


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
        x = max(abs(scene.stop.position - spring.unloaded), abs(spring.equilibrium - spring.unloaded))
    else:
        # ½ k1 x² + ¼ k2 x⁴ = E
        x = sqrt((sqrt(k1 * k1 + 4.0 * k2 * contact_energy(scene)) - k1) / k2)
    return k1 + 3.0 * k2 * x**2


def spring_frequency(scene: Scene) -> float:
    """Return √(k/m) of the spring at its stiffest [rad/s], 0 where it does not oscillate."""
    assert scene.spring is not None
    return sqrt(max(spring_stiffness(scene), 0.0) / scene.spring.mass)


def depth(law: SoftLaw, energy: float) -> float:
    """Return the penetration [m] at which a one-sided ``law`` stores ``energy`` [J], to rounding."""
    if energy <= 0.0:
        return 0.0

    def stores_less(p: float) -> bool:
        try:
            return law.potential(p) < energy
        except OverflowError:
            return False

    low = 0.0
    high = 1.0
    while stores_less(high):
        low = high
        high = 2.0 * high
    while low < (middle := 0.5 * (low + high)) < high:
        low, high = (middle, high) if stores_less(middle) else (low, middle)
    return high
