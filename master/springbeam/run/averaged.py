"""How far an end is moved by what the steps leave out of measured loads.

Each step takes the projection of a load onto polynomials of degree 2 (`springbeam.run.loads`). What is left out hardly
moves what is slow; but a mode that turns far in a step may be in resonance with it. A load of known frequency is judged
by that (`springbeam.scene.resolution.slow_oscillations`), a table here.
"""

from __future__ import annotations

import numpy as np

from ..scene import Load, Scene
from ..scene.linearised import spring_frequency
from .misplaced import tip_modes

#: Radians of a mode, and lines of a table, to a point of the quadrature over a step; its points at least, at most.
_DENSE, _POINTS = 1.0, (8, 96)
#: ∫ φ of the beam's modes over length and tip value is at most this, that of the lowest.
_MEAN = 0.4


def left_out(scene: Scene, steps: np.ndarray) -> float:
    """Return how far what the ``steps`` leave out of tables moves an end, over its largest distance from its start.

    To first order, of bodies that are free, without their damping: at most.
    """
    made, found = steps[steps["size"] > 0.0], 0.0
    tables = [load for load in scene.loads if load.signal == "table"]
    if not tables or not len(made):
        return found
    if scene.beam is not None and not scene.massless:
        omega, tip = tip_modes(scene.beam)
        way = float(np.abs(steps["u_tip_after"] - steps["u_tip_after"][0]).max())
        moved = sum(_on_beam(scene, load) * _swing(load, made, omega, tip**2) for load in tables)
        found = moved / way if way > 0.0 else 0.0
    if scene.spring is not None:
        omega, mass = np.array([max(spring_frequency(scene), 1.0 / scene.duration)]), scene.spring.mass
        way = float(np.abs(steps["y_after"] - steps["y_after"][0]).max())
        on_top = {"spring": 1.0 / mass, "base": 1.0}
        moved = sum(on_top.get(load.on, 0.0) * _swing(load, made, omega, np.ones(1)) for load in tables)
        found = max(found, moved / way if way > 0.0 else 0.0)
    return found


def _on_beam(scene: Scene, load: Load) -> float:
    """Return the largest force on a mode [N] of a ``load`` of 1, over the tip's displacement in that mode."""
    beam = scene.beam
    assert beam is not None
    if load.on == "base":
        return _MEAN * beam.density * beam.area * beam.length
    if load.on == "beam" and load.at is None:
        return _MEAN * beam.length * sum(map(abs, load.shape or (1.0,)))
    return 0.0 if load.on == "spring" else 1.0


def _swing(load: Load, made: np.ndarray, omega: np.ndarray, weights: np.ndarray) -> float:
    """Return Σ w |∫ δF exp(−iωt) dt|/ω at its largest, δF being what the steps ``made`` leave out of ``load``."""
    size = made["size"]
    lines = len(load.record.x) * float(size.max()) / float(np.ptp(load.record.x))
    points = int(np.clip(_DENSE * (float(omega.max() * size.max()) + lines), *_POINTS))
    nodes, shares = np.polynomial.legendre.leggauss(points)
    times = (made["time"] - 0.5 * size)[:, None] + 0.5 * size[:, None] * nodes
    force = load.value(times)
    P = np.polynomial.legendre.legvander(nodes, 2)
    missing = (force - (force * shares) @ P * [0.5, 1.5, 2.5] @ P.T) * shares * 0.5 * size[:, None]
    swings = (np.abs(np.cumsum((missing * np.exp(-1j * w * times)).sum(axis=1))) / w for w in omega)
    return float(np.max(sum(w * swing for w, swing in zip(weights, swings, strict=True))))
