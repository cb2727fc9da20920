"""Least squares over runs: each residual costs a run, so derivatives are updated by secants between a few of them.

Unknowns are logarithms of keys, which so keep their signs. The shift of the clock is eliminated inside each residual:
what is left of the curves at the best shift is projected onto what a further shift does not change (variable
projection; Golub & Pereyra 1973, Kaufman 1975).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from ..signals.measured import Measured
from .tables import Row

#: The unknown that moves the clock of the measurement [s], beside keys.
SHIFT = "shift"
#: Makes the record of a run at unknowns, the shift of the clock between two limits [s].
Trial = Callable[[np.ndarray, float, float], Row]
#: Share of the run by which the clock may move from where a search begins before points leave the run.
_MARGIN = 0.02
#: Residual of a run that cannot be made, so that a search turns back.
_REFUSED = 1e3
#: Differences of the unknowns that give the first derivatives of a search, and those where it ends.
_COARSE = 1e-3
_FINE = 1e-4
#: Where a search by secants ends: relative change of the cost, and change of the unknowns.
_COST = 1e-5
_STEP = 1e-7
#: Steps by Newton's method after that, at most, and the share of an interval, or the change, that is small enough.
_ROUNDS = 5
_SHARE = 0.1
_LEAST = 1e-9
#: A combination of unknowns that changes the curves by less than this share of the others is not determined.
_UNDETERMINED = 1e-5


class Minimum(NamedTuple):
    """Where a search has ended."""

    at: np.ndarray  #: unknowns, shape (k,)
    shift: float  #: of the clock [s]
    row: Row  #: the record of a run there
    part: np.ndarray  #: the points that take part, shape (n,)
    cost: float  #: see `Search.cost`
    residual: np.ndarray  #: what is left of them, weighed, shape (m,)
    derivatives: np.ndarray  #: by the unknowns and, if the clock is free, by its shift [1/s], shape (m, k or k + 1)

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
        return np.asarray(np.sqrt(variance * (inverse**2).sum(axis=1)) / lengths)

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

    The points that take part are those that the run covers, wherever the clock moves (if it is ``free``).
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
        weights: Mapping[str, float] | None = None,
    ) -> None:
        self._trial = trial
        self._data = data
        self._limits = limits
        self._free = free
        self.at = at
        self.row = row
        self._rows = {tuple(at.tolist()): row}
        self._weights = weights or {what: 1.0 / data.spread(what) for what in data.values}
        times = data.time + row["shift"]
        margin = _MARGIN * (row["end"] - row["begin"]) * free
        self.part = (times >= row["begin"] + margin) & (times <= row["end"] - margin)
        self._room = (row["shift"], row["shift"])
        if free and self.part.any():
            known = data.time[self.part]
            self._room = (row["begin"] - float(known[0]), row["end"] - float(known[-1]))

    @property
    def cost(self) -> float:
        """The mean square of what is left of the curves where it begins, over their spread and the share of points."""
        return _mean_square(self.row, self._data)

    def evenly(self) -> Search:
        """Return this search with each curve weighed by what is left of it."""
        weights = {}
        for what in self._data.values:
            left = float(np.sqrt(np.nanmean(np.array(self.row["off"][what], float) ** 2)))
            weights[what] = 1.0 / max(left, 1e-9 * self._data.spread(what))
        return Search(self._trial, self._data, self._limits, self.at, self.row, free=self._free, weights=weights)

    def _run(self, at: np.ndarray) -> Row:
        """Return the record of a run at unknowns."""
        key = tuple(at.tolist())
        if key not in self._rows:
            self._rows[key] = self._trial(at, *self._room)
        return self._rows[key]

    def _curves(self, row: Row, name: str) -> np.ndarray:
        """Return ``off`` or ``slope`` of a record where points take part, weighed."""
        parts = [self._weights[what] * np.array(curve, float)[self.part] for what, curve in row[name].items()]
        return np.asarray(np.nan_to_num(np.concatenate(parts)))

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
            return np.full(len(self._data.values) * int(self.part.sum()), _REFUSED)
        return self._eliminated(row)[0]

    def _differences(self, at: np.ndarray, size: float, sides: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
        """Return derivatives of the residual, and of the shift eliminated in it, by differences to some sides."""
        columns = []
        moved = []
        for unit in np.eye(len(at)):
            tried = [side for side in sides if not self._run(at + side * size * unit)["error"]]
            tried = tried or [side for side in (-1.0,) if not self._run(at + side * size * unit)["error"]]
            ends = [self._eliminated(self._run(at + side * size * unit)) for side in tried]
            if len(ends) < 2:
                ends.append(self._eliminated(self._run(at)))
                tried.append(0.0)
            width = (tried[0] - tried[1]) * size if len(tried) > 1 else np.inf
            columns.append((ends[0][0] - ends[-1][0]) / width)
            moved.append((ends[0][1] - ends[-1][1]) / width)
        return np.transpose(columns), np.array(moved)

    def least(self, most: int) -> Search:
        """Return a search that begins at a lower cost, after ``most`` runs beside those of the first derivatives."""
        last = (self.at, self._residual(self.at), self._differences(self.at, _COARSE, (1.0,))[0])
        if not last[2].any():  # no key changes the curves
            return self

        def derivatives(at: np.ndarray) -> np.ndarray:
            """Update those of the last accepted step by Broyden's formula."""
            nonlocal last
            here = self._residual(at)
            before, there, slopes = last
            step = at - before
            if step.any():
                slopes = slopes + np.outer(here - there - slopes @ step, step) / (step @ step)
            last = (at.copy(), here, slopes)
            return slopes

        found = least_squares(
            self._residual, self.at, derivatives, self._limits, ftol=_COST, xtol=_STEP, gtol=None, max_nfev=most
        )
        row = self._run(found.x)
        weights = self._weights
        return Search(self._trial, self._data, self._limits, found.x, row, free=self._free, weights=weights)

    def ended(self) -> Minimum:
        """Return the minimum, after last steps by Newton's method with derivatives that hold there."""
        at = ahead = self.at
        for _ in range(_ROUNDS):
            left = self._residual(at)
            (slopes, moved) = self._differences(at, _FINE, (1.0, -1.0))
            step, _, _, sizes = np.linalg.lstsq(slopes, -left, _UNDETERMINED)
            variance = float(left @ left) / max(len(left) - len(at) - self._free, 1)
            deviation = np.sqrt(variance) / max(float(sizes.min()), 1e-300)
            ahead = np.clip(at + step, *self._limits)
            if np.all(np.abs(ahead - at) <= max(_SHARE * deviation, _LEAST)):
                break
            if not np.sum(self._residual(ahead) ** 2) < np.sum(left**2):
                ahead = at
                break
            at = ahead
        row = self._run(at)
        shift = self._eliminated(row)[1] + float(moved @ (ahead - at))
        left = left + slopes @ (ahead - at)
        if self._free:
            turn = self._curves(row, "slope")
            slopes = np.column_stack([slopes - np.outer(turn, moved), turn])
        return Minimum(ahead, shift, row, self.part, _mean_square(row, self._data), left, slopes)


def _mean_square(row: Row, data: Measured) -> float:
    """Return the mean square of what is left in a record, over the spread of curves and the share of points."""
    off = np.array([row["off"][what] for what in data.values], float)
    spread = np.array([[data.spread(what)] for what in data.values])
    return float(np.nanmean((off / spread) ** 2) / np.isfinite(off).mean())
