"""The force of steps that miss a soft law: each applies a polynomial, the law demands a force along the path."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from ...bodies.protocol import Body
from ...motion.paths import derivative, value
from ...results.records import force, joined
from ...scene.laws import SoftLaw
from .records import StepRecords, path_of, penetration

#: Points of a step at which a law is evaluated, and their weights: Gauss points.
_POINTS, _SHARES = np.polynomial.legendre.leggauss(4)
_INSIDE = list(zip(0.5 * (_POINTS + 1.0), 0.5 * _SHARES, strict=True))
#: Returns, of penetrations and their rates at one place in each step, the demanded force [N] and how it grows
#: with both [N/m], [N·s/m], (3, n).
_Demand = Callable[[Any, Any], np.ndarray]


def defect_of_law(law: SoftLaw, steps: StepRecords, parts: int) -> np.ndarray:
    """Return `_defect` of the force that a soft ``law`` demands along the path of the penetration."""
    return _defect(partial(_force_of_law, law), penetration(steps), steps, parts)


def defect_of_tip(tip: Body, steps: StepRecords, parts: int) -> np.ndarray:
    """Return `_defect` of the force that holds a ``tip`` without mass at the lower end, while it is joined to that."""
    return _defect(partial(_force_of_tip, tip, joined(steps.before)), path_of(steps, "y", "z"), steps, parts)


def _defect(demand: _Demand, path: Any, steps: StepRecords, parts: int) -> np.ndarray:
    """Return four means over equal parts of each step, (n, parts, 4).

    They are the demanded force beyond that of the step, once evenly weighted and once by 2 (1 − s), s the
    share of the part [N], and how it grows with the penetration [N/m] and with its rate [N·s/m].
    """
    size = steps.size
    slope = derivative(path)
    found = np.zeros((len(size), parts, 4))
    for part, (at, share) in product(range(parts), _INSIDE):
        s = (part + at) / parts
        demanded, *grows = demand(value(path, s), value(slope, s) / size)
        beyond = demanded - force(steps.ends, s * size)
        found[:, part] += share * np.array([beyond, 2.0 * (1.0 - at) * beyond, *grows]).T
    return found


def _force_of_law(law: SoftLaw, p: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Return `_Demand` of a soft ``law``."""
    found = np.zeros((3, len(p)))
    closed = np.flatnonzero((p > 0.0) | (not law.one_sided))
    for i, *both in zip(closed.tolist(), p[closed].tolist(), rate[closed].tolist(), strict=True):
        _, *slopes = law.resistance(*both) if law.damped else (0.0, 0.0, 0.0)
        found[:, i] = law.force(*both), law.slope(both[0]) + slopes[0], slopes[1]
    return found


def _force_of_tip(tip: Body, together: np.ndarray, y: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Return `_Demand` of a ``tip`` without mass that is joined to the lower end in the steps ``together``."""
    stiffness = np.full(len(y), tip.stiffness(0.0))
    damping = np.full(len(y), tip.damping)
    held = tip.holding_force(0.0, 0.0) + stiffness * y + damping * rate
    return np.asarray(together * [held, stiffness, damping])
