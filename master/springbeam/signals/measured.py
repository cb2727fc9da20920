"""Measured data (`springbeam.scene.recorded`) in the units of a run, and laid beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydantic import ValidationError
from scipy.optimize import minimize_scalar
from scipy.signal import argrelextrema, correlate, correlation_lags

from ..results.dense import rows_at
from ..results.trajectory import Trajectory, columns_of
from ..scene import ArgumentError, Scene, SceneError
from ..scene.recorded import Reading, Recorded
from .curves import check, signal

#: Most samples of a correlation.
_MOST = 200_000


class Measured(NamedTuple):
    """Measured curves: each belongs to a column of a run, or to a function of it."""

    time: np.ndarray  #: [s], shape (n,)
    values: dict[str, np.ndarray]  #: by column, in its unit, or function, shapes (n,)
    notes: list[str]  #: what was done to the data as it was read

    def covered(self, run: Trajectory, shift: float = 0.0, margin: float = 0.0) -> np.ndarray:
        """Return which points lie in the run, shape (n,), if the clock is moved by ``shift`` [s].

        Points nearer to the ends of the run than its share ``margin`` do not.
        """
        begin = float(run.time[0])
        end = float(run.time[-1])
        off = margin * (end - begin)
        times = self.time + shift
        return np.asarray((times >= begin + off) & (times <= end - off))


class Residual(NamedTuple):
    """How far a run is from a measured curve, where both are known."""

    signal: str
    points: int
    rms: float  #: in the unit of the signal
    relative: float  #: over the standard deviation of what was measured
    largest: float
    at: float  #: [s], in the time of the run


def read_measured(
    path: str | Path, scene: Scene, names: Mapping[str, str] | None = None, reading: Reading | None = None
) -> Measured:
    """Read a file of measurements.

    Parameters
    ----------
    path
        Of the file, whose first line names the columns.
    scene
        Says which columns a run has, and their units.
    names
        The column of a run, or ``module:function`` of it, by the column of the file, e.g. ``{"CH1": "a_tip"}``.
        Without any, columns that are called as those of a run belong to these. Others are left out.
    reading
        How the file is read.

    Raises SceneError, which names file, line and column, and what would be allowed.
    """
    path = Path(path)
    units = columns_of(scene)
    try:
        return _read(Recorded(path, reading), units, names or {})
    except OSError as error:
        raise SceneError(f"{path}: {error.strerror}") from error
    except ValueError as error:
        raise ArgumentError(f"{path}: {error}") from error


def _read(file: Recorded, units: Mapping[str, str], names: Mapping[str, str]) -> Measured:
    if not file.names:
        raise ValueError("the first line must name the columns, as in time [ms],acceleration [g]")
    there = file.names[1:]
    if wrong := [name for name in names if name not in there]:
        raise ValueError(f"--map {wrong[0]}: there are the columns {', '.join(there)}")
    wanted = names or {name: name for name in there if name in units and name != "phase"}
    if not wanted:
        raise ValueError(
            f"no column is called as one of the run ({', '.join(units)}); --map NAME=COLUMN says which is which"
        )
    wanted_units = {}
    for name, what in wanted.items():
        check(what, units)
        k = 1 + there.index(name)
        if what not in units and file.units[k]:
            raise ValueError(f"{what}: a function has no unit; give the measured column without one")
        wanted_units[k] = units.get(what, "")
    times, values = file.read(wanted_units)
    return Measured(times, dict(zip(wanted.values(), values.values(), strict=True)), file.notes)


def reading_of(texts: Sequence[str]) -> Reading:
    """Return how a file is read by what ``KEY=VALUE`` say, with the keys of a load. Raises SceneError."""
    given = dict(text.partition("=")[::2] for text in texts)
    try:
        return Reading.model_validate(given, strict=False)
    except ValidationError as error:
        first = error.errors()[0]
        key = str(first["loc"][0])
        if key not in Reading.model_fields:
            raise ArgumentError(f"--read {key}: must be one of {', '.join(Reading.model_fields)}") from None
        raise ArgumentError(f"--read {key}={given[key]}: {first['msg'].lower()}") from None


def time_shift(run: Trajectory, measured: Measured) -> float:
    """Return by how much [s] the clock of the measurement is to be moved onward, so that its curves fit the run.

    Where the mean square between them is least: the first of `time_shifts`, refined.
    """
    (coarse, *_), step = time_shifts(run, measured)

    def misfit(shift: float) -> float:
        return sum(residual.relative**2 for residual in residuals(run, measured, shift))

    fine = minimize_scalar(
        misfit, bounds=(coarse - step, coarse + step), method="bounded", options={"xatol": 1e-6 * step}
    )
    return float(fine.x)


def time_shifts(run: Trajectory, measured: Measured) -> tuple[list[float], float]:
    """Return shifts [s] at which the mean square between the curves is least nearby, best first, and their step.

    They are found by correlation at equal steps [s]. Half of the shorter record takes part at least.
    """
    begin = float(run.time[0])
    end = float(run.time[-1])
    first = float(measured.time[0])
    last = float(measured.time[-1])
    step = max(float(np.median(np.diff(measured.time))), (end - begin + last - first) / _MOST)
    ours = np.arange(begin, end, step)
    theirs = np.arange(first, last, step)
    found = rows_at(run, ours)
    total = np.zeros(len(ours) + len(theirs) - 1)
    one = np.ones(len(ours))
    other = np.ones(len(theirs))
    common = np.maximum(correlate(one, other), 1.0)
    for what, values in measured.values.items():
        a = signal(found, what)
        b = np.interp(theirs, measured.time, values)
        square = correlate(a**2, other) - 2.0 * correlate(a, b) + correlate(one, b**2)
        total = total + square / common / (float(np.var(b)) or 1.0)
    total = np.where(common >= 0.5 * min(len(ours), len(theirs)), total, np.inf)
    (lowest,) = argrelextrema(total, np.less_equal)
    lowest = lowest[np.isfinite(total[lowest])]
    lags = correlation_lags(len(ours), len(theirs))[lowest[np.argsort(total[lowest])]]
    return (begin - first + step * lags).tolist(), step


def model(run: Trajectory, measured: Measured, shift: float = 0.0) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return which points of the measurement the run covers, shape (n,), and its curves at these."""
    times = measured.time + shift
    covered = measured.covered(run, shift)
    if covered.sum() < 2:
        raise SceneError(
            f"the run is known from {run.time[0]:g} s to {run.time[-1]:g} s, the measurement from {times[0]:g} s to "
            f"{times[-1]:g} s: they have no times in common"
        )
    found = rows_at(run, times[covered])
    return covered, {what: signal(found, what) for what in measured.values}


def residuals(run: Trajectory, measured: Measured, shift: float = 0.0) -> list[Residual]:
    """Return how far the run is from each measured curve; the clock of the measurement is moved by ``shift`` [s]."""
    covered, curves = model(run, measured, shift)
    times = measured.time[covered] + shift
    found = []
    for what, curve in curves.items():
        off = curve - measured.values[what][covered]
        rms = float(np.sqrt(np.mean(off**2)))
        at = int(np.argmax(np.abs(off)))
        scale = float(np.std(measured.values[what][covered])) or 1.0
        found.append(Residual(what, len(off), rms, rms / scale, float(abs(off[at])), float(times[at])))
    return found
