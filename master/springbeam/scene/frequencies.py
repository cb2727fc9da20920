"""Frequencies of our beam, and of the waves that an impact excites, without the mesh.

`springbeam.studies.predict` has those of the mesh.
"""

from __future__ import annotations

from bisect import bisect_left
from math import pi, sqrt

from .statics import bending_stiffness, locking, lowest_frequency
from .tables import Beam

#: Steps from 0 to the highest frequency of the mesh in which that of a wave is searched.
_STEPS = 1 << 20


def slowest_frequency(beam: Beam) -> float:
    """Return the lowest frequency of the beam, with its tip free [rad/s]."""
    return lowest_frequency(beam) * sqrt(locking(beam))


def fastest_frequency(beam: Beam) -> float:
    """Return the highest frequency kept [rad/s]: of the mesh, or of the ``n_modes``-th wave."""
    high = mesh_frequency(beam)
    if beam.integrator != "modal" or beam.n_modes == 0 or modes_below(beam, high) <= beam.n_modes:
        return high
    return high / _STEPS * bisect_left(range(_STEPS), beam.n_modes, key=lambda k: modes_below(beam, high / _STEPS * k))


def mesh_frequency(beam: Beam) -> float:
    """Return an estimate of the highest frequency of the mesh [rad/s]."""
    shear = beam.shear_coefficient * beam.shear_modulus
    stiffness = _gradient(beam) * max(beam.young_modulus, shear) + shear * beam.area / beam.second_moment_of_area
    return sqrt(stiffness / beam.density)


def shear_frequency(beam: Beam) -> float:
    """Return an estimate of the highest frequency of shear waves on the mesh [rad/s], which an impact excites."""
    return sqrt(_gradient(beam) * beam.shear_coefficient * beam.shear_modulus / beam.density)


def _gradient(beam: Beam) -> float:
    """Return max ∫v'²/∫v² over polynomials on an element: 12/h² for p = 1, 60/h² for p = 2, then a little more [1/m²].

    With the averaged mass it is 6/h² for p = 1, and less than this for higher degrees.
    """
    h = beam.length / beam.n_elements
    p = beam.element_degree
    if p == 1 and beam.mass_matrix == "averaged":
        return 6.0 / h**2
    return p * (p + 1) * (p + 2) * (p + 3) / (2.0 * h**2)


def modes_below(beam: Beam, omega: float) -> int:
    """Estimate how many modes are slower than ``omega`` [rad/s]: half waves of both kinds that fit into the length.

    Wave numbers k of the Timoshenko beam, k² = ω² (a + b)/2 ± ω √(ω² (a − b)²/4 + ρA/EI) with a = ρ/E, b = ρ/KG; the
    second is real above √(KAG/ρI).
    """
    a = beam.density / beam.young_modulus
    b = beam.density / (beam.shear_coefficient * beam.shear_modulus)
    middle = 0.5 * omega**2 * (a + b)
    apart = omega * sqrt((0.5 * omega * (a - b)) ** 2 + beam.density * beam.area / bending_stiffness(beam))
    number = beam.length / pi * (sqrt(middle + apart) + sqrt(max(middle - apart, 0.0)))
    return int(number + 0.5)
