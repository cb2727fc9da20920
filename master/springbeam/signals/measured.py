"""Measured data (`springbeam.scene.recorded`) in the units of a run, and their comparison with it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import ValidationError

from ..results.dense import rows_at
from ..results.trajectory import Trajectory, columns_of
from ..scene import ArgumentError, Scene, SceneError
from ..scene.recorded import Reading, Recorded
from .curves import check, signal, unit_of

#: Most steps of a correlation, and fewest in the run.
_MOST = 200_000
_FEWEST = 2_000
#: Peaks of a correlation that are refined.
_PEAKS = 6
#: Most steps by Newton's method that settle a shift, and the change of the curves over their spread that is none.
_NEWTON = 5
_SETTLED = 1e-7
#: Mean square over the spread that is none.
ALIKE = 1e-12
#: Shifts fit equally well whose mean squares differ by no more than this share.
EQUAL = 0.01
#: Difference that gives a derivative by time, as a share of the run.
_DIFFERENCE = 1e-6


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
        return (times >= begin + off) & (times <= end - off)

    def spread(self, what: str) -> float:
        """Return the standard deviation of a curve, 1 of one that is constant."""
        return float(np.std(self.values[what])) or 1.0


class Residual(NamedTuple):
    """Difference of a run to a measured curve, where both are known."""

    signal: str
    points: int
    rms: float  #: in the unit of the signal
    relative: float  #: over the standard deviation of what was measured
    largest: float
    at: float  #: [s], in the time of the run


def measured_as(file: Path, scene: Scene, names: Sequence[str], scales: Sequence[str], read: Sequence[str]) -> Measured:
    """Read a file of measurements as the options ``--map``, ``--scale`` and ``--read`` of a command say.

    Raises SceneError, which names option or file, line, column and remedy.
    """
    columns = by_column("map", names, "CH1=a_tip")
    return read_measured(file, scene, columns, reading_of(read), by_column("scale", scales, "CH1=2.5 mm/V"))


def read_measured(
    path: str | Path,
    scene: Scene,
    names: Mapping[str, str] | None = None,
    reading: Reading | None = None,
    scales: Mapping[str, str] | None = None,
) -> Measured:
    """Read a file of measurements.

    Parameters
    ----------
    path
        Of the file, whose first line names the columns.
    scene
        Has the columns of a run, and their units.
    names
        The column of a run, or ``module:function`` of it, by the column of the file, e.g. ``{"CH1": "a_tip"}``.
        Without any, columns that are called as those of a run belong to these. Others are left out.
    reading
        Format of the file.
    scales
        By the column of the file a number by which it is multiplied, which may have a unit: ``{"CH1": "2.5 mm/V"}``
        gives a column in mV millimetres.

    Raises SceneError, which names file, line, column and remedy.
    """
    path = Path(path)
    with errors_of(path):
        return _read(Recorded(path, reading), columns_of(scene), names or {}, scales or {})


def _read(file: Recorded, units: Mapping[str, str], names: Mapping[str, str], scales: Mapping[str, str]) -> Measured:
    if not file.names:
        raise ValueError("the first line must name the columns, as in time [ms],acceleration [g]")
    there, factors = scaled(file, scales, map=names)
    wanted = names or {name: name for name in there if name in units and name != "phase"}
    if not wanted:
        raise ValueError(
            f"no column is called as one of the run ({', '.join(units)}); --map NAME=COLUMN says which is which"
        )
    wanted_units = {}
    for name, what in wanted.items():
        check(what, units)
        given = file.units[there[name]]
        wanted_units[there[name]] = unit_of(what, units)
        if given and not wanted_units[there[name]]:
            raise ValueError(
                f"{what}: the measurement is in {given}, and the function states no unit; write "
                f'{what.partition(":")[2]}.unit = "{given}" below it, if it has this one'
            )
    times, values = file.read(wanted_units)
    curves = {what: values[there[name]] * factors[there[name]] for name, what in wanted.items()}
    return Measured(times, curves, file.notes)


@contextmanager
def errors_of(path: Path) -> Iterator[None]:
    """Raise SceneError with the path of a file for what is wrong in it."""
    try:
        yield
    except OSError as error:
        raise SceneError(f"{path}: {error.strerror}") from error
    except ArgumentError:
        raise
    except ValueError as error:
        raise ArgumentError(f"{path}: {error}") from error


def scaled(
    file: Recorded, scales: Mapping[str, str], **named: Iterable[str]
) -> tuple[dict[str, int], dict[int, float]]:
    """Return the numbers of the columns of a file but that of times, and their factors.

    Units in ``scales`` are added to those of the columns. Raises ArgumentError if these, or options ``named`` with
    columns, name another.
    """
    there = {name: k for k, name in enumerate(file.labels) if k != file.time}
    for option, names in {**named, "scale": scales}.items():
        if wrong := [name for name in names if name not in there]:
            raise ValueError(f"--{option} {wrong[0]}: there are the columns {', '.join(there)}")
    factors = dict.fromkeys(there.values(), 1.0)
    for name, text in scales.items():
        factors[there[name]], unit = scale_of(name, text)
        file.units[there[name]] = f"{file.units[there[name]]} {unit}".strip()
    return there, factors


def scale_of(name: str, text: str) -> tuple[float, str]:
    """Return number and unit of a scale, ``2.5 mm/V``. Raises SceneError if it is none."""
    number, _, unit = text.strip().partition(" ")
    with suppress(ValueError):
        if math.isfinite(factor := float(number)) and factor != 0.0:
            return factor, unit.strip(" []")
    raise ArgumentError(f"--scale {name}={text}: must be a number, or one and a unit, as in CH1=2.5 mm/V")


def reading_of(texts: Sequence[str]) -> Reading:
    """Return the format of a file from ``KEY=VALUE`` strings, with the keys of a load. Raises SceneError."""
    given = dict(text.partition("=")[::2] for text in texts)
    try:
        return Reading.model_validate(given, strict=False)
    except ValidationError as error:
        first = error.errors()[0]
        key = str(first["loc"][0])
        if key not in Reading.model_fields:
            raise ArgumentError(f"--read {key}: must be one of {', '.join(Reading.model_fields)}") from None
        raise ArgumentError(f"--read {key}={given[key]}: {first['msg'].lower()}") from None


def by_column(option: str, texts: Sequence[str], example: str) -> dict[str, str]:
    """Return what ``NAME=VALUE`` texts of an option say of columns of a file. Raises SceneError for anything else."""
    values = {}
    for text in texts:
        name, _, value = (part.strip() for part in text.rpartition("="))
        if not name or not value:
            raise ArgumentError(f"--{option} {text}: must be as in {example}")
        values[name] = value
    return values


class Aligned(NamedTuple):
    """A run and a measurement whose clock is shifted."""

    shift: float  #: [s]
    off: dict[str, np.ndarray]  #: run less measurement, NaN outside of the run, shapes (n,)
    slope: dict[str, np.ndarray]  #: derivative of ``off`` by the shift, shapes (n,)


def time_shift(run: Trajectory, measured: Measured) -> float:
    """Return the shift [s] of the clock of the measurement with which its curves fit the run best.

    Of equally good ones it is the smallest.
    """
    return settled(run, measured, at_shift(run, measured, shifts(run, measured)[0][0])).shift


def settled(
    run: Trajectory,
    measured: Measured,
    here: Aligned,
    points: slice = slice(None),
    limits: tuple[float, float] | None = None,
) -> Aligned:
    """Return ``run`` and the measurement, the clock moved from ``here`` to the least mean square of the difference.

    It is moved to where the mean square has no slope, so that runs that hardly differ have shifts that hardly differ.

    Parameters
    ----------
    run, measured
        The run and the measurement.
    here
        Both, where the clock begins.
    points
        Of the measurement, which count.
    limits
        Lowest and highest shift [s]; without them it moves by no more than a quarter of a `period`.
    """
    quarter = 0.25 * period(here.slope, measured)
    lowest, highest = limits or (here.shift - quarter, here.shift + quarter)
    step = 0.0
    gradient = 0.0
    for _ in range(_NEWTON):
        off, slope = (weighed(part, measured, points) for part in (here.off, here.slope))
        last = gradient
        gradient = float(off @ slope)
        turned = max(float(slope @ slope), 1e-300)
        # By the change of the gradient, after a step, if it shows a minimum; at first as if the curve were straight.
        curvature = (gradient - last) / step if step * (gradient - last) > 0.0 else turned
        step = float(np.clip(here.shift - gradient / curvature, lowest, highest)) - here.shift
        if abs(step) * math.sqrt(turned / max(len(off), 1)) <= _SETTLED:
            break
        here = at_shift(run, measured, here.shift + step)
    return here


def period(slope: Mapping[str, Any], measured: Measured) -> float:
    """Return that of the motion, or a smaller one [s], by derivatives of curves by time or shift, shapes (n,)."""
    rates = [rms(curve) / measured.spread(what) for what, curve in slope.items()]
    return 2.0 * math.pi / max(*rates, 1e-300)


def rms(values: Any) -> float:
    """Return the root mean square of numbers, of which NaN (or ``None``) does not count."""
    return float(np.sqrt(np.nanmean(np.array(values, float) ** 2)))


def mean_square(off: Mapping[str, Any], measured: Measured) -> float:
    """Return the mean square of what is left of curves, over their spread and the share of points that are covered.

    Of periods that fit as well it is smaller for the one that covers more of the measurement.
    """
    left = np.array([np.array(off[what], float) / measured.spread(what) for what in measured.values])
    return float(np.nanmean(left**2) / np.isfinite(left).mean())


def weighed(curves: Mapping[str, np.ndarray], measured: Measured, points: slice = slice(None)) -> np.ndarray:
    """Return curves over the spread of the measurement, one after the other, 0 where they are NaN."""
    return np.concatenate([np.nan_to_num(curve[points]) / measured.spread(what) for what, curve in curves.items()])


def at_shift(run: Trajectory, measured: Measured, shift: float) -> Aligned:
    """Return ``run`` and the measurement with its clock shifted by ``shift`` [s]."""
    covered = measured.covered(run, shift)
    times = measured.time[covered] + shift
    # Derivatives are by what follows, up to the next event, where a curve may jump.
    ahead = _DIFFERENCE * run.scene.duration
    events = np.array([event.time for event in run.events])
    ends = np.append(events - 1e-3 * ahead, run.time[-1])
    later = np.minimum(times + ahead, ends[np.searchsorted(events, times, side="right")])
    width = later - times
    here, after = (rows_at(run, several) for several in (times, later))
    off = {}
    slope = {}
    for what, values in measured.values.items():
        off[what] = np.full_like(values, np.nan)
        slope[what] = np.zeros_like(values)
        curve = signal(here, what)
        off[what][covered] = curve - values[covered]
        slope[what][covered] = np.divide(
            signal(after, what) - curve, width, where=width != 0.0, out=np.zeros_like(width)
        )
    return Aligned(shift, off, slope)


def shifts(run: Trajectory, measured: Measured) -> list[tuple[float, float]]:
    """Return shifts [s] of the clock with which the measurement fits ``run``, and the mean square with each.

    Periods of an oscillation are similar, so the `_PEAKS` best shifts of a correlation are refined. The first one is
    the best of these, of equally good ones the smallest; the others follow by their mean squares, as of `mean_square`.
    At least half of the points that it can cover are used.
    """
    begin = float(run.time[0])
    end = float(run.time[-1])
    first = float(measured.time[0])
    last = float(measured.time[-1])
    finest = (end - begin + last - first) / _MOST
    step = max(min(float(np.median(np.diff(measured.time))), (end - begin) / _FEWEST), finest)
    times = begin + step * np.arange(int((end - begin) / step) + 1)
    rows = rows_at(run, times)
    curves = {what: signal(rows, what) for what in measured.values}
    # Each point of the measurement stands at the nearest step.
    cells = np.rint((measured.time - first) / step).astype(int)
    one = np.ones(len(times))
    points = np.bincount(cells).astype(float)
    number = np.rint(correlated(one, points))
    if number.max() < 2.0:
        raise ArgumentError(_apart(run, measured, "however its clock is moved"))
    total = np.zeros(len(number))
    for what, values in measured.values.items():
        a = curves[what]
        sums = np.bincount(cells, values)
        squares = np.bincount(cells, values**2)
        square = correlated(a**2, points) - 2.0 * correlated(a, sums) + correlated(one, squares)
        total += square / measured.spread(what) ** 2
    moved = begin - first + step * (np.arange(len(number)) - len(points) + 1.0)
    total = np.where(number >= 0.5 * number.max(), (total / number.clip(1.0) + ALIKE) / number.clip(1.0), np.inf)
    padded = np.pad(total, 1, constant_values=np.inf)
    lows = np.flatnonzero(np.isfinite(total) & (total <= padded[:-2]) & (total <= padded[2:]))
    best = moved[lows[np.argsort(total[lows])][:_PEAKS]].tolist()
    refined = [settled(run, measured, at_shift(run, measured, at), limits=(at - step, at + step)) for at in best]
    ranked = sorted(
        ((here.shift, mean_square(here.off, measured) + ALIKE) for here in refined), key=lambda pair: pair[1]
    )
    equal = [pair for pair in ranked if pair[1] <= (1.0 + EQUAL) * ranked[0][1]]
    smallest = min(equal, key=lambda pair: abs(pair[0]))
    return [smallest, *(pair for pair in ranked if pair is not smallest)]


def correlated(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return Σ one[k + j] other[k] at all lags j from 1 − len(other) to len(one) − 1."""
    size = len(one) + len(other) - 1
    length = 1 << size.bit_length()
    sums = np.fft.irfft(np.fft.rfft(one, length) * np.conj(np.fft.rfft(other, length)), length)
    return np.roll(sums, len(other) - 1)[:size]


