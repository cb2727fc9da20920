"""Least squares over runs: each residual costs a run, and derivatives are differences of runs at the present place.

Unknowns are logarithms of keys, which so keep their signs. The shift of the clock is eliminated inside each residual:
what is left of the curves at the best shift is projected onto what a further shift does not change (variable
projection; Golub & Pereyra 1973, Kaufman 1975). Steps are those of Gauss and Newton within a box. In a valley, where
two keys nearly make up for each other, a step along it leaves it to second order: it is corrected by the derivatives
there are before it is shortened (in 25 steps without that, those of scipy's ``least_squares`` do not reach the end of
one).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from typing import NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from ...signals.measured import Measured, mean_square, period, rms
from ..tables import Row

#: The unknown that moves the clock of the measurement [s], beside keys.
SHIFT = "shift"
#: Makes the record of a run at unknowns, with a `window` for the clock.
Trial = Callable[[np.ndarray, Row], Row]
#: Residual of a run that cannot be made, so that a search turns back.
_REFUSED = 1e3
#: Differences of the unknowns that give derivatives: to one side on the way, where in a valley of two keys 1e-5 is too
#: coarse, and to both sides at a minimum.
_FINE = 1e-6
_COARSE = 1e-4
#: A search has ended where a step by Newton's method gains less than this share of what noise does
#: (Bates & Watts 1981), or changes the unknowns less than that.
_SHARE = 0.01
_LEAST = 1e-9
#: Longest step at first, and trials of one before it is shortened: as it is, and corrected.
_FIRST = 0.5
_TRIALS = 4
#: The mean of the derivatives to both sides is so many times the smaller one, and those of other samples, where an
#: impact passes a sample.
_PASSED = 5.0
#: A combination of unknowns that changes the curves by less than this share of the others is not determined.
_UNDETERMINED = 1e-5


class Minimum(NamedTuple):
    """Where a search has ended."""

    at: np.ndarray  #: unknowns, shape (k,)
    shift: float  #: of the clock [s]
    row: Row  #: the record of a run there
    part: slice  #: the points that take part
    cost: float  #: see `Search.cost`
    residual: np.ndarray  #: what is left of all curves at these, weighed, shape (m,)
    derivatives: np.ndarray  #: by the unknowns and, if the clock is free, by its shift [1/s], shape (m, k or k + 1)
    weights: Mapping[str, float]  #: of the curves
    ended: bool  #: whether no further step would gain anything

    @property
    def freedom(self) -> int:
        """Number of points of all curves beyond that of unknowns."""
        return max(len(self.residual) - int(self.derivatives.shape[1]), 1)

    @property
    def deviations(self) -> np.ndarray:
        """Standard deviations of the unknowns and the shift if the residual is white; infinite of what has no effect.

        They are those of linear least squares.
        """
        lengths = np.linalg.norm(self.derivatives, axis=0)
        if not lengths.all():
            return np.full(len(lengths), np.inf)
        _, sizes, directions = np.linalg.svd(self.derivatives / lengths, full_matrices=False)
        inverse = directions.T / np.maximum(sizes, 1e-300)
        variance = float(self.residual @ self.residual) / self.freedom
        return np.sqrt(variance * (inverse**2).sum(axis=1)) / lengths

    @property
    def left(self) -> dict[str, np.ndarray]:
        """What is left of each curve: run less measurement at the points that take part."""
        parts = np.split(self.residual, len(self.weights))
        return {what: part / weight for (what, weight), part in zip(self.weights.items(), parts, strict=True)}

    def moved_by(self, curves: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return how far the unknowns and the shift move if the measurement changes by ``curves``, shapes (n,)."""
        change = np.concatenate([self.weights[what] * curve for what, curve in curves.items()])
        return np.linalg.lstsq(self.derivatives, np.nan_to_num(change))[0]

    def alike(self, names: Sequence[str], duration: float) -> list[str]:
        """Return which unknowns change nothing, or the curves in the same way; a shift counts over a ``duration``."""
        slopes = self.derivatives * [duration if name == SHIFT else 1.0 for name in names]
        lengths = np.linalg.norm(slopes, axis=0)
        small = lengths <= _UNDETERMINED * lengths.max()
        if small.any():
            return [f"{name} does not change the curves" for name, idle in zip(names, small, strict=True) if idle]
        _, sizes, directions = np.linalg.svd(slopes / lengths, full_matrices=False)
        if sizes[-1] >= _UNDETERMINED * sizes[0]:
            return []
        shares = np.abs(directions[-1])
        together = [name for name, share in zip(names, shares, strict=True) if share > 0.1 * shares.max()]
        held = "; --shift 0 holds the clock" * (SHIFT in together)
        return [f"{' and '.join(together)} change the curves in the same way: fix one of them{held}"]


