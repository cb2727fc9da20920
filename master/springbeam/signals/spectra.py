"""Power spectra of the curves of a run, by Welch's method."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.signal import welch

from ..results.trajectory import Trajectory
from .sampled import sampled


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
    samples = sampled(run, what, since=since)
    values = samples.values
    length = max(2, 2 * len(values) // (segments + 1))
    shared = {"fs": 1.0 / samples.step, "window": "hann", "nperseg": length, "detrend": "constant"}
    frequency, density = welch(values, scaling="density", **shared)
    _, squares = welch(values, scaling="spectrum", **shared)
    return PowerSpectrum(frequency, density, np.sqrt(2.0 * squares))
