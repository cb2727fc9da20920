"""Reaction of the clamp, from the balance of momentum of the whole beam about it.

The mean over the beam of what the elements' inertia and the loads are, so that it needs no strains.
"""

from __future__ import annotations

import numpy as np

from ..scene import Beam, Load, Scene
from .semi_discrete import ModalBeam, assemble


class Clamp:
    """What holds the beam of ``scene``, whose modes are those of ``modes``."""

    def __init__(self, scene: Scene, modes: ModalBeam) -> None:
        beam = scene.beam
        assert beam is not None
        self._length = beam.length
        #: Rates of momentum and of moment of momentum of a unit of each modal acceleration, shape (2, r).
        self._inertia = _inertia(beam) @ modes.basis
        h = beam.length / beam.n_elements
        hat = 0.5 * h * np.array([1.0, beam.length - h / 3.0])
        #: Force [N] and moment about the clamp [N·m] of the constant loads, (2,), and of a unit of each other, (2, n).
        self._constant = beam.distributed_load * _of_shape((1.0,), beam.length) + beam.tip_load_coefficient * hat
        self._varying = np.reshape([_resultant(beam, load) for load in scene.loads], (-1, 2)).T

    def reaction(self, acceleration: np.ndarray, contact: np.ndarray, loads: np.ndarray) -> np.ndarray:
        """Return the clamp's force, upward [N], and moment, counter-clockwise [N·m], shape (2, k).

        Parameters
        ----------
        acceleration
            ä of the modes, shape (k, r).
        contact
            C [N], shape (k,).
        loads
            The loads of the scene, each in its unit, shape (k, n).
        """
        on_beam = np.array([contact, contact * self._length]) + self._constant[:, None] + self._varying @ loads.T
        return np.asarray(self._inertia @ acceleration.T - on_beam)


def _inertia(beam: Beam) -> np.ndarray:
    """Return ρA ∫ u dx and ∫ ρA x u + ρI θ dx of a unit of each unknown of the mesh, shape (2, 2N)."""
    mesh, mass = assemble(beam), beam.density * beam.area
    nodes, weights = np.polynomial.legendre.leggauss(mesh.degree + 2)
    x = (np.arange(mesh.n_elements)[:, None] + 0.5 * (nodes + 1.0)).ravel() / mesh.n_elements
    length = np.tile(0.5 * weights, mesh.n_elements) * beam.length / mesh.n_elements
    sampled = mesh.deflection_sampler(x)
    force, moment = sampled.T @ length, sampled.T @ (length * x) * beam.length
    rotation = np.roll(force, -1)  # θ has the shapes of u, one place before it
    return np.array([mass * force, mass * moment + beam.density * beam.second_moment_of_area * rotation])


def _resultant(beam: Beam, load: Load) -> np.ndarray:
    """Return force and moment about the clamp of a unit of ``load``."""
    if load.on == "spring":
        return np.zeros(2)
    if load.on == "tip" or load.at is not None:
        return np.array([1.0, (load.at or 1.0) * beam.length])
    return _of_shape((-beam.density * beam.area,) if load.on == "base" else load.shape or (1.0,), beam.length)


def _of_shape(shape: tuple[float, ...], length: float) -> np.ndarray:
    """Return force and moment about the clamp of the load Σ s_i (x/L)^i."""
    powers = np.arange(len(shape))
    return np.array([length * (shape / (powers + 1.0)).sum(), length**2 * (shape / (powers + 2.0)).sum()])
