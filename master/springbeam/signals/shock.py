"""Shock response spectra: the largest accelerations of oscillators whose base moves as an end of a run does.

An oscillator of frequency f = ω/2π and quality Q = 1/2ζ answers the acceleration a of its base with its own,

    ẍ = H a,    H(s) = (2ζω s + ω²)/(s² + 2ζω s + ω²),

and its spectrum is the largest ẍ (positive), the largest −ẍ (negative), or the larger of the two (maximax), while the
base moves and after it. The base is given by its velocity, linear between samples: D. O. Smallwood's ramp-invariant
filter (Shock Vib. Bull. 51, 1981) for s H(s). An impact is a jump of velocity, which is one more sample of that line;
its acceleration would be no number. For the same reason a spectrum that has a jump rises with f without limit.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from scipy.signal import cont2discrete, lfilter

from ..results.trajectory import Trajectory
from ..scene import SceneError
from .spectra import sampled

#: Samples in a period of the fastest oscillator: a peak between two of them is missed by 1 − cos(π/64), 0.12 %.
_PER_PERIOD = 64
#: A jump of velocity below this share of the largest speed is none to speak of.
_JUMP = 1e-3
#: The velocities whose shock is asked for, and the accelerations that they are the integrals of.
VELOCITIES = {"tip": "v_tip", "spring": "z"}
_ACCELERATIONS = {"a_tip": "v_tip", "a_y": "z"}


class ShockSpectrum(NamedTuple):
    """Largest accelerations by frequency, shape (n,)."""

    frequency: np.ndarray  #: of the oscillators [Hz]
    maximax: np.ndarray  #: [m/s²]
    positive: np.ndarray  #: [m/s²]
    negative: np.ndarray  #: [m/s²], not below 0


def shock_spectrum(velocity: np.ndarray, step: float, frequencies: np.ndarray, quality: float = 10.0) -> ShockSpectrum:
    """Return the shock response spectrum of a base.

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
    frequencies = np.atleast_1d(np.asarray(frequencies, dtype=float))
    if not (quality > 0.5 and np.isfinite(quality)):
        raise SceneError(f"quality {quality:g}: must be above 0.5, the quality of an oscillator that does not swing")
    if not ((frequencies > 0.0) & (frequencies * step < 0.5)).all():
        raise SceneError(f"frequencies: must lie between 0 and half the sampling rate, {0.5 / step:g} Hz")
    answers = (_answer(velocity, step, f, quality) for f in frequencies)
    highest, lowest = np.maximum([(answer.max(), -answer.min()) for answer in answers], 0.0).T
    return ShockSpectrum(frequencies, np.maximum(highest, lowest), highest, lowest)


def _answer(velocity: np.ndarray, step: float, frequency: float, quality: float) -> np.ndarray:
    """Return ẍ, up to one period after the base has come to its last velocity."""
    omega = 2.0 * np.pi * frequency
    after = np.full(int(np.ceil(1.0 / (frequency * step))) + 1, velocity[-1])
    of_velocity = (omega / quality, omega**2, 0.0), (1.0, omega / quality, omega**2)  # s H(s)
    numerator, denominator, _ = cont2discrete(of_velocity, step, "foh")
    return np.asarray(lfilter(numerator[0], denominator, np.concatenate([velocity, after]) - velocity[0]))


def shock_of_run(run: Trajectory, end: str, frequencies: np.ndarray, quality: float = 10.0) -> ShockSpectrum:
    """Return the shock response spectrum at an ``end`` of a run, ``"tip"`` or ``"spring"``.

    The motion is that in space: where the base accelerates, its velocity is added.
    """
    if end not in (ends := ends_of(run)):
        raise SceneError(f"{end}: no end of this run; it has {', '.join(ends)}")
    step = min(1.0 / np.max(frequencies), run.time[-1] - run.time[0]) / _PER_PERIOD
    times, velocity = sampled(run, ends[end], float(step))
    middle = times[:-1] + 0.5 * step
    of_base = sum((load.value(middle) for load in run.scene.loads if load.on == "base"), np.zeros(len(middle)))
    return shock_spectrum(velocity + np.append(0.0, step * np.cumsum(of_base)), float(step), frequencies, quality)


def ends_of(run: Trajectory) -> dict[str, str]:
    """Return the ends of a run, ``"tip"`` and ``"spring"``, and the columns of their velocities."""
    return {end: column for end, column in VELOCITIES.items() if column in run.columns}


def without_peak(run: Trajectory, columns: Iterable[str]) -> str:
    """Return which of ``columns`` are accelerations that rigid impacts leave without a peak; "" if none is."""
    jumps = {name: largest_jump(run, _ACCELERATIONS[name]) for name in columns if name in _ACCELERATIONS}
    return "; ".join(
        f"{name} has no peak: a rigid impact changes {_ACCELERATIONS[name]} by {jump:.3g} m/s at once. "
        'contact.law = "compliance" is not rigid'
        for name, jump in jumps.items()
        if jump
    )


def largest_jump(run: Trajectory, column: str) -> float:
    """Return the largest jump of a velocity at an event [m/s], 0 if there is none to speak of."""
    if (steps := run.steps) is None:
        return 0.0
    before, after = steps[column], steps[f"{column}_after"]
    ending = (steps["size"] > 0.0) & (np.diff(steps["events"], prepend=0.0) > 0.0)
    jumps = np.abs(after - before)[ending | (steps["size"] == 0.0)]
    largest = float(jumps.max(initial=0.0))
    return largest if largest > _JUMP * float(np.abs(after).max()) else 0.0
