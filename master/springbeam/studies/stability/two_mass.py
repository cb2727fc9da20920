"""The two-mass oscillator, coupled in the ways that ordinary masters do: by how much each grows.

Masses 1 and 1, springs 4π² to both walls and 16π² between them, exact subsystems, zero-order hold. Per step of size H
amplitudes grow by 1 + cπ²H² + O(H³); c is known in closed form for each exchange (`CONSTANTS`).
"""

from __future__ import annotations

import numpy as np

from .linear import LinearBody, Step

#: c by what is exchanged (subsystem 1 – subsystem 2), and when.
CONSTANTS = {
    "force-displacement jacobi": 6.0,
    "force-displacement jacobi, one step late": 10.0,
    "force-displacement gauss_seidel": 2.0,
    "displacement-displacement jacobi": 4.0,
    "displacement-displacement gauss_seidel": 0.0,
}
_WALL, _BETWEEN = 4.0 * np.pi**2, 16.0 * np.pi**2


def amplification(exchange: str, H: float) -> np.ndarray:
    """Matrix of one step for (ξ₁, ξ̇₁, ξ₂, ξ̇₂, ξ₁ one step before), shape (5, 5)."""
    free, joined = (Step(LinearBody(np.array([s]), np.zeros(1), np.ones(1)), H) for s in (_WALL, _WALL + _BETWEEN))
    X = np.eye(5)
    one, two, before = X[:2], X[2:4], X[4]
    sequential = exchange.endswith("seidel")
    if exchange.startswith("force"):
        # The second subsystem holds the spring between: it takes a displacement and gives a force.
        known = before if exchange.endswith("late") else one[0]
        one_end = free(one, [_BETWEEN * (two[0] - known)])[0]
        two_end = joined(two, [_BETWEEN * (one_end if sequential else one)[0]])[0]
    else:
        one_end = joined(one, [_BETWEEN * two[0]])[0]
        two_end = joined(two, [_BETWEEN * (one_end if sequential else one)[0]])[0]
    return np.vstack([one_end, two_end, one[:1]])


def predicted(exchange: str, H: float) -> float:
    """c of the spectral radius."""
    radius = float(np.abs(np.linalg.eigvals(amplification(exchange, H))).max())
    return (radius - 1.0) / (np.pi * H) ** 2


def measured(exchange: str, H: float, duration: float = 400.0) -> float:
    """c of the growth of the energy while the oscillator is stepped for ``duration`` [s], over the second half."""
    matrix = amplification(exchange, H)
    x, energies = np.array([1.0, 0.0, 0.0, 0.0, 1.0]), []
    steps = round(duration / H)
    for step in range(steps + 1):
        if step in (steps // 2, steps):
            energy = 0.5 * (x[1] ** 2 + x[3] ** 2 + _WALL * (x[0] ** 2 + x[2] ** 2) + _BETWEEN * (x[0] - x[2]) ** 2)
            energies.append(energy)
        x = matrix @ x
    rate = np.log(energies[1] / energies[0]) / (2.0 * (steps - steps // 2))
    return float(rate / (np.pi * H) ** 2)
