"""Driven motion: whether it has settled, since when and with which period, and its response to a chirp.

In a scene with two chirps, up and then down, the second starts from the state at the end of the first: where the
responses to both differ, motions coexist.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..results.dense import MOTION, at_multiples, inside
from ..results.trajectory import Trajectory
from ..scene.loads import ChirpLoad, HarmonicLoad
from .curves import signal

#: A motion has settled where its points repeat themselves within this share of the range of the motion …
_ALIKE = 0.01
#: … for so many periods of the motion, each of at most so many periods of the drive.
_PERIODS = 8
_LONGEST = 8
#: An impact within this share of a period of the drive is on the strobe.
_ON_STROBE = 0.01
#: Periods of a chirp over which the range of its response is taken.
_OF_CHIRP = 2


class Settled(NamedTuple):
    """The settled part of a driven run."""

    since: float  #: [s]
    drive: float  #: period of the drive [s]
    multiple: int  #: periods of the drive in a period of the motion

    @property
    def period(self) -> float:
        """Period of the motion [s]."""
        return self.multiple * self.drive

    def amplitude(self, run: Trajectory, column: str) -> float:
        """Return half the range of a column over the last 8 periods, where the transient has faded further.

        It is that of the curve of a motion, else of the rows, of which 8 periods have more phases than one.
        """
        begin = float(run.time[-1]) - _PERIODS * self.period
        if column in MOTION and run.steps is not None:
            late = run.steps[run.steps["time"] >= begin]
            extremes = inside(run.scene.contact.rigid, late, column).extremes[column]
            return 0.5 * (extremes.highest - extremes.lowest)
        return 0.5 * float(np.ptp(run[column][run.time >= begin]))


def drive_of(run: Trajectory) -> HarmonicLoad | None:
    """Return the first harmonic load, ``None`` if there is none."""
    return next((load for load in run.scene.loads if isinstance(load, HarmonicLoad)), None)


def poincare(run: Trajectory, period: float, start: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return the motion once a ``period`` [s], from ``start`` [s] on: times (n,), and position and velocity (n, 2).

    The point is the tip, or the spring's top where there is no beam.
    """
    rows = at_multiples(run, period, start)
    return rows.time, np.column_stack([rows[name] for name in _point(run)])


def strobe(run: Trajectory, drive: HarmonicLoad) -> float:
    """Return a time [s] from which points once a period of the ``drive`` show the motion: where the drive starts.

    Where events of the later half of the run fall there, a velocity would be that before or after one by rounding: then
    it is the middle of the longest part of a period without events.
    """
    period = 1.0 / drive.frequency
    late = [event.time for event in run.events if event.time >= 0.5 * (run.time[0] + run.time[-1])]
    phases = np.sort((np.array(late) - drive.start) / period % 1.0)
    if not (np.minimum(phases, 1.0 - phases) < _ON_STROBE).any():
        return drive.start
    lengths = np.diff(phases, append=phases[0] + 1.0)
    longest = int(np.argmax(lengths))
    return drive.start + period * float((phases[longest] + 0.5 * lengths[longest]) % 1.0)