def model(run: Trajectory, measured: Measured, shift: float = 0.0) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return which points of the measurement the run covers, shape (n,), and its curves at these."""
    times = measured.time + shift
    covered = measured.covered(run, shift)
    if covered.sum() < 2:
        raise ArgumentError(_apart(run, measured, f"with its clock moved by {shift:g} s" if shift else ""))
    rows = rows_at(run, times[covered])
    return covered, {what: signal(rows, what) for what in measured.values}


def _apart(run: Trajectory, measured: Measured, moved: str) -> str:
    """Return in words that fewer than two points of the measurement lie in the run."""
    return (
        f"the run is known from {run.time[0]:g} s to {run.time[-1]:g} s, the measurement has "
        f"{len(measured.time)} points from {measured.time[0]:g} s to {measured.time[-1]:g} s of its own clock: "
        f"{f'{moved}, ' * bool(moved)}fewer than two lie in the run; check the unit of the time, time.t_end and --shift"
    )


def residuals(run: Trajectory, measured: Measured, shift: float = 0.0) -> list[Residual]:
    """Return the difference of the run to each measured curve, with the clock of the measurement shifted [s]."""
    covered, curves = model(run, measured, shift)
    times = measured.time[covered] + shift
    rows = []
    for what, curve in curves.items():
        off = curve - measured.values[what][covered]
        left = rms(off)
        at = int(np.argmax(np.abs(off)))
        scale = float(np.std(measured.values[what][covered])) or 1.0
        rows.append(Residual(what, len(off), left, left / scale, float(abs(off[at])), float(times[at])))
    return rows
