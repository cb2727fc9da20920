"""Signals of a run, shock spectra, power spectra and settled motion, beside closed forms and integrals."""

import numpy as np
import pytest
from scipy.integrate import quad

from springbeam.signals.driven import repeating
from springbeam.signals.shock import shock_of_record, shock_spectrum

# -- columns and functions ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("count", "found"), [(31, (6, 3)), (30, None)])
def test_a_motion_repeats_itself_after_three_periods_if_it_does_so_eight_times(count, found):
    """24 periods of the drive after the first point that is within 1 % of the last ones in turn."""
    points = np.array([[0.3 * (k % 3), 0.5 + 0.004 * np.cos(k)] for k in range(count)])
    points[5, 1] = 0.53
    assert repeating(points) == found


@pytest.mark.parametrize("constants", [4, 5, 6, 8])
def test_what_is_left_of_a_transient_decides_whether_it_has_settled(constants):
    """A run of as many time constants has e^{-constants} of the range left: 1.8, 0.7, 0.25 and 0.03 %."""
    decaying = np.exp(-np.arange(400.0) * constants / 400.0)[:, None] * [1.0, 0.5]
    assert (repeating(decaying) is not None) == (np.exp(-constants) < 0.01)


# -- shock response spectra ---------------------------------------------------------------------------------------

#: Half-sine of 100 m/s² in 11 ms.
PEAK = 100.0
PULSE = 0.011


def half_sine_velocity(times):
    inside = np.clip(times, 0.0, PULSE)
    return PEAK * PULSE / np.pi * (1.0 - np.cos(np.pi * inside / PULSE))


def spectrum(frequencies, quality, step=PULSE / 4000.0):
    times = step * np.arange(round(1.2 * PULSE / step) + 1)
    return shock_spectrum(half_sine_velocity(times), step, np.asarray(frequencies), quality)


def duhamel(frequency, quality, time):
    """ẍ at ``time`` by the convolution of the pulse with the impulse response of H."""
    omega = 2.0 * np.pi * frequency
    zeta = 0.5 / quality
    swing = omega * np.sqrt(1.0 - zeta**2)

    def kernel(t):
        wave = 2.0 * zeta * omega * np.cos(swing * t) + omega**2 * (1.0 - 2.0 * zeta**2) / swing * np.sin(swing * t)
        return np.exp(-zeta * omega * t) * wave

    return quad(lambda s: PEAK * np.sin(np.pi * s / PULSE) * kernel(time - s), 0.0, min(time, PULSE), limit=400)[0]


@pytest.mark.parametrize(("frequency", "quality"), [(15.0, 10.0), (45.45, 2.0), (120.0, 50.0)])
def test_the_spectrum_is_that_of_duhamels_integral(frequency, quality):
    times = np.linspace(0.0, 1.2 * PULSE + 1.0 / frequency, 4001)[1:]
    answer = [duhamel(frequency, quality, t) for t in times[::40]]
    found = spectrum([frequency], quality)
    assert found.positive[0] == pytest.approx(max(answer), rel=2e-3)
    assert found.negative[0] == pytest.approx(-min(answer), rel=4e-3, abs=2e-3 * PEAK)
    assert found.maximax[0] == max(found.positive[0], found.negative[0])


@pytest.mark.parametrize("frequency", [0.01, 5.0, 10.0, 15.0, 24.0])
def test_the_spectrum_of_a_record_is_that_of_the_polygon_through_its_samples(frequency):
    """A record at 50 Hz, also resampled on its polygon at 50 kHz, where a sample is as good as a curve.

    Peaks between samples were missed: 0.96, 0.89 and 0.68 of the value at 5, 10 and 15 Hz.
    """
    record = np.random.default_rng(5).normal(size=101)
    fine = np.interp(np.arange(100_001) / 1000.0, np.arange(101), record)
    coarse, dense = (shock_of_record(values, 0.02 / n, frequency) for values, n in ((record, 1), (fine, 1000)))
    assert coarse[1:] == pytest.approx(np.array(dense[1:]), rel=1.3e-3)


def test_a_base_that_moves_on_steadily_is_no_shock():
    """Only its changes of velocity are: before the first sample and after the last it goes on as there."""
    steady = shock_spectrum(np.full(100, 7.0), 1e-3, np.array([20.0]))
    assert steady.maximax == pytest.approx(0.0, abs=1e-9)
