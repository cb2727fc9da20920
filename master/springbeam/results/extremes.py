"""The lowest and the highest value of a curve made of a polynomial a step, with their times."""

from __future__ import annotations

from math import comb
from typing import NamedTuple

import numpy as np

#: Degree of the polynomials.
_DEGREE = 5
#: From powers of s in [0, 1] to Bernstein coefficients: these enclose the polynomial, the outer two are its end values.
_BERNSTEIN = np.array(
    [[comb(i, k) / comb(_DEGREE, k) if k <= i else 0.0 for k in range(_DEGREE + 1)] for i in range(_DEGREE + 1)]
)
#: Bernstein coefficients on [0, ½] from those on [0, 1], by de Casteljau; turned about, those on [½, 1].
_FIRST_HALF = np.array(
    [[comb(i, k) / 2.0**i if k <= i else 0.0 for k in range(_DEGREE + 1)] for i in range(_DEGREE + 1)]
)
#: Values that differ by less than this share of the largest one are alike: well above what halving rounds off.
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
        low, high = int(np.argmin(values)), int(np.argmax(values))
        return cls(float(values[low]), float(times[low]), float(values[high]), float(times[high]))

    def beside(self, powers: np.ndarray, start: np.ndarray, size: np.ndarray) -> Extremes:
        """Return those of these values and of a curve.

        ``powers`` are the coefficients of 1, s … s⁵ of each step, shape (6, n); it begins at ``start`` [s] and has
        ``size`` [s], shapes (n,).
        """
        found = list(self)
        for place, sign in ((0, 1.0), (2, -1.0)):
            value, step, share = lowest(sign * powers, below=sign * self[place])
            if step >= 0:
                found[place : place + 2] = sign * value, float(start[step] + share * size[step])
        return Extremes(*found)


def lowest(powers: np.ndarray, below: float) -> tuple[float, int, float]:
    """Return the lowest value on [0, 1] of any of n polynomials, which one has it, and where.

    The number is -1 if none is lower than ``below``, but for rounding. Steps are halved as long as their Bernstein
    coefficients leave room for a value lower than the lowest one found.

    Parameters
    ----------
    powers
        Coefficients of 1, s … s⁵, shape (6, n).
    below
        A value that is known.
    """
    best, step, share = below, -1, 0.0
    coefficients = _BERNSTEIN @ powers
    number, begin = np.arange(coefficients.shape[1]), np.zeros(coefficients.shape[1])
    width, tolerance = 1.0, _ALIKE * float(np.abs(coefficients).max(initial=0.0))
    while number.size:
        ends = coefficients[-1]  # where it begins another one ends, or there is a row
        if ends.min() < best:
            at = int(np.argmin(ends))
            best, step, share = float(ends[at]), int(number[at]), float(begin[at]) + width
        room = coefficients.min(axis=0) < best - tolerance
        coefficients, number, begin, width = coefficients[:, room], number[room], begin[room], 0.5 * width
        coefficients = np.hstack([_FIRST_HALF @ coefficients, (_FIRST_HALF @ coefficients[::-1])[::-1]])
        number, begin = np.tile(number, 2), np.concatenate([begin, begin + width])
    return (best, step, share) if best < below - tolerance else (below, -1, 0.0)
