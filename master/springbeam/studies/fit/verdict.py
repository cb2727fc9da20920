"""Whether measured data determines the values that a search has found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri, fdtri

from ...signals.measured import correlated
from ..tables import Row
from .least import SHIFT

#: Chance that what is called no noise is noise.
_CHANCE = 1e-3
#: Lags of the autocorrelation that are judged, and the fewest points of which they can be.
_LAGS = 20
_FEWEST = 12
#: What is left of a curve, over its spread: no more than this is rounding of a search, no less than that is no fit.
_ROUNDING = 1e-9
_APART = 0.5
#: An error of the run itself is at most so many times what shorter steps change.
OWN = 4.0
#: A key is not determined if its interval is wider than this factor to each side.
_WIDE = 2.0


class Left(NamedTuple):
    """What is left of a curve at the values found."""

    off: np.ndarray  #: run less measurement, shape (n,)
    rms: float
    share: float  #: ``rms`` over the spread of what was measured
    own: float = 0.0  #: rms of what shorter steps change
    noise: float | None = None  #: rms of the noise, by a measurement that was repeated
    free: float = 1.0  #: how many independent points of noise there are


class Found(NamedTuple):
    """The values found, and the evidence that the data determines them."""

    keys: list[Row]  #: ``key``, ``value``, ``low`` and ``high`` of its interval
    ranges: Mapping[str, tuple[float, float]]  #: in which keys were sought
    left: Mapping[str, Left]  #: by curve
    alike: Sequence[str]  #: which unknowns change nothing, or the curves in the same way
    rivals: Sequence[Row]  #: values elsewhere in the ranges that fit as well
    ended: bool  #: whether no further step of the search would gain anything
    shift: float  #: of the clock in the run at these values [s]


def undetermined(found: Found) -> list[str]:
    """Return why keys are not determined by the data; nothing if they are.

    They are determined if the search has ended in a minimum, what is left of every curve is noise (no more than half of
    its spread, and white, or as large as the noise of a repeated measurement) or an error of the run itself, no other
    start in their ranges has led to values that fit as well, and every interval lies inside its range and within a
    factor of two of its value.
    """
    why = [f"{name}: {doubt}" for name, left in found.left.items() if (doubt := no_noise(left))]
    if found.ended:
        why += found.alike
    for rival in found.rivals:
        values = ", ".join(f"{name} = {value:.5g}" for name, value in rival.items())
        why.append(f"{values} fits as well; measure another curve, or give a narrower range")
    any_wide = False
    for row in found.keys:
        name, value, low, high = row.values()
        if low is None or name == SHIFT:
            continue
        least, most = found.ranges[name]
        if max(abs(high), abs(low)) > _WIDE * abs(value) or min(abs(high), abs(low)) < abs(value) / _WIDE:
            any_wide = True
            why.append(f"{name} may be anything from {low:.3g} to {high:.3g}")
        elif low <= least or high >= most:
            why.append(
                f"{name}: its interval reaches the end of the range from {least:g} to {most:g}; give another range, "
                f"as --vary {name}={least:g}:{most:g}"
            )
    if not found.ended and not any_wide:  # in a valley that wide, its end is of no interest
        why.append("the search has not ended in a minimum; give a narrower range")
    return why


def no_noise(left: Left) -> str:
    """Return why what is left of a curve is no noise; nothing if it is, or no larger than the error of the run."""
    if left.share <= _ROUNDING or (left.share <= _APART and left.rms <= OWN * left.own):
        return ""
    if left.noise is not None:
        if left.rms**2 <= left.noise**2 * float(fdtri(left.free, left.free, 1.0 - _CHANCE)):
            return ""
        return f"what is left is {left.rms / left.noise:.3g} times the noise of the repeated measurement"
    if left.share > _APART:
        return f"what is left is {left.share:.0%} of its spread; the curves do not agree"
    if len(left.off) < _FEWEST:
        return f"{len(left.off)} points are too few to decide whether the residual is noise; --repeat a measurement"
    if not is_white(left.off):
        return (
            f"what is left ({left.share:.2g} of its spread) is no noise: it remembers its past; something else in the "
            "scene is wrong, or --repeat shows that the noise does so"
        )
    return ""


def is_white(off: np.ndarray) -> bool:
    """Return whether a series does not remember its past, by Ljung and Box (1978) at a level of 1e-3.

    A short series is not called white.
    """
    if len(off) < _FEWEST:
        return False
    lags = min(_LAGS, len(off) // 4)
    size = len(off) - 1.0 - np.arange(lags)
    statistic = len(off) * (len(off) + 2.0) * float(np.sum(_autocorrelation(off)[1 : lags + 1] ** 2 / size))
    return statistic <= float(chdtri(lags, _CHANCE))


def remembered(off: np.ndarray) -> float:
    """Return how many points of a series count as one: 1 + 2 Σ ρ up to the first ρ that is not positive."""
    past = _autocorrelation(off)[1:]
    end = int(np.argmax(past <= 0.0)) if (past <= 0.0).any() else len(past)
    return 1.0 + 2.0 * float(past[:end].sum())


def _autocorrelation(off: np.ndarray) -> np.ndarray:
    centred = off - off.mean()
    sums = correlated(centred, centred)[len(off) - 1 :]
    return sums / max(float(sums[0]), 1e-300)
