"""A run at equal steps of time, and power spectra of its curves by Welch's method."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.signal import welch

from ..results.dense import rows_at
from ..results.trajectory import Trajectory
from ..scene import SceneError
from .expressions import signal

#: Most samples that are taken of a run.
MOST = 4_000_000


def sampled(
    run: Trajectory, what: str, step: float | None = None, since: float | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return equal steps of time from ``since`` [s] on, and a column of ``run``, or a formula of columns, at these.

    They are ``step`` [s] long; without that there are as many as rows. Values lie on the curve of the run between its
    rows (`springbeam.Trajectory.at`). Raises SceneError where there is nothing to sample.
    """
    begin, end = float(run.time[0]) if since is None else since, float(run.time[-1])
    if not begin < end:
        raise SceneError(f"from {begin:g} s: the run ends at {end:g} s")
    count = int(np.count_nonzero(run.time >= begin)) if step is None else int((end - begin) / step * (1 + 1e-12)) + 1
    if not 2 <= count <= MOST:
        raise SceneError(
            f"{what}: {count:,} samples; there must be from 2 to {MOST:,}: take lower frequencies, or less of the run"
        )
    times = np.linspace(begin, end, count) if step is None else begin + step * np.arange(count)
    return times, signal(rows_at(run, np.minimum(times, end)), what)


class PowerSpectrum(NamedTuple):
    """Power of a signal by frequency, shape (n,)."""

    frequency: np.ndarray  #: [Hz]
    density: np.ndarray  #: unit of the signal squared over Hz; its integral is the variance
    amplitude: np.ndarray  #: of a sine at that frequency, in the unit of the signal

    @property
    def highest(self) -> float:
        """Return the frequency of the highest line but that of the mean [Hz]."""
        return float(self.frequency[1 + int(np.argmax(self.density[1:]))])


def power_spectrum(run: Trajectory, what: str, since: float | None = None, segments: int = 1) -> PowerSpectrum:
    """Return the spectrum of a column, or of a formula of columns, without its mean.

    Parameters
    ----------
    since
        From when on [s].
    segments
        Parts into which the record is cut, half over each other; the spectra of more parts are averaged, which takes
        noise away and blurs lines.

    Raises SceneError where there is nothing to sample.
    """
    times, values = sampled(run, what, since=since)
    length = max(2, 2 * len(values) // (segments + 1))
    shared = {"fs": 1.0 / (times[1] - times[0]), "window": "hann", "nperseg": length, "detrend": "constant"}
    frequency, density = welch(values, scaling="density", **shared)
    _, squares = welch(values, scaling="spectrum", **shared)
    return PowerSpectrum(frequency, density, np.sqrt(2.0 * squares))
