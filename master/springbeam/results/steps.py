"""The data of a step that its row lacks: the ends before the event that ends it, and the contact force.

A row holds the state after its event. Between two rows the motion follows from the start of the step (the row before),
its end and its two moments, the force from the step's polynomial: `springbeam.results.dense` and
`springbeam.results.totals` are made from these.
"""

from __future__ import annotations

from struct import Struct
from typing import Any

import numpy as np

from ..scene import Scene

#: Numbers of a step in the order of the file ``steps.bin``: its end [s] and size [s] (0 for a row that ends no step),
#: the ends' displacements [m], velocities [m/s], integrals [m·s] and [m·s²] over it; C, Ċ, C̈ and N at its start.
STEP_COLUMNS = (
    "time",
    "size",
    "u_tip",
    "v_tip",
    "u_tip_integral",
    "u_tip_integral_2",
    "y",
    "z",
    "y_integral",
    "y_integral_2",
    "contact_force",
    "contact_force_rate",
    "contact_force_rate_2",
    "foundation_force",
)
#: Little-endian doubles, on every machine.
STEP = np.dtype([(name, "<f8") for name in STEP_COLUMNS])
#: Bytes of a step from its numbers.
packed = Struct(f"<{len(STEP_COLUMNS)}d").pack


def steps_of(content: bytes | bytearray) -> np.ndarray | None:
    """Return the steps in ``content``, an incomplete last one left out; ``None`` if there is none.

    Raises ValueError for a number that is not finite.
    """
    whole = len(content) // STEP.itemsize
    if not whole:
        return None
    steps: np.ndarray = np.frombuffer(content, STEP, whole).copy()
    numbers = steps.view("<f8").reshape(whole, -1)
    if not np.isfinite(numbers).all():
        row, column = (int(index) for index in np.argwhere(~np.isfinite(numbers))[0])
        raise ValueError(
            f"{STEP_COLUMNS[column]} = {numbers[row, column]} in the step to t = {numbers[row, 0]!s} s: not finite"
        )
    return steps


def impulse(steps: np.ndarray, tau: np.ndarray, of: Any = slice(None)) -> np.ndarray:
    """Return ∫ C dτ [N·s] from the start of each step, of those that ``of`` picks, up to ``tau`` [s]."""
    # By columns: picking whole steps would move ten times as much.
    c, dc, ddc = (steps[name][of] for name in ("contact_force", "contact_force_rate", "contact_force_rate_2"))
    return np.asarray(tau * (c + tau * (dc / 2.0 + tau * ddc / 6.0)))


def load_on_spring(scene: Scene, times: np.ndarray) -> np.ndarray:
    """Return what the loads of ``scene`` amount to on its lower end [N] at ``times`` [s]."""
    mass = getattr(scene.lower, "mass", None) or 0.0
    shares = {"spring": 1.0, "base": -mass}
    parts = [shares[load.on] * load.value(times) for load in scene.loads if load.on in shares]
    return sum(parts, np.zeros_like(times))


def contact_force(steps: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """Return C [N] of each step ``tau`` [s] after its start."""
    return np.asarray(
        steps["contact_force"] + tau * (steps["contact_force_rate"] + 0.5 * tau * steps["contact_force_rate_2"])
    )
