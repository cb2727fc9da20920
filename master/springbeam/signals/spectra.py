"""Spectra of a run: power of its curves by Welch's method, shock response of its ends.

Shock: an oscillator of frequency f = ω/2π and quality Q = 1/2ζ answers the acceleration a of its base with its own,

    ẍ = H a,    H(s) = (2ζω s + ω²)/(s² + 2ζω s + ω²),

and its spectrum is the largest ẍ (positive), the largest −ẍ (negative), or the larger of the two (maximax), while the
base moves and after it. The base is given by its velocity, linear between samples: D. O. Smallwood's ramp-invariant
filter (Shock Vib. Bull. 51, 1981) for s H(s). An impact is a jump of velocity, which is one more sample of that line;
its acceleration would be no number. For the same reason a spectrum that has a jump rises with f without limit.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..results.dense import rows_at
from ..results.trajectory import Trajectory
from ..scene import SceneError
from .curves import signal
from .driven import Response, Settled, drive_of, poincare, responses, settled

#: Largest number of samples of a run.
MOST = 4_000_000
#: Samples in a period of the fastest oscillator: a peak between two of them is missed by 1 − cos(π/64), 0.12 %.
_PER_PERIOD = 64
#: A jump of velocity below this share of the largest speed is negligible.
_JUMP = 1e-3
#: Velocities for shock spectra, and their accelerations.
VELOCITIES = {"tip": "v_tip", "spring": "z"}
_ACCELERATIONS = {"a_tip": "v_tip", "a_y": "z"}
#: Oscillators of a shock spectrum in an octave.
_PER_OCTAVE = 12
#: Macro steps in a period of the fastest oscillator, and periods of the slowest in the run.
_STEPS = 20.0
_PERIODS = 1.0


def sampled(
    run: Trajectory, what: str, step: float | None = None, since: float | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return equal steps of time from ``since`` [s] on, and a column of ``run``, or a function of it, at these.

    They are ``step`` [s] long; without that there are as many as rows. Values lie on the curve of the run between its
    rows (`springbeam.Trajectory.at`). Raises SceneError where there is nothing to sample.
    """
    begin = float(run.time[0]) if since is None else since
    end = float(run.time[-1])
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
    """Return the spectrum of a column, or of a function of the run, without its mean.

    Parameters
    ----------
    since
        From when on [s].
    segments
        Parts into which the record is cut, half over each other; the spectra of more parts are averaged, which takes
        noise away and blurs lines.

    Raises SceneError where there is nothing to sample.
    """
    from scipy.signal import welch  # takes half a second to load: only for spectra

    times, values = sampled(run, what, since=since)
    length = max(2, 2 * len(values) // (segments + 1))
    shared = {"fs": 1.0 / (times[1] - times[0]), "window": "hann", "nperseg": length, "detrend": "constant"}
    frequency, density = welch(values, scaling="density", **shared)
    _, squares = welch(values, scaling="spectrum", **shared)
    return PowerSpectrum(frequency, density, np.sqrt(2.0 * squares))


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
    from scipy.signal import cont2discrete, lfilter  # see `power_spectrum`

    omega = 2.0 * np.pi * frequency
    after = np.full(int(np.ceil(1.0 / (frequency * step))) + 1, velocity[-1])
    of_velocity = (omega / quality, omega**2, 0.0), (1.0, omega / quality, omega**2)  # s H(s)
    numerator, denominator, _ = cont2discrete(of_velocity, step, "foh")
    return np.asarray(lfilter(numerator[0], denominator, np.concatenate([velocity, after]) - velocity[0]))


def shock_of_run(run: Trajectory, end: str, frequencies: np.ndarray, quality: float = 10.0) -> ShockSpectrum:
    """Return the shock response spectrum at an ``end`` of a run, ``"tip"`` or ``"spring"``.

    The motion is that in space: where the base accelerates, its velocity is added.
    """
    step = min(1.0 / np.max(frequencies), run.time[-1] - run.time[0]) / _PER_PERIOD
    times, velocity = sampled(run, VELOCITIES[end], float(step))
    middle = times[:-1] + 0.5 * step
    of_base = sum((load.value(middle) for load in run.scene.loads if load.on == "base"), np.zeros(len(middle)))
    return shock_spectrum(velocity + np.append(0.0, step * np.cumsum(of_base)), float(step), frequencies, quality)


def ends_of(run: Trajectory) -> dict[str, str]:
    """Return the ends of a run, ``"tip"`` and ``"spring"``, and the columns of their velocities."""
    return {end: column for end, column in VELOCITIES.items() if column in run.columns}


def without_peak(run: Trajectory, columns: Iterable[str]) -> str:
    """Return which of ``columns`` are accelerations without a peak because of rigid impacts; "" if none is."""
    jumps = {name: largest_jump(run, _ACCELERATIONS[name]) for name in columns if name in _ACCELERATIONS}
    return "; ".join(
        f"{name} has no peak: a rigid impact changes {_ACCELERATIONS[name]} by {jump:.3g} m/s at once. "
        'contact.law = "compliance" is not rigid'
        for name, jump in jumps.items()
        if jump
    )


def largest_jump(run: Trajectory, column: str) -> float:
    """Return the largest jump of a velocity at an event [m/s], 0 if it is negligible."""
    if (steps := run.steps) is None:
        return 0.0
    before = steps[column]
    after = steps[f"{column}_after"]
    ending = (steps["size"] > 0.0) & (np.diff(steps["events"], prepend=0.0) > 0.0)
    jumps = np.abs(after - before)[ending | (steps["size"] == 0.0)]
    largest = float(jumps.max(initial=0.0))
    return largest if largest > _JUMP * float(np.abs(after).max()) else 0.0


@dataclass(frozen=True)
class Spectra:
    """Spectra of a run by signal."""

    shock: Mapping[str, ShockSpectrum]  #: by the end, "tip" or "spring"
    jumps: Mapping[str, float]  #: largest jump of each end's velocity [m/s]
    power: Mapping[str, PowerSpectrum]
    without_peak: Mapping[str, str]  #: why signals with accelerations of rigid impacts have no peak
    responses: Mapping[str, list[Response]]  #: to each chirp
    points: tuple[np.ndarray, np.ndarray] | None  #: `poincare` once a period of the drive, if there is one
    settled: Settled | None
    quality: float

    def in_words(self) -> Iterator[tuple[str, str]]:
        """Yield what is found, and how much."""
        for end, found in self.shock.items():
            at = int(np.argmax(found.maximax))
            peak = f"{found.maximax[at]:.4g} m/s² at {found.frequency[at]:.4g} Hz, Q = {self.quality:g}"
            yield f"shock at the {end}", peak
            if self.jumps[end]:
                jump = f"its velocity jumps by up to {self.jumps[end]:.4g} m/s"
                yield "", f"{jump}: the spectrum rises with frequency without limit, there is no peak acceleration"
        for what, power in self.power.items():
            line = power.frequency[1]
            yield f"power of {what}", f"highest at {power.highest:.5g} Hz, lines {line:.3g} Hz apart"
            if what in self.without_peak:
                yield "", f"of what lies between the impacts: {self.without_peak[what]}"
        for what, chirps in self.responses.items():
            for chirp in chirps:
                at = int(np.argmax(chirp.amplitude))
                largest = f"largest half range {chirp.amplitude[at]:.4g} at {chirp.frequency[at]:.5g} Hz"
                yield f"{what} to load {chirp.load}", f"{largest}, on the way {chirp.way}"
        if self.settled is not None:
            of = "the drive's" if self.settled.multiple == 1 else f"{self.settled.multiple} of the drive's"
            yield "motion", f"periodic from {self.settled.since:.6g} s on, period {self.settled.period:.6g} s, {of}"
        elif self.points is not None:
            yield "motion", "not periodic within the run: not settled yet, or chaotic"


def spectra(
    run: Trajectory,
    of: Sequence[str] = (),
    low: float | None = None,
    high: float | None = None,
    quality: float = 10.0,
    since: float | None = None,
    segments: int = 1,
) -> Spectra:
    """Return all spectra of a run.

    Parameters
    ----------
    of
        Columns, or functions of the run, for power spectra; by default tip and spring top.
    low, high
        Frequencies of the shock spectra [Hz]; from one period in the run to a period of 20 mean steps.
    quality
        Q of their oscillators.
    since
        When the power spectra begin [s]; where the motion has settled, if it has.
    segments
        As of `power_spectrum`.

    Raises SceneError for signals that the run does not have.
    """
    if run.steps is None:
        raise SceneError("the run left no steps: it is by a reference, and has no curve to sample")
    duration = float(run.time[-1] - run.time[0])
    tail = settled(run)
    drive = drive_of(run)
    low = _PERIODS / duration if low is None else low
    high = max(2.0 * low, (len(run) - 1) / duration / _STEPS) if high is None else high
    if not 0.0 < low < high:
        raise SceneError(f"from {low:g} to {high:g} Hz: frequencies rise from above 0")
    frequencies = np.geomspace(low, high, 1 + int(np.ceil(_PER_OCTAVE * np.log2(high / low))))
    begin = since if since is not None or tail is None else tail.since
    wanted = of or [name for name in ("u_tip", "y") if name in run.columns]
    return Spectra(
        shock={end: shock_of_run(run, end, frequencies, quality) for end in ends_of(run)},
        jumps={end: largest_jump(run, column) for end, column in ends_of(run).items()},
        power={what: power_spectrum(run, what, begin, segments) for what in wanted},
        without_peak={what: why for what in wanted if (why := without_peak(run, [what]))},
        responses={what: found for what in wanted if (found := responses(run, what))},
        points=poincare(run, 1.0 / drive.frequency, drive.start) if drive and drive.frequency else None,
        settled=tail,
        quality=quality,
    )
