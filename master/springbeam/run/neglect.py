"""How much of the driving end's motion a one-way coupling has left out, at most (`springbeam.coupling.one_way`)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..results.steps import force


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