def not_repeating(points: int) -> str:
    """Return in words what has been looked for in vain in ``points`` once a period of the drive."""
    most = min(_LONGEST, (points - 1) // _PERIODS)
    if most < 1:
        return f"{points} periods of the drive are too few: a motion has settled if {_PERIODS + 1} points are alike"
    return (
        f"no period of 1 to {most} times the drive's repeats itself {_PERIODS} times within {_ALIKE:.0%} of the range: "
        "it may be longer, not settled yet, or chaotic"
    )


def _point(run: Trajectory) -> tuple[str, str]:
    """Return the columns of the observed point, position and velocity."""
    return ("u_tip", "v_tip") if "u_tip" in run.columns else ("y", "z")


def settled(run: Trajectory) -> Settled | None:
    """Return the settled part of a driven run, ``None`` if it is not driven, or has not settled.

    It has settled where its points once a period of the drive repeat themselves and do not drift (`repeating`), in
    shares of the range of position and velocity. Those of a chaotic motion never do. A beat that is longer than the
    run looks like a settled motion.
    """
    drive = drive_of(run)
    if drive is None or run.steps is None:
        return None
    times, points = poincare(run, 1.0 / drive.frequency, strobe(run, drive))
    late = run.time >= 0.5 * (run.time[0] + run.time[-1])
    scale = np.array([float(np.ptp(run[name][late])) for name in _point(run)])
    repeats = repeating(points / scale) if (scale > 0.0).all() else None
    return None if repeats is None else Settled(float(times[repeats[0]]), 1.0 / drive.frequency, repeats[1])


def repeating(points: np.ndarray) -> tuple[int, int] | None:
    """Return the first of the ``points`` (n, 2) from which they repeat, and the number after which; ``None`` if not.

    They are points once a period of the drive, over the range of the motion. They repeat themselves if, for at least
    8 periods of the motion, each lies within 1 % of its last image, and the drift that is left is below 1 % as well.
    """
    for multiple in range(1, _LONGEST + 1):
        alike = np.tile(points[-multiple:], (len(points) // multiple + 1, 1))[-len(points) :]
        off = np.flatnonzero((np.abs(points - alike) > _ALIKE).any(axis=1))
        since = int(off[-1]) + 1 if len(off) else 0
        periods = (len(points) - since) // multiple
        if len(points) - 1 - since >= _PERIODS * multiple:
            images = points[-periods * multiple :].reshape(periods, -1)
            return (since, multiple) if _drift(images, len(points) / multiple) <= _ALIKE else None
    return None


def _drift(images: np.ndarray, periods: float) -> float:
    """Return the expected further drift of the ``images`` (n, m) of a motion, one per period.

    A band alone does not show it: a motion that grows linearly stays within any band for long enough. The means over
    thirds of the images show the drift. It is extrapolated as a transient that decays by the same ratio from third to
    third, or at the same rate for as many ``periods`` as the run has had; the smaller of both counts.
    """
    third = len(images) // 3
    means = images[len(images) - 3 * third :].reshape(3, third, -1).mean(axis=1)
    before, last = np.abs(np.diff(means, axis=0))
    decays = last < before
    ratio = np.where(decays, last, 0.0) / np.where(decays, before, 1.0)
    transient = np.where(decays, last * ratio / (1.0 - ratio), np.inf)
    return float(np.minimum(transient, last * periods / third).max())


class Response(NamedTuple):
    """Half the range of a signal, by the frequency of a chirp, in the order of time; shapes (n,)."""

    load: int  #: number of the chirp
    frequency: np.ndarray  #: [Hz]
    amplitude: np.ndarray

    @property
    def way(self) -> str:
        """``up`` or ``down``."""
        return "up" if self.frequency[-1] > self.frequency[0] else "down"


def responses(run: Trajectory, what: str) -> list[Response]:
    """Return the response of a column, or of a function of the run, to each chirp of the run."""
    values = signal(run, what)
    chirps = [(number, load) for number, load in enumerate(run.scene.loads) if isinstance(load, ChirpLoad)]
    return [response(number, load, run.time, values) for number, load in chirps]


def response(number: int, chirp: ChirpLoad, time: np.ndarray, values: np.ndarray) -> Response:
    """Return the range over each `_OF_CHIRP` turns of a chirp, and its frequency amidst them."""
    first = chirp.frequency
    rate = (chirp.frequency_end - first) / chirp.duration
    driven = (time >= chirp.start) & (time <= chirp.start + chirp.duration)
    since = time[driven] - chirp.start
    turns = ((first + 0.5 * rate * since) * since + 1e-9) // _OF_CHIRP
    number_of, begins, rows = np.unique(turns, return_index=True, return_counts=True)
    ranges = np.maximum.reduceat(values[driven], begins) - np.minimum.reduceat(values[driven], begins)
    frequency = np.sqrt(first**2 + 2.0 * rate * _OF_CHIRP * (number_of + 0.5))
    seen = (rows > 1) & (number_of < number_of.max(initial=0.0))  # one row has no range, and the last turns no end
    return Response(number, frequency[seen], 0.5 * ranges[seen])
