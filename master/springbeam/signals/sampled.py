"""A run at equal steps of time: what filters and spectra need of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..results.dense import rows_at
from ..results.trajectory import Trajectory
from ..scene import SceneError
from .expressions import signal

#: Most samples that are taken of a run.
MOST = 4_000_000


class Samples(NamedTuple):
    """Values at equal steps, shape (n,)."""

    start: float  #: [s]
    step: float  #: [s]
    values: np.ndarray

    @property
    def times(self) -> np.ndarray:
        """Return when they are taken [s]."""
        return self.start + self.step * np.arange(len(self.values))


def sampled(run: Trajectory, what: str, step: float | None = None, since: float | None = None) -> Samples:
    """Return a column of ``run``, or a formula of columns, at steps of ``step`` [s] from ``since`` [s] on.

    Without a step there are as many as rows. Values lie on the curve of the run between its rows
    (`springbeam.Trajectory.at`). Raises SceneError where there is nothing to sample.
    """
    begin, end = float(run.time[0]) if since is None else since, float(run.time[-1])
    if not begin < end:
        raise SceneError(f"from {begin:g} s: the run ends at {end:g} s")
    count = int(np.count_nonzero(run.time >= begin)) if step is None else int((end - begin) / step * (1 + 1e-12)) + 1
    if not 2 <= count <= MOST:
        raise SceneError(
            f"{what}: {count:,} samples; there must be from 2 to {MOST:,}: take lower frequencies, or less of the run"
        )
    times = np.linspace(begin, end, count) if step is None else begin + step * np.arange(count)
    found = rows_at(run, np.minimum(times, end))
    return Samples(begin, float(times[1] - times[0]), signal(found, what))
