"""The loads of a scene as the references take them: sampled, on the modes of the beam and on the spring.

A unit of a load adds its pattern to the modal forces and its share to the spring's force; between two kinks every
signal is smooth, and each of these pieces is integrated by itself.
"""

from __future__ import annotations

import numpy as np

from ..scene import Load, Scene
from .semi_discrete import ModalBeam, SemiDiscreteBeam, assemble

#: Angle [rad] that a load turns in a step at most.
_TURN = 1.0


class Loads:
    """Patterns and values of the loads.

    Attributes
    ----------
    patterns : (loads, r) array
        Modal forces of a unit of each load.
    on_spring : (loads,) array
        Forces on the spring top of a unit of each load [N].
    kinks : list of float
        When a load jumps or bends [s], ascending.
    longest_step : float
        What resolves the loads [s].
    """

    def __init__(self, scene: Scene, beam: ModalBeam | None) -> None:
        self._loads = scene.loads
        modes = 0 if beam is None else len(beam.omega)
        self.patterns = np.zeros((len(scene.loads), modes))
        self.on_spring = np.zeros(len(scene.loads))
        mass = 0.0 if scene.spring is None else scene.spring.mass
        mesh = assemble(scene.beam) if scene.loads and scene.beam is not None else None
        for i, load in enumerate(scene.loads):
            if beam is not None and mesh is not None and load.on != "spring":
                self.patterns[i] = beam.tip if load.on == "tip" else beam.force(_nodal(scene, mesh, load))
            if load.on in ("spring", "base"):
                self.on_spring[i] = 1.0 if load.on == "spring" else -mass
        self.kinks = sorted({float(time) for load in scene.loads for time in _kinks(load)})
        self.longest_step = min((_TURN / _rate(load) for load in scene.loads if _rate(load) > 0.0), default=np.inf)
        self._until = np.inf

    def __len__(self) -> int:
        return len(self._loads)

    def smooth_from(self, time: float) -> float:
        """Let `values` be smooth up to when a load jumps or bends next; return that [s]."""
        kink = next((kink for kink in self.kinks if kink > time), np.inf)
        self._until = np.nextafter(kink, 0.0)
        return kink

    def whole(self) -> None:
        """Let `values` be those of the signals at any time."""
        self._until = np.inf

    def values(self, times: np.ndarray) -> np.ndarray:
        """Return the loads, each in its unit, at ``times`` [s] of shape (...), shape (..., loads)."""
        at = np.minimum(times, self._until)
        values = [load.value(at) for load in self._loads]
        return np.stack(values, axis=-1) if values else np.zeros((*np.shape(times), 0))


def _kinks(load: Load) -> list[float]:
    if load.signal == "table":
        return list(load.start + load.record.x)
    if load.signal == "constant":
        return []
    return [load.start, load.start + (load.duration or 0.0)]


def _rate(load: Load) -> float:
    """Return the rate of the load [rad/s]; a table, a step and a ramp are polynomials between kinks."""
    if load.signal == "harmonic":
        return 2.0 * np.pi * (load.frequency or 0.0)
    return np.pi / (load.duration or np.inf) if load.signal == "half_sine" else 0.0


def _nodal(scene: Scene, mesh: SemiDiscreteBeam, load: Load) -> np.ndarray:
    """Return the load vector of the mesh, (2N,), of a unit of ``load``."""
    assert scene.beam is not None
    if load.at is not None:
        return np.asarray(mesh.deflection_sampler(np.array([load.at])).toarray()[0])
    shape = load.shape or [1.0]
    if load.on == "base":
        shape = [-scene.beam.density * scene.beam.area]
    nodes, weights = np.polynomial.legendre.leggauss(mesh.degree + 3)
    x = (np.arange(mesh.n_elements)[:, None] + 0.5 * (nodes + 1.0)).ravel() / mesh.n_elements
    force = np.tile(0.5 * weights, mesh.n_elements) * np.polynomial.polynomial.polyval(x, shape)
    return np.asarray(mesh.deflection_sampler(x).T @ force) * mesh.length / mesh.n_elements
