"""Damping of our beam's tip, by the modes of its mesh."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from .statics import bending_stiffness, shear_stiffness
from .tables import Beam

#: Elements of a mesh that has the lowest modes of any finer one.
_ELEMENTS = 50


@lru_cache(maxsize=16)
def tip_decay(beam: Beam) -> float:
    """Return the decrease of the acceleration of the tip per unit of velocity that an impulse adds [1/s].

    Elements of a higher degree and those with the averaged mass are represented by fine linear ones. Both energies are
    sums of squares, so that rounding of the high frequencies of a slender beam does not destroy the low ones.
    """
    linear = beam.element_degree == 1 and beam.mass_matrix == "consistent"
    n = min(beam.n_elements, _ELEMENTS) if linear else _ELEMENTS
    h = beam.length / n
    none = np.zeros((n, n))
    rise = np.eye(n) - np.eye(n, k=-1)  # over an element, from the clamp on
    mean = 0.5 * (np.eye(n) + np.eye(n, k=-1))
    bending = bending_stiffness(beam) / h
    shear = shear_stiffness(beam) * h
    if linear and not beam.reduced_integration:  # it locks
        bending += shear * (beam.length / (beam.n_elements * h)) ** 2 / 12.0
    strain = np.block([[none, bending**0.5 * rise], [shear**0.5 / h * rise, -(shear**0.5) * mean]])
    speed = (beam.density * h) ** 0.5 * np.vstack([mean, rise / 12.0**0.5])
    to_strain = np.linalg.qr(strain)[1]
    of_strain = np.linalg.inv(to_strain)
    speeds = np.kron(np.diag([beam.area**0.5, beam.second_moment_of_area**0.5]), speed) @ of_strain
    if beam.n_modes and beam.integrator == "modal":
        # The lowest, and the static shapes of a tip force, of a uniform load and of the start.
        start = to_strain[:, :n] @ np.arange(1.0, n + 1.0)
        shapes = np.array([of_strain[n - 1], mean.sum(axis=0) @ of_strain[:n], start])
        space = np.linalg.qr(np.vstack([np.linalg.svd(speeds)[2][: beam.n_modes], shapes]).T)[0]
        speeds = speeds @ space
        of_strain = of_strain @ space
    periods, modes = np.linalg.svd(speeds)[1:]
    omega = 1.0 / periods
    tip = modes @ of_strain[n - 1] / periods
    return float(tip**2 @ (beam.alpha_b * omega**2)) / (float(tip @ tip) or 1.0)
