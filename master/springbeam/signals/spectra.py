"""Spectra of a run: power of its curves by Welch's method, shock response of its ends (`shock`), settled motion."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..results.trajectory import Trajectory
from ..scene import SceneError
from .curves import sampled
from .driven import Response, Settled, drive_of, not_repeating, poincare, responses, settled, strobe
from .shock import VELOCITIES, ShockSpectrum, frequencies_between, shock_of_run

#: A jump of velocity below this share of the largest speed is negligible.
_JUMP = 1e-3
#: Velocities that accelerations are the rates of.
_ACCELERATIONS = {"a_tip": "v_tip", "a_y": "z"}
#: Macro steps in a period of the fastest oscillator, and periods of the slowest in the run.
_STEPS = 20.0
_PERIODS = 1.0


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
    times, values = sampled(run, what, since=since)
    return power_of(values, float(times[1] - times[0]), segments)


def power_of(values: np.ndarray, step: float, segments: int = 1) -> PowerSpectrum:
    """Return the spectrum of ``values`` at equal steps [s], shape (n,), without their mean."""
    from scipy.signal import welch  # takes half a second to load: only for spectra

    length = max(2, 2 * len(values) // (segments + 1))
    shared = {"fs": 1.0 / step, "window": "hann", "nperseg": length, "detrend": "constant"}
    frequency, density = welch(values, scaling="density", **shared)
    _, squares = welch(values, scaling="spectrum", **shared)
    return PowerSpectrum(frequency, density, np.sqrt(2.0 * squares))


def ends_of(run: Trajectory) -> dict[str, str]:
    """Return the ends of a run, ``"tip"`` and ``"spring"``, and the columns of their velocities."""
    return {end: column for end, column in VELOCITIES.items() if column in run.columns}


def _shocked(run: Trajectory) -> list[str]:
    """Return what of a run has a shock spectrum: its ends, and a base that loads accelerate."""
    return [*ends_of(run), *["base"] * any(load.on == "base" and load.begins > -np.inf for load in run.scene.loads)]


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


@dataclass(frozen=True, kw_only=True)
class Spectra:
    """Spectra of a run, or of records, by signal."""

    shock: Mapping[str, ShockSpectrum]  #: by the end, "tip" or "spring", and of the "base"; or by the record
    power: Mapping[str, PowerSpectrum]
    quality: float
    recorded: Mapping[str, float] = field(default_factory=dict)  #: largest acceleration of each record [m/s²]
    jumps: Mapping[str, float] = field(default_factory=dict)  #: largest jump of each end's velocity [m/s]
    #: Why signals with accelerations of rigid impacts have no peak.
    without_peak: Mapping[str, str] = field(default_factory=dict)
    responses: Mapping[str, list[Response]] = field(default_factory=dict)  #: to each chirp
    points: tuple[np.ndarray, np.ndarray] | None = None  #: `poincare` once a period of the drive, if there is one
    settled: Settled | None = None

    def in_words(self, unit: str = "m/s²", size: float = 1.0) -> Iterator[tuple[str, str]]:
        """Yield what is found, and how much; accelerations in a ``unit`` of a ``size`` [m/s²]."""
        for end, spectrum in self.shock.items():
            at = int(np.argmax(spectrum.maximax))
            peak = f"{spectrum.maximax[at] / size:.4g} {unit} at {spectrum.frequency[at]:.4g} Hz, Q = {self.quality:g}"
            if end in self.recorded:
                yield f"shock of {end}", f"{peak} (record: {self.recorded[end] / size:.4g})"
            else:
                yield f"shock at the {end}", peak
            if self.jumps.get(end):
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
            yield "motion", not_repeating(len(self.points[0]))


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
    frequencies = frequencies_between(low, high)
    begin = since if since is not None or tail is None else tail.since
    wanted = of or [name for name in ("u_tip", "y") if name in run.columns]
    return Spectra(
        shock={end: shock_of_run(run, end, frequencies, quality) for end in _shocked(run)},
        jumps={end: largest_jump(run, column) for end, column in ends_of(run).items()},
        power={what: power_spectrum(run, what, begin, segments) for what in wanted},
        without_peak={what: why for what in wanted if (why := without_peak(run, [what]))},
        responses={what: several for what in wanted if (several := responses(run, what))},
        points=poincare(run, 1.0 / drive.frequency, strobe(run, drive)) if drive else None,
        settled=tail,
        quality=quality,
    )
