"""The peak contact force of the steps, polynomials over time, beside that of a soft law along the path of the ends."""

from __future__ import annotations

from math import ceil
from typing import Any

import numpy as np

from ...motion.paths import derivative, value
from ...scene.laws import SoftLaw
from .records import StepRecords, penetration

#: Number of samples of the law in a window, and in a step.
_IN_A_WINDOW = 100
_IN_A_STEP = 8
#: The most samples of all.
_MOST = 10_000


def peak_beside_law(law: SoftLaw, records: np.ndarray, peak: float, window: float, begins: float) -> float:
    """Return by how much a peak contact force differs from that of a soft ``law``, relative to the larger one.

    The path of the ends inside a step has a higher order than the force of the step. So runs with steps that are longer
    than the window may all miss the peak, and this shows it.

    Parameters
    ----------
    law
        The contact law.
    records
        Of the run (`springbeam.results.records.STEP`).
    peak
        The largest mean of the contact force of the steps over a window [N].
    window
        Length of a window [s].
    begins
        When that of the peak begins [s].
    """
    steps = StepRecords.of(records)
    # Windows near it: in the steps that it lies in, or that windows beside it lie in.
    first = np.searchsorted(steps.ends["time"][:-1], begins - window, "right")
    last = np.searchsorted(steps.before["time"][1:], begins + 2.0 * window, "left")
    near = steps.among(slice(first, last + 1))
    starts = near.before["time"]
    ends = near.ends["time"]
    low = float(starts[0])
    high = float(ends[-1])
    points = max(_IN_A_WINDOW, ceil(_IN_A_STEP * window / float(near.size.max())))
    times = np.linspace(low, high, min(ceil(points * (high - low) / window), _MOST) + 1)
    step = np.minimum(np.searchsorted(ends, times), len(ends) - 1)
    share = (times - starts[step]) / near.size[step]
    path: Any = penetration(near)[:, step]
    deep = np.asarray(value(path, share)).tolist()
    rates = np.asarray(value(derivative(path), share) / near.size[step]).tolist()
    force = np.array([law.force(*there) for there in zip(deep, rates, strict=True)])
    impulse = np.append(0.0, np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(times)))
    firsts = np.append(times[times < high - window], high - window)
    found = float((np.interp(firsts + window, times, impulse) - np.interp(firsts, times, impulse)).max()) / window
    return abs(found - peak) / max(found, peak)