class Search:
    """A search near a run, ``row`` its record, from its unknowns ``at``, by more runs that ``trial`` makes.

    The points that take part are those that the run covers wherever the clock moves, if it is ``free``.
    """

    def __init__(
        self,
        trial: Trial,
        data: Measured,
        limits: tuple[np.ndarray, np.ndarray],
        at: np.ndarray,
        row: Row,
        *,
        free: bool,
    ) -> None:
        self._trial = trial
        self._data = data
        self._limits = limits
        self._free = free
        self.at = at
        self.row = row
        self._reach = _FIRST
        self._room = row["room"]
        self._rows = {tuple(at.tolist()): row}
        self._weights = {what: 1.0 / data.spread(what) for what in data.values}
        self.part = slice(*row["points"])

    @property
    def cost(self) -> float:
        """The mean square of what is left of the curves where it begins, over their spread and the share of points."""
        return mean_square(self.row["off"], self._data)

    def evenly(self) -> Search:
        """Return this search with each curve weighed by what is left of it."""
        evenly = copy(self)
        evenly._weights = {}
        for what in self._data.values:
            evenly._weights[what] = 1.0 / max(rms(self.row["off"][what]), 1e-9 * self._data.spread(what))
        return evenly

    def _run(self, at: np.ndarray, near: float | None = None) -> Row:
        """Return the record of a run at unknowns, its clock within a quarter of a period of a shift."""
        key = tuple(at.tolist())
        if key not in self._rows:
            near = self.row["shift"] if near is None else near
            quarter = 0.25 * self.period
            shifts = np.clip([near - quarter, near, near + quarter], *self._room).tolist()
            self._rows[key] = self._trial(at, window(shifts, self.part))
        return self._rows[key]

    @property
    def period(self) -> float:
        """That of the motion, or a smaller one [s]."""
        return period(self.row["slope"], self._data)

    @property
    def points(self) -> int:
        """Number of points that take part."""
        return int(self.part.stop - self.part.start)

    def _curves(self, row: Row, name: str) -> np.ndarray:
        """Return ``off`` or ``slope`` of a record where points take part, weighed."""
        parts = [self._weights[what] * np.array(curve, float)[self.part] for what, curve in row[name].items()]
        return np.nan_to_num(np.concatenate(parts))

    def _eliminated(self, row: Row) -> tuple[np.ndarray, float]:
        """Return what is left at the best shift, and that shift [s]."""
        off = self._curves(row, "off")
        if not self._free:
            return off, row["shift"]
        slope = self._curves(row, "slope")
        moved = float(off @ slope / max(float(slope @ slope), 1e-300))
        return off - moved * slope, row["shift"] - moved

    def _residual(self, at: np.ndarray) -> np.ndarray:
        """Return what is left of the curves, weighed."""
        row = self._run(at)
        if row["error"]:
            return np.full(len(self._data.values) * self.points, _REFUSED)
        return self._eliminated(row)[0]

    def _differences(self, before: float, after: float) -> tuple[np.ndarray, np.ndarray]:
        """Return derivatives of the residual, and of the shift eliminated in it, by differences around a place.

        ``before`` and ``after`` say how far from it; derivatives are 0 where neither run can be made. Those to both
        sides differ at a sample that an impact crosses on one side: there a velocity jumps, and the smaller one counts.
        """
        columns = []
        moved = []
        for unit in np.eye(len(self.at)):
            sizes = [size for size in (before, 0.0, after) if not self._run(self.at + size * unit)["error"]]
            ends = [self._eliminated(self._run(self.at + size * unit)) for size in sizes]
            width = (sizes[-1] - sizes[0]) or np.inf
            slope = (ends[-1][0] - ends[0][0]) / width
            if sizes == [before, 0.0, after] and before < 0.0 < after:
                left, right = ((ends[k + 1][0] - ends[k][0]) / (sizes[k + 1] - sizes[k]) for k in (0, 1))
                smaller = np.where(np.abs(left) < np.abs(right), left, right)
                passed = np.abs(slope) > _PASSED * np.maximum(np.abs(smaller), np.median(np.abs(slope)))
                slope = np.where(passed, smaller, slope)
            columns.append(slope)
            moved.append((ends[-1][1] - ends[0][1]) / width)
        return np.transpose(columns), np.array(moved)

    def _ended(self, slopes: np.ndarray) -> bool:
        """Return whether a step by Newton's method from here has a negligible gain compared with noise."""
        left = self._residual(self.at)
        step = self._step(slopes, left)
        freedom = max(len(left) - len(step) - self._free, 1)
        noise = np.linalg.norm(left) * np.sqrt(len(step) / freedom)
        return bool(np.linalg.norm(slopes @ step) <= _SHARE * noise or np.abs(step).max() <= _LEAST)

    def least(self, most: int) -> Search:
        """Return this search from where it leads to: a minimum, or where it is after ``most`` steps."""
        ahead = copy(self)
        for _ in range(most):
            slopes, moved = ahead._differences(0.0, _FINE)
            if ahead._ended(slopes) or not ahead._stepped(slopes, moved):
                break
        return ahead

    def _stepped(self, slopes: np.ndarray, moved: np.ndarray) -> bool:
        """Move to a lower cost, by derivatives of the residual and of the shift; return whether there is one."""
        left = self._residual(self.at)
        while self._reach > _LEAST:
            step = self._step(slopes, left, self._reach)
            length = float(np.linalg.norm(step))
            foreseen = left + slopes @ step
            before = np.inf
            for _ in range(_TRIALS):
                row = self._run(self.at + step, self.row["shift"] + float(moved @ step))
                residual = self._residual(self.at + step)
                size = float(np.linalg.norm(residual))
                if size < np.linalg.norm(left):
                    self.at = self.at + step
                    self.row = row
                    self._reach = max(self._reach, 2.0 * length)
                    return True
                if row["error"] or size > 0.5 * before:
                    break
                before = size
                step = self._step(slopes, residual - foreseen - slopes @ step)
            self._reach = 0.25 * min(length, self._reach)
        return False

    def _step(self, slopes: np.ndarray, left: np.ndarray, reach: float = np.inf) -> np.ndarray:
        """Return the step that is foreseen to leave least, within the limits and ``reach``, the shortest of several.

        Unknowns that would go beyond theirs end there, and the others make up for these, so that a search along a
        valley ends where its limit crosses it.
        """
        low, high = (np.clip(limit - self.at, -reach, reach) for limit in self._limits)
        turned, sizes, directions = np.linalg.svd(slopes, full_matrices=False)
        known = sizes >= _UNDETERMINED * sizes.max(initial=0.0)
        of_known = sizes[known, None] * directions[known]
        return lsq_linear(of_known, -(turned.T @ left)[known], (low, high), "bvls").x

    def minimum(self) -> Minimum:
        """Return what is left and the derivatives where the search has ended."""
        left, shift = self._eliminated(self.row)
        slopes, moved = self._differences(-_COARSE, _COARSE)
        ended = self._ended(slopes)
        if self._free:
            turn = self._curves(self.row, "slope")
            slopes = np.column_stack([slopes - np.outer(turn, moved), turn])
        return Minimum(self.at, shift, self.row, self.part, self.cost, left, slopes, self._weights, ended)


def window(shifts: Sequence[float], part: slice) -> Row:
    """Return what a case says of the clock: the lowest, a first and the highest shift [s], and which points count."""
    return {"clock": shifts, "points": (part.start, part.stop)}
