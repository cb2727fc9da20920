"""How much of the driving end's motion a one-way coupling has left out, at most (`springbeam.coupling.one_way`)."""

from __future__ import annotations

import numpy as np

from ..results.steps import force
from ..scene import Coupling


class Neglect:
    """What a run by a one-way ``coupling`` neglects; ``stiffness`` is that of the driving end [N/m]."""

    def __init__(self, coupling: Coupling, stiffness: float) -> None:
        self._coupling, self._stiffness = coupling, stiffness
        #: Of the records so far: ∫ |dC| [N], C at the end [N], the largest penetration [m].
        self._varied, self._force, self._deepest = 0.0, 0.0, 0.0

    def by(self, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return by each of the next records 2 V/k with V = ∫ |dC| [m], and that over the largest penetration."""
        size, begin = steps["size"], steps["contact_force"]
        with np.errstate(divide="ignore", invalid="ignore"):
            turn = -steps["contact_force_rate"] / steps["contact_force_rate_2"]
        turns = (steps["contact_force_rate_2"] != 0.0) & (turn > 0.0) & (turn < size)
        middle, end = force(steps, np.where(turns, turn, 0.0)), force(steps, size)
        made = size > 0.0
        ends = np.concatenate([[self._force], end[made]])
        varied = np.zeros(len(steps))
        varied[made] = np.abs(begin[made] - ends[:-1]) + (np.abs(middle - begin) + np.abs(end - middle))[made]
        variation = np.cumsum([self._varied, *varied])[1:]
        depth = np.where(made, steps["y"] - steps["u_tip"], 0.0)
        deepest = np.maximum.accumulate(np.maximum(depth, self._deepest))
        self._varied, self._force, self._deepest = float(variation[-1]), float(ends[-1]), float(deepest[-1])
        motion = 2.0 * variation / self._stiffness
        return motion, np.divide(motion, deepest, out=np.zeros_like(motion), where=deepest > 0.0)

    def check(self, steps: np.ndarray, first: np.ndarray) -> tuple[int, str] | None:
        """Return at which of the next records too much may have been neglected, and what to do; see `Log`."""
        allowed = self._coupling.feedback_tolerance
        motion, share = self.by(steps)
        row = int(np.argmax(share > allowed))
        if not share[row] > allowed:
            return None
        return (
            row,
            f"coupling.feedback = {self._coupling.feedback!r} may by now neglect {motion[row]:.3g} m of the driving "
            f"end's motion, {share[row]:.2g} of the largest penetration; allowed is coupling.feedback_tolerance = "
            f"{allowed:g}. Take 'two_way', or allow more",
        )
