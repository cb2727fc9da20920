"""The largest mean of the contact force of a run over windows of a length: the peak force of a rigid contact.

Over a step the force is the parabola through what it is at both rows with the step's impulse: the polynomial applied
also turns a mismatch of velocities round, and a window may hold a part of that.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from ..motion.curves import EPS, Curve
from ..motion.events import Event
from .contact_times import kicks
from .records import impulse

#: Impulses that differ by less than this share of the total are equal: well above rounding.
_ALIKE = 1e-13


def gained(steps: np.ndarray, events: Iterable[Event]) -> np.ndarray:
    """Return the impulse of the contact over each of ``steps`` and its events [N·s]."""
    return np.asarray(impulse(steps) + kicks(steps["time"], events))


def peak_force(steps: np.ndarray, events: Iterable[Event], window: float) -> tuple[float, float]:
    """Return the largest mean of C [N] over windows of ``window`` [s] in the run, and when the first of these begins.

    A run that is shorter is one window, without a force after it. An impact at the edge of a window belongs to it if
    that makes the mean larger.
    """
    rows = steps["time"]
    size = np.where(steps["size"] > 0.0, steps["size"], 1.0)[1:]
    ends = steps["contact_force_end"][1:], None, impulse(steps)[1:], None
    c, slope, bend = Curve.parabola([steps["contact_force_after"][:-1]], ends, size).powers
    # The impulse up to each row, including impacts there, and the powers of the time since then up to the next row;
    # before the run and after it there is no force.
    begins = np.append(rows[0] - 2.0 * window, rows)
    passed = np.zeros((4, len(begins)))
    passed[0, 1:] = np.cumsum(gained(steps, events))
    passed[1:, 1:-1] = c, slope / size / 2.0, bend / size**2 / 3.0

    def upto(times: np.ndarray, side: Literal["left", "right"], *orders: int) -> np.ndarray:
        """Return derivatives of ∫ C dt before the impulses of ``times`` [s] (left) or after them (right)."""
        row = np.searchsorted(begins, times, side) - 1
        since = times - begins[row]
        powers = passed[:, row]
        return np.array([polyval(since, polyder(powers, order), tensor=False) for order in orders])

    # Inside steps the mean is largest where C is the same at both edges of the window: between `edges` both forces are
    # of degree 2. The root of a τ² + b τ + c at which it falls is 2 c / (√(b² − 4 a c) − b), also where a is 0.
    edges = np.sort(np.concatenate([rows, rows - window]))
    half = 0.5 * np.diff(edges)
    middle = edges[:-1] + half
    c, b, twice_a = upto(middle + window, "right", 1, 2, 3) - upto(middle, "right", 1, 2, 3)
    with np.errstate(divide="ignore", invalid="ignore"):
        root = 2.0 * c / (np.sqrt(b**2 - 2.0 * twice_a * c) - b)
    turning = np.where(np.abs(root) < half, middle + root, edges[:-1])
    first = np.maximum(np.concatenate([rows - window, rows, turning]), rows[0])
    last = np.minimum(np.concatenate([rows, rows + window, turning + window]), rows[-1])
    # Where the ends pull at each other, a window that the run cuts short would have the larger mean.
    rounding = 4.0 * EPS * np.abs(rows).max()
    whole = last - first >= min(window, rows[-1] - rows[0]) - rounding
    first = first[whole]
    last = last[whole]
    (most,) = np.maximum(upto(last, "left", 0), upto(last, "right", 0))
    (least,) = np.minimum(upto(first, "left", 0), upto(first, "right", 0))
    gains = most - least
    largest = gains.max()
    since = first[gains >= largest - _ALIKE * np.abs(passed[0]).max()].min()  # of a constant force all are alike
    return max(0.0, float(largest)) / window, float(since)
