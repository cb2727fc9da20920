"""Range of a quantity of a run: what errors, contradictions and residuals are relative to.

A range that is no larger than the rounding of what the quantity is computed from is no scale, so each has a floor.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..motion.curves import Curve, derivative, sign_changes
from .records import FORCE_COLUMNS
from .trajectory import Trajectory

#: Rounding of a position, as a share of the largest one that it is computed from.
ROUNDING = 1e-13
#: Least range of a quantity over its rounding; an end that has less does not move.
FLOOR = 1e4
#: Places of a step where the lowest value of its curve is looked for.
_PLACES = np.linspace(0.0, 1.0, 9)[:, None]
#: So many of the steps with the lowest values there are searched closely.
_SEARCHED = 16
#: Values that differ by less than this share of the largest one are equal: well above rounding.
_ALIKE = 1e-13


class Extremes(NamedTuple):
    """Lowest and highest value of a column, and their times [s]."""

    lowest: float
    lowest_time: float
    highest: float
    highest_time: float

    @classmethod
    def of_rows(cls, times: np.ndarray, values: np.ndarray) -> Extremes:
        """Return those of ``values`` at ``times`` [s], shapes (n,)."""
        low = int(np.argmin(values))
        high = int(np.argmax(values))
        return cls(float(values[low]), float(times[low]), float(values[high]), float(times[high]))

    def along(self, curve: Curve, begins: np.ndarray) -> Extremes:
        """Return those with the values of the curves of n steps that begin at ``begins`` [s], shape (n,)."""
        highest, time = _lowest(-curve, begins, -self.highest, self.highest_time)
        return Extremes(*_lowest(curve, begins, self.lowest, self.lowest_time), -highest, time)


def _lowest(curve: Curve, begins: np.ndarray, best: float, time: float) -> tuple[float, float]:
    """Return the lowest value on n curves and its time [s]: ``best`` at ``time`` if none is lower, but for rounding.

    Minima are looked for on the curves that are lowest at some places.
    """
    values = curve.at(_PLACES)
    tolerance = _ALIKE * float(np.abs(values).max(initial=0.0))
    lowest = values.min(axis=0)
    few = min(_SEARCHED, len(lowest))
    for i in np.argpartition(lowest, few - 1)[:few].tolist():
        one = curve.one(i)
        # Not at 0: where it begins another one ends, or there is a row.
        for s in (*sign_changes(derivative(one.powers), 0.0, 1.0), 1.0):
            there = one.at(s)
            if there < best - tolerance:
                best = there
                time = float(begins[i] + s * one.size)
    return best, time


def span(values: Any, rounding: float = 0.0) -> float:
    """Return the largest change of ``values`` from the first one, at least `FLOOR` times their rounding.

    ``rounding`` is that of what they are computed from, in their unit: of positions `rounding_of`. It counts as at
    least `ROUNDING` of the values.
    """
    values = np.asarray(values, float)
    if not values.size:
        return FLOOR * rounding
    least = max(rounding, ROUNDING * float(np.abs(values).max()))
    return max(float(np.abs(values - values[0]).max()), FLOOR * least)


def rounding_of(run: Trajectory) -> float:
    """Return the rounding [m] of the positions of ``run``: of its ends, and of the beam between them."""
    largest = [float(np.abs(run.columns[name]).max(initial=0.0)) for name in ("u_tip", "y") if name in run.columns]
    if run.shapes is not None:
        largest.append(float(np.abs(run.shapes[1]).max(initial=0.0)))
    of_positions = ROUNDING * max(largest, default=0.0)
    return of_positions if run.steps is None else max(of_positions, rounding_of_steps(run.steps, _tolerance(run)))


def rounding_of_steps(steps: np.ndarray, tolerance: float = ROUNDING) -> float:
    """Return the rounding [m] of the positions of both ends by their records.

    That is `ROUNDING` of the largest one, and ``tolerance``, that of the coupling, of the displacement by the contact
    force of a step alone: ends that the force holds differ from their place by that.
    """
    positions = max(float(np.abs(steps[f"{name}_after"]).max(initial=0.0)) for name in ("u_tip", "y"))
    moved = 0.5 * _impulses(steps) * steps["size"] * _per_mass(steps)
    return max(ROUNDING * positions, tolerance * float(moved.max(initial=0.0)))


def energy_of_force(steps: np.ndarray) -> np.ndarray:
    """Return the energy [J] that the contact force of each of ``steps`` alone would give to both ends.

    The works of forces that hold the ends cancel, and leave a rounding relative to it.
    """
    return np.asarray(0.5 * _impulses(steps) ** 2 * _per_mass(steps))


def _tolerance(run: Trajectory) -> float:
    return max(ROUNDING, run.scene.coupling.tolerance)


def _impulses(steps: np.ndarray) -> np.ndarray:
    """Return the largest impulse [N·s] that the polynomial of the contact force may have over each of ``steps``."""
    size = steps["size"]
    return sum((np.abs(steps[name]) * size ** (k + 1) for k, name in enumerate(FORCE_COLUMNS)), np.zeros_like(size))


def _per_mass(steps: np.ndarray) -> np.ndarray:
    """Return the inverse of the reduced mass of ends that a rigid law joins [1/kg], else 0."""
    mass = steps["reduced_mass"]
    return np.asarray(np.divide(1.0, mass, out=np.zeros_like(mass), where=mass > 0.0))
