"""The largest force of a soft law along the path of the ends, between the rows, too."""

from __future__ import annotations

from math import comb

import numpy as np

from ..motion.curves import Curve
from ..scene.laws import SoftLaw
from .dense import motion
from .records import Rows

#: Steps whose forces are looked at together, to bound the memory for a long run.
_TOGETHER = 65536
#: Places in a step among which the largest force is looked for.
_PLACES = 17
#: Forces that differ by less than this share are equal.
_ALIKE = 1e-13
#: Share of an interval that golden sections leave, and how closely they find a maximum, in shares of a step: its value
#: is then as good as the square of that.
_GOLDEN = 0.6180339887498949
_CLOSE = 1e-8


def peak_of_law(law: SoftLaw, steps: np.ndarray) -> tuple[float, float]:
    """Return the largest force of ``law`` [N] along the path over consecutive records, and when that is [s].

    The force grows with penetration and rate. So a step cannot have more than the force at the largest values that
    enclose both, and is looked into only where that is more than what is known.
    """
    row = int(np.argmax(steps["contact_force_after"]))
    best = float(steps["contact_force_after"][row])
    time = float(steps["time"][row])
    made = np.flatnonzero(steps["size"][1:] > 0.0) + 1  # the first record has the row at which the others begin
    for begin in range(0, len(made), _TOGETHER):
        after = made[begin : begin + _TOGETHER]
        penetration = -motion(False, Rows(steps, after - 1), Rows(steps, after))["gap"]
        deepest = _most(penetration)
        fastest = _most(penetration.rate) if law.damped else np.zeros_like(deepest)
        most = np.array([law.force(*there) for there in zip(deepest.tolist(), fastest.tolist(), strict=True)])
        for k in np.argsort(-most):
            if most[k] <= best * (1.0 + _ALIKE):
                break
            force, share = _largest(law, penetration.one(k))
            if force > best:
                best = force
                time = float(steps["time"][after[k]] - (1.0 - share) * penetration.size[k])
    return max(best, 0.0), time


def _most(curve: Curve) -> np.ndarray:
    """Return bounds from above of n curves: the largest of the Bernstein coefficients of each, which enclose it."""
    places = range(len(curve.powers))
    bernstein = [[comb(i, k) / comb(places[-1], k) for k in places] for i in places]
    return np.asarray((bernstein @ np.array(curve.powers)).max(axis=0))


def _largest(law: SoftLaw, penetration: Curve) -> tuple[float, float]:
    """Return the largest force [N] along the ``penetration`` in one step, and at which s."""
    rate = penetration.rate

    def force(s: float) -> float:
        return law.force(penetration.at(s), rate.at(s))

    width = 1.0 / (_PLACES - 1)
    near = max((k * width for k in range(_PLACES)), key=force)
    low = max(near - width, 0.0)
    high = min(near + width, 1.0)
    while high - low > _CLOSE:
        inner = high - _GOLDEN * (high - low)
        outer = low + _GOLDEN * (high - low)
        low, high = (inner, high) if force(inner) < force(outer) else (low, outer)
    return max((force(s), s) for s in (low, near, high))
