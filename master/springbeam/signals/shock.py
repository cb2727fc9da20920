"""Shock response spectra: of a velocity, of an acceleration that was recorded, of the ends of a run.

An oscillator of frequency f = ω/2π and quality Q = 1/2ζ answers the acceleration a of its base with its own,

    ẍ = H a,    H(s) = (2ζω s + ω²)/(s² + 2ζω s + ω²) = r/(s − p) + r*/(s − p*),

and its spectrum is the largest ẍ (positive), the largest −ẍ (negative), or the larger of the two (maximax), while the
base moves and after it. Between samples the base follows a polygon, of the acceleration (ISO 18431-4, the
ramp-invariant filter of D. O. Smallwood, Shock Vib. Bull. 51, 1981) or of the velocity. There ẍ = 2 Re(r w) with
ẇ = p w + a is known at every time, not only at samples, so that no peak is missed between two of them. A rigid impact
is a jump of velocity, of which the acceleration is no number; for the same reason a spectrum that has one rises with f
without limit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss

from ..results.trajectory import Trajectory
from ..scene import Scene, SceneError
from .curves import sampled

#: Places in a period of an oscillator at which it is evaluated: a peak is missed by up to 1 − cos(π/64), 0.12 %.
_PER_PERIOD = 64
#: Oscillators of a shock spectrum in an octave.
_PER_OCTAVE = 12
#: Velocities of the ends of a run.
VELOCITIES = {"tip": "v_tip", "spring": "z"}
#: A record has no more than this share of its sampling rate to be certain (ISO 18431-4).
CERTAIN = 0.1
#: Nodes of the quadrature of a load between two times at which it is smooth, and radians of an oscillation between two.
_NODES = 8
_RADIANS = 2.0
#: Times between which loads are integrated at once.
_TOGETHER = 100_000
#: Nodes of a quadrature that is exact to rounding for eˣˢ, |x| < π.
_OF_EXPONENTIAL = 12


class ShockSpectrum(NamedTuple):
    """Largest accelerations by frequency, shape (n,), in the unit of the acceleration of the base."""

    frequency: np.ndarray  #: of the oscillators [Hz]
    maximax: np.ndarray
    positive: np.ndarray
    negative: np.ndarray  #: not below 0


def frequencies_between(low: float, high: float) -> np.ndarray:
    """Return frequencies of oscillators [Hz], 12 to an octave. Raises SceneError unless they rise from above 0."""
    if not 0.0 < low < high:
        raise SceneError(f"from {low:g} to {high:g} Hz: frequencies rise from above 0")
    return np.geomspace(low, high, 1 + int(np.ceil(_PER_OCTAVE * np.log2(high / low))))


def shock_spectrum(velocity: np.ndarray, step: float, frequencies: np.ndarray, quality: float = 10.0) -> ShockSpectrum:
    """Return the shock response spectrum of a base whose velocity is linear between samples.

    Parameters
    ----------
    velocity
        Of the base at equal steps [m/s], shape (n,); before the first sample it has its value, after the last too.
    step
        [s]
    frequencies
        Of the oscillators [Hz], shape (m,), above 0 and below half a sample each.
    quality
        Q above 1/2.

    Raises SceneError for other frequencies and qualities.
    """
    mean = np.diff(velocity) / step
    return _spectrum(mean, mean, step, frequencies, quality)


def shock_of_record(
    acceleration: np.ndarray, step: float, frequencies: np.ndarray, quality: float = 10.0
) -> ShockSpectrum:
    """Return the shock response spectrum of a base whose acceleration is linear between samples, and 0 outside.

    Parameters are those of `shock_spectrum`. Above `CERTAIN` times the sampling rate it depends on what the base did
    between the samples.
    """
    return _spectrum(acceleration[:-1], acceleration[1:], step, frequencies, quality)


def _spectrum(
    begin: np.ndarray, end: np.ndarray, step: float, frequencies: np.ndarray, quality: float
) -> ShockSpectrum:
    """Return the spectrum of an acceleration that goes linearly from ``begin`` to ``end`` in each step, shapes (n,)."""
    frequencies = np.atleast_1d(np.asarray(frequencies, dtype=float))
    if not (quality > 0.5 and np.isfinite(quality)):
        raise SceneError(f"quality {quality:g}: must be above 0.5, the quality of an oscillator that does not swing")
    if not ((frequencies > 0.0) & (frequencies * step < 0.5)).all():
        raise SceneError(f"frequencies: must lie between 0 and half the sampling rate, {0.5 / step:g} Hz")
    ends = [_extremes(begin, end, step, frequency, quality) for frequency in frequencies]
    negative, positive = np.maximum(np.transpose(ends) * [[-1.0], [1.0]], 0.0)
    return ShockSpectrum(frequencies, np.maximum(positive, negative), positive, negative)


def _extremes(begin: np.ndarray, end: np.ndarray, step: float, frequency: float, quality: float) -> tuple[float, float]:
    """Return the lowest and highest ẍ while the base moves and in the period after it."""
    from scipy.signal import lfilter  # takes half a second to load: only for spectra

    omega = 2.0 * np.pi * frequency
    zeta = 0.5 / quality
    pole = omega * complex(-zeta, np.sqrt(1.0 - zeta**2))
    residue = (2.0 * zeta * omega * pole + omega**2) / complex(0.0, 2.0 * pole.imag)
    rise = end - begin

    def moved(share: float) -> tuple[complex, complex, complex]:
        """Return what w, the acceleration at its begin and its change become in a ``share`` of a step."""
        x = pole * share * step
        return complex(np.exp(x)), complex(np.expm1(x) / pole), share * share * step * _phi_2(x)

    decay, of_begin, of_rise = moved(1.0)
    after = lfilter([1.0], [1.0, -decay], of_begin * begin + of_rise * rise)
    before = np.append(0.0, after[:-1])
    places = int(np.ceil(_PER_PERIOD * frequency * step))
    answers = [0.0]
    for place in range(1, places + 1):
        decay, of_begin, of_rise = moved(place / places)
        answer = 2.0 * (residue * (decay * before + of_begin * begin + of_rise * rise)).real
        answers += [float(answer.min()), float(answer.max())]
    # Then it swings freely, ẍ = Re(z e^{pt}), with extremes where Re(p z e^{pt}) = 0: two of each period count.
    z = 2.0 * residue * complex(after[-1])
    first = (0.5 * np.pi - np.angle(pole * z)) % np.pi / pole.imag
    answers += [(z * np.exp(pole * time)).real for time in (first, first + np.pi / pole.imag)]
    return min(answers), max(answers)


def _phi_2(x: complex) -> complex:
    """Return (eˣ − 1 − x)/x² = ∫₀¹ (1 − s) eˣˢ ds, to rounding for the |x| < π of an oscillator between two samples."""
    nodes, weights = leggauss(_OF_EXPONENTIAL)
    return complex(weights @ ((1.0 - nodes) * np.exp(0.5 * x * (1.0 + nodes)))) / 4.0


def shock_of_run(run: Trajectory, end: str, frequencies: np.ndarray, quality: float = 10.0) -> ShockSpectrum:
    """Return the shock response spectrum at an ``end`` of a run, ``"tip"`` or ``"spring"``, or of its ``"base"``.

    The motion is that in space: where the base accelerates, its velocity is added. Steps are no longer than those of
    the run.
    """
    duration = float(run.time[-1] - run.time[0])
    step = min(min(1.0 / float(np.max(frequencies)), duration) / _PER_PERIOD, duration / (len(run) - 1))
    times, velocity = sampled(run, VELOCITIES.get(end, "time"), step)
    of_base = base_velocity(run.scene, times)
    return shock_spectrum(velocity + of_base if end in VELOCITIES else of_base, step, frequencies, quality)


def base_velocity(scene: Scene, times: np.ndarray) -> np.ndarray:
    """Return the velocity that the loads on the base have given it since the first of ``times`` [s], shape (n,).

    Loads are integrated between the times at which they are smooth, so that a pulse counts however short it is.
    """
    velocity = np.zeros(len(times))
    nodes, weights = leggauss(_NODES)
    for load in scene.loads:
        if load.on != "base":
            continue
        edges = np.union1d(times, [edge for edge in load.edges if times[0] < edge < times[-1]])
        if load.rate > 0.0:
            parts = int(np.ceil(load.rate * float(np.diff(edges).max()) / _RADIANS))
            edges = np.interp(np.arange((len(edges) - 1) * parts + 1) / parts, np.arange(len(edges)), edges)
        half = 0.5 * np.diff(edges)
        gained = [
            half[some] * (load.value(edges[:-1][some, None] + half[some, None] * (1.0 + nodes)) @ weights)
            for some in (slice(k, k + _TOGETHER) for k in range(0, len(half), _TOGETHER))
        ]
        velocity += np.append(0.0, np.cumsum(np.concatenate(gained)))[np.searchsorted(edges, times)]
    return velocity
