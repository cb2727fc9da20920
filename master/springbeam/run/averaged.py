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
#: Steps that are looked at together: what is held of them is small.
_TOGETHER = 1024
#: Share of an end's way that is not worth computing.
_NEGLIGIBLE = 1e-3
#: ∫ φ of the beam's modes over length and tip value is at most this, that of the lowest.
_MEAN = 0.4


def left_out(scene: Scene, steps: np.ndarray) -> float:
    """Return how far what the ``steps`` leave out of tables moves an end, over its largest distance from its start.

    To first order, of bodies that are free, without their damping: at most.
    """
    made, shares = steps[steps["size"] > 0.0], [0.0]
    tables = [load for load in scene.loads if load.signal == "table"]
    if tables and len(made) and scene.beam is not None and not scene.massless:
        omega, tip = tip_modes(scene.beam)
        forces = [_on_beam(scene, load) for load in tables]
        shares.append(_share(tables, forces, made, omega, tip**2, steps["u_tip_after"]))
    if tables and len(made) and scene.spring is not None:
        omega = np.array([max(spring_frequency(scene), 1.0 / scene.duration)])
        on_top = {"spring": 1.0 / scene.spring.mass, "base": 1.0}
        forces = [on_top.get(load.on, 0.0) for load in tables]
        shares.append(_share(tables, forces, made, omega, np.ones(1), steps["y_after"]))
    return max(shares)


def _share(
    tables: list[Load],
    forces: list[float],
    made: np.ndarray,
    omega: np.ndarray,
    weights: np.ndarray,
    places: np.ndarray,
) -> float:
    """Return how far an end is moved that was at ``places`` [m], over its way; ``forces`` are those of loads of 1."""
    way = float(np.abs(places - places[0]).max())
    acting = [(load, force) for load, force in zip(tables, forces, strict=True) if force > 0.0]
    if way == 0.0 or not acting:
        return 0.0
    moved = [f * _swing(load, made, omega, weights, _NEGLIGIBLE * way / f) for load, f in acting]
    return sum(moved) / way


def _on_beam(scene: Scene, load: Load) -> float:
    """Return the largest force on a mode [N] of a ``load`` of 1, over the tip's displacement in that mode."""
    beam = scene.beam
    assert beam is not None
    if load.on == "base":
        return _MEAN * beam.density * beam.area * beam.length
    if load.on == "beam" and load.at is None:
        return _MEAN * beam.length * sum(map(abs, load.shape or (1.0,)))
    return 0.0 if load.on == "spring" else 1.0


def _swing(load: Load, made: np.ndarray, omega: np.ndarray, weights: np.ndarray, negligible: float) -> float:
    """Return Σ w |∫ δF exp(−iωt) dt|/ω at its largest, δF being what the steps ``made`` leave out of ``load``.

    What may be ``negligible`` in all is bounded, not computed.
    """
    size = made["size"]
    lines = len(load.record.x) * float(size.max()) / float(np.ptp(load.record.x))
    points = int(np.clip(_DENSE * (float(omega.max() * size.max()) + lines), *_POINTS))
    nodes, shares = np.polynomial.legendre.leggauss(points)
    P = np.polynomial.legendre.legvander(nodes, 2)
    share, at, most, bounded = negligible / len(made), np.zeros(len(omega), complex), 0.0, 0.0
    for first in range(0, len(made), _TOGETHER):
        half = 0.5 * size[first : first + _TOGETHER, None]
        times = made["time"][first : first + _TOGETHER, None] - half + half * nodes
        force = load.value(times)
        missing = (force - (force * shares) @ P * [0.5, 1.5, 2.5] @ P.T) * shares * half
        bound = float(np.abs(missing).sum() * (weights / omega).sum())
        if bound <= share * len(half):
            bounded += bound
            continue
        total = np.zeros(len(half))
        for k, w in enumerate(omega):
            swing = at[k] + np.cumsum((missing * np.exp(-1j * w * times)).sum(axis=1))
            at[k] = swing[-1]
            total += weights[k] / w * np.abs(swing)
        most = max(most, float(total.max()))
    return most + bounded
