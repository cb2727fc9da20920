"""The force of steps that miss a soft law: each applies a polynomial, the law demands a force along the path."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import chain
from typing import Any

import numpy as np

from ...bodies.protocol import Body
from ...motion.paths import derivative, sign_changes, value
from ...results.records import FORCE_COLUMNS, force, joined
from ...scene.laws import SoftLaw
from .records import StepRecords, path_of, penetration

#: Gauss points of a stretch between 0 and 1, and their weights.
_POINTS, _SHARES = np.polynomial.legendre.leggauss(4)
_INSIDE = list(zip(0.5 * (_POINTS + 1.0), 0.5 * _SHARES, strict=True))
#: Returns, of the numbers of steps, and penetrations and their rates at one place in each, the demanded force [N] and
#: how it grows with both [N/m], [N·s/m], (3, n).
_Demand = Callable[[Any, Any, Any], np.ndarray]


def defect_of_law(law: SoftLaw, steps: StepRecords, parts: int) -> np.ndarray:
    """Return `_defect` of the force that a soft ``law`` demands along the path of the penetration."""
    path = penetration(steps)
    touches = _touches(path) if law.one_sided else {}
    return _defect(partial(_force_of_law, law), path, steps, parts, touches)


def defect_of_tip(tip: Body, steps: StepRecords, parts: int) -> np.ndarray:
    """Return `_defect` of the force that holds a ``tip`` without mass at the lower end, while it is joined to that."""
    return _defect(partial(_force_of_tip, tip, joined(steps.before)), path_of(steps, "y", "z"), steps, parts, {})


def _defect(demand: _Demand, path: Any, steps: StepRecords, parts: int, kinks: dict[int, list[float]]) -> np.ndarray:
    """Return six means over equal parts of each step, (n, parts, 6).

    They are the demanded force beyond that of the step [N], and how it grows with the penetration [N/m] and with its
    rate [N·s/m]; then the same weighted by 2 (1 − s), s the share of the part. ``kinks`` are the shares of steps at
    which the demand is not smooth: quadrature goes from one to the next.
    """
    found = np.zeros((len(steps.size), parts, 6))
    step, part, low, high = _stretches(len(steps.size), parts, kinks)
    size = steps.size[step]
    applied = {name: steps.ends[name][step] for name in FORCE_COLUMNS}
    path = path[:, step]
    slope = derivative(path)
    means = np.zeros((6, len(step)))
    for at, share in _INSIDE:
        s = low + at * (high - low)
        demanded, *grows = demand(step, value(path, s), value(slope, s) / size)
        each = np.array([demanded - force(applied, s * size), *grows])
        left = 1.0 - (s * parts - part)
        means += share * np.concatenate([each, 2.0 * left * each])
    np.add.at(found, (step, part), (means * (high - low) * parts).T)
    return found


def _stretches(steps: int, parts: int, kinks: dict[int, list[float]]) -> tuple[Any, Any, Any, Any]:
    """Return the step, the part of it, and both ends, as shares of the step, of each stretch without ``kinks``."""
    where = np.array([number for number, places in kinks.items() for _ in places], int)
    step = np.append(np.repeat(np.arange(steps), parts), where)
    low = np.append(np.tile(np.arange(parts) / parts, steps), [*chain.from_iterable(kinks.values())])
    order = np.lexsort((low, step))
    step = step[order]
    low = low[order]
    high = np.append(low[1:], 1.0)
    high[np.append(step[1:] != step[:-1], True)] = 1.0
    part = np.minimum((0.5 * (low + high) * parts).astype(int), parts - 1)  # a kink may be at the end to rounding
    return step, part, low, high


def _touches(path: Any) -> dict[int, list[float]]:
    """Return the shares of steps at which a contact opens or closes, by the number of the step."""
    closed = np.array([value(path, s) for s in (0.0, *(at for at, _ in _INSIDE), 1.0)]) > 0.0
    changing = np.flatnonzero(closed.any(axis=0) & ~closed.all(axis=0))
    return {int(step): sign_changes(path[:, step].tolist(), 0.0, 1.0) for step in changing}


def _force_of_law(law: SoftLaw, _step: np.ndarray, p: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Return `_Demand` of a soft ``law``."""
    found = np.zeros((3, len(p)))
    closed = (p > 0.0) | (not law.one_sided)
    places = list(zip(p[closed].tolist(), rate[closed].tolist(), strict=True))
    found[0, closed] = [law.force(*place) for place in places]
    found[1, closed] = [law.slope(deep) for deep, _ in places]
    if law.damped and places:
        found[1:, closed] += np.transpose([law.resistance(*place)[1:] for place in places])
    return found


def _force_of_tip(tip: Body, together: np.ndarray, step: np.ndarray, y: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Return `_Demand` of a ``tip`` without mass that is joined to the lower end in the steps ``together``."""
    stiffness = np.full(len(y), tip.stiffness(0.0))
    damping = np.full(len(y), tip.damping)
    held = tip.holding_force(0.0, 0.0) + stiffness * y + damping * rate
    return np.asarray(together[step] * [held, stiffness, damping])
