"""How much of the driving end's motion a one-way coupling has left out, at most (`springbeam.coupling.one_way`)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..results.steps import force
from ..scene import Coupling
from .ledger import Wrong


class Past(NamedTuple):
    """What of earlier records counts."""

    variation: float = 0.0  #: ∫ |dC| [N]
    force: float = 0.0  #: C at the end [N]
    deepest: float = 0.0  #: the largest penetration [m]


class Neglected(NamedTuple):
    """By each of some records."""

    motion: np.ndarray  #: of the driving end, at most [m]
    share: np.ndarray  #: over the largest penetration until then
    past: Past  #: what of them counts later


def neglected(steps: np.ndarray, stiffness: float, past: Past) -> Neglected:
    """Return 2 V/k with V = ∫ |dC| by each of ``steps``; ``stiffness`` is k, of the driving end [N/m]."""
    size, begin = steps["size"], steps["contact_force"]
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = -steps["contact_force_rate"] / steps["contact_force_rate_2"]
    turns = (steps["contact_force_rate_2"] != 0.0) & (turn > 0.0) & (turn < size)
    middle, end = force(steps, np.where(turns, turn, 0.0)), force(steps, size)
    made = size > 0.0
    jumps = np.abs(begin[made] - np.concatenate([[past.force], end[made][:-1]]))
    varied = np.zeros(len(steps))
    varied[made] = jumps + (np.abs(middle - begin) + np.abs(end - middle))[made]
    variation = np.cumsum([past.variation, *varied])[1:]
    depth = np.where(made, steps["y"] - steps["u_tip"], 0.0)
    deepest = np.maximum.accumulate(np.maximum(depth, past.deepest))
    motion = 2.0 * variation / stiffness
    share = np.divide(motion, deepest, out=np.zeros_like(motion), where=deepest > 0.0)
    last = float(end[made][-1]) if made.any() else past.force
    return Neglected(motion, share, Past(float(variation[-1]), last, float(deepest[-1])))


class Neglect:
    """Stops a run whose one-way ``coupling`` may neglect too much; ``stiffness`` is that of the driving end [N/m]."""

    def __init__(self, coupling: Coupling, stiffness: float) -> None:
        self._coupling, self._stiffness, self._past = coupling, stiffness, Past()

    def check(self, steps: np.ndarray, first: np.ndarray) -> Wrong | None:
        """Return at which of the next records too much may have been neglected."""
        allowed = self._coupling.feedback_tolerance
        motion, share, self._past = neglected(steps, self._stiffness, self._past)
        row = int(np.argmax(share > allowed))
        if not share[row] > allowed:
            return None
        return (
            row,
            row + 1,
            f"coupling.feedback = {self._coupling.feedback!r} may by now neglect {motion[row]:.3g} m of the driving "
            f"end's motion, {share[row]:.2g} of the largest penetration; allowed is coupling.feedback_tolerance = "
            f"{allowed:g}. Take 'two_way', or allow more",
        )
