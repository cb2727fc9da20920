"""Frequency response by a sweep: the range of a motion while a chirp drives it, over the frequency of the chirp.

A scene with two chirps, one after the other, up and down, goes on from the state that the first has left: where both
curves differ, motions coexist.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..results.trajectory import Trajectory
from ..scene import Load
from .expressions import signal

#: Periods of the drive over which the range is taken.
_PERIODS = 2


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
    """Return the response of a column, or of a formula of columns, to each chirp of the run."""
    values, found = signal(run, what), []
    for number, load in enumerate(run.scene.loads):
        if load.signal != "chirp":
            continue
        edges = _edges(load)
        first, last = (np.searchsorted(run.time, side) for side in (edges[:-1], edges[1:]))
        full = (last > first + 1) & (edges[1:] <= run.time[-1])
        ranges = [0.5 * float(np.ptp(values[i:j])) for i, j in zip(first[full], last[full], strict=True)]
        middle = 0.5 * (edges[:-1] + edges[1:])[full]
        found.append(Response(number, _frequency(load, middle), np.array(ranges)))
    return found


def _frequency(load: Load, times: np.ndarray) -> np.ndarray:
    first, last, duration = load.frequency or 0.0, load.frequency_end or 0.0, load.duration or 1.0
    return np.asarray(first + (last - first) * (times - load.start) / duration)


def _edges(load: Load) -> np.ndarray:
    """Return when the chirp has turned by each multiple of `_PERIODS` periods [s]."""
    first, last, duration = load.frequency or 0.0, load.frequency_end or 0.0, load.duration or 1.0
    turns = _PERIODS * np.arange(1.0 + np.floor(0.5 * (first + last) * duration / _PERIODS + 1e-9))
    rate = (last - first) / duration
    root = np.sqrt(np.maximum(first**2 + 2.0 * rate * turns, 0.0))
    return np.asarray(load.start + 2.0 * turns / (first + root))
