"""What the spectra of a run show, all together: for the command ``spectrum``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..results.trajectory import Trajectory
from ..scene import SceneError
from .driven import Response, Settled, drive_of, poincare, responses, settled
from .expressions import Expression
from .shock import ShockSpectrum, ends_of, largest_jump, shock_of_run, without_peak
from .spectra import PowerSpectrum, power_spectrum

#: Oscillators of a shock spectrum in an octave.
_PER_OCTAVE = 12
#: Macro steps in a period of the fastest oscillator, and periods of the slowest in the run.
_STEPS, _PERIODS = 20.0, 1.0


@dataclass(frozen=True)
class Spectra:
    """Spectra of a run by what they are of."""

    shock: Mapping[str, ShockSpectrum]  #: by the end, "tip" or "spring"
    jumps: Mapping[str, float]  #: largest jump of each end's velocity [m/s]
    power: Mapping[str, PowerSpectrum]
    without_peak: Mapping[str, str]  #: why signals with accelerations of rigid impacts have no peak
    responses: Mapping[str, list[Response]]  #: to each chirp
    points: tuple[np.ndarray, np.ndarray] | None  #: `poincare` once a period of the drive
    settled: Settled | None
    driven: bool
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
        elif self.driven:
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
        Columns, or formulas of columns, whose power is asked for; without any, tip and spring top.
    low, high
        Frequencies of the shock spectra [Hz]; from one period in the run to a period of 20 mean steps.
    quality
        Q of their oscillators.
    since
        When the power spectra begin [s]; where the motion has settled, if it has.
    segments
        As of `power_spectrum`.

    Raises SceneError for what the run does not have.
    """
    if run.steps is None:
        raise SceneError("the run left no steps: it is by a reference, or by law 'paper', and has no curve to sample")
    duration, tail, drive = float(run.time[-1] - run.time[0]), settled(run), drive_of(run)
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
        without_peak={what: why for what in wanted if (why := without_peak(run, Expression(what).names))},
        responses={what: found for what in wanted if (found := responses(run, what))},
        points=poincare(run, 1.0 / drive.frequency, drive.start) if drive and drive.frequency else None,
        settled=tail,
        driven=drive is not None,
        quality=quality,
    )
