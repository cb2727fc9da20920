"""Estimate by hand what a scene is, and say in words which of its values can hardly be meant.

A beam with area = 1 is taken to be in units of its own: nothing is said about it.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import pi, sqrt
from typing import NamedTuple

from .scene import Scene
from .statics import locking, lowest_frequency, tip_compliance, tip_inertia
from .tables import Beam

#: What beams are made of: from foam to the heaviest metals [kg/m³], from gels to diamond [Pa].
_DENSITIES, _MODULI = (10.0, 25e3), (1e4, 2e12)
#: E/G: 2 to 3 of isotropic solids, up to some 100 of laminates.
_YOUNG_OVER_SHEAR = (0.5, 200.0)
#: Length over radius of gyration: below, no beam theory holds; above, it is a thread.
_SLENDERNESS = (3.0, 3e4)
#: Lowest frequency [Hz] of anything that a macroscopic beam is.
_FREQUENCIES = (1e-2, 1e7)
#: Speed of the tip over that of sound in the beam, about its largest strain: no solid stays elastic beyond.
_MOST_STRAIN = 0.05


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


def _frequency(beam: Beam) -> float:
    """Return Rayleigh's quotient for the static shape of a tip force [Hz]: within 2 % if slender, 10 % if not."""
    return 1.0 / (2.0 * pi * sqrt(tip_compliance(beam) * tip_inertia(beam)))


def implausible(scene: Scene) -> Iterator[str]:
    """Yield what can hardly be meant, as lines ``[table] key = value: why, and what may be meant``."""
    beam = scene.beam
    if beam is None or 1.0 in (beam.area, beam.density):  # in units of its own
        return
    E, rho = beam.young_modulus, beam.density
    if not _MODULI[0] <= E <= _MODULI[1]:
        meant = f"; in GPa it would be {E * 1e9:.3g} Pa" if _MODULI[0] <= E * 1e9 <= _MODULI[1] else ""
        yield (
            f"[beam] young_modulus = {E:g}: in Pa, no solid has it (rubber about 1e6, aluminium 7e10, steel 2.1e11)"
            + meant
        )
    if not _DENSITIES[0] <= rho <= _DENSITIES[1]:
        meant = f"; in g/cm³ it would be {rho * 1e3:.3g} kg/m³" if _DENSITIES[0] <= rho * 1e3 <= _DENSITIES[1] else ""
        yield f"[beam] density = {rho:g}: in kg/m³, no solid has it (aluminium 2700, steel 7850){meant}"
    ratio = E / beam.shear_modulus
    if beam.poisson_ratio is None and not _YOUNG_OVER_SHEAR[0] <= ratio <= _YOUNG_OVER_SHEAR[1]:
        yield (
            f"[beam] shear_modulus = {beam.shear_modulus:g}: young_modulus is {ratio:.3g} times as large; for an "
            "isotropic solid it is 2 to 3 times, and poisson_ratio gives it"
        )
    slenderness = beam.length / sqrt(beam.second_moment_of_area / beam.area)
    if slenderness < _SLENDERNESS[0]:
        yield (
            f"[beam] length = {beam.length:g}: with this section the beam is thicker than long (length over radius of "
            f"gyration {slenderness:.2g}); is a length in mm?"
        )
    elif slenderness > _SLENDERNESS[1]:
        yield (
            f"[beam] length = {beam.length:g}: with this section the beam is a thread (length over radius of gyration "
            f"{slenderness:.2g}); is a length in mm?"
        )
    if beam.fidelity == "dynamic" and not _FREQUENCIES[0] <= (frequency := _frequency(beam)) <= _FREQUENCIES[1]:
        yield f"[beam]: its lowest frequency is {frequency:.2g} Hz; check length, section, density and young_modulus"
    speed = abs(beam.initial_velocity_slope) * beam.length
    sound = sqrt(E / rho)
    if speed > _MOST_STRAIN * sound:
        yield (
            f"[beam] the tip starts with {speed:.3g} m/s, {speed / sound:.2g} times the speed of sound in the beam "
            f"({sound:.3g} m/s): bending would strain it as much, which no solid does elastically"
        )
