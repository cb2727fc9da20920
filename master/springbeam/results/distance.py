"""Distance of a run from an exact or a finer one: one measure for all comparisons of two runs."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import NamedTuple

import numpy as np

from .contact_changes import contact_time_difference, impulse_difference
from .dense import at
from .spans import rounding_of, span
from .trajectory import Trajectory

#: Shares of the time from one row to the next, of either run, at which two runs are compared.
_BETWEEN = np.arange(4.0) / 4.0


class Distance(NamedTuple):
    """Relative differences of two runs; see `distance`."""

    motion: float
    times: float
    impulses: float
    force: float | None


def distance(run: Trajectory, exact: Trajectory, window: float) -> Distance:
    """Return the differences of ``run`` to ``exact``, a finer run or a reference.

    Parameters
    ----------
    run, exact
        Two runs of one scene; a reference has values at its rows only, of two references the common ones count.
    window
        Contacts and flights shorter than this [s] are ignored if their impulse is negligible.

    Returns
    -------
    Distance
        ``motion``: the largest difference of u_tip or of y, over the range of the exact one (`apart`), taken at all
        rows of both and at three times between each two; with a reference at its rows. ∞ where the two have no body in
        common. ``times``: the largest difference of a beginning or an end of a contact, over
        the length of the run. ``impulses``: the difference of the sums of all impacts' impulses on the tip and on the
        foundation, over the smaller sum that is not 0; 0 where both are. ``force``: the difference of the peaks of a
        soft contact force, each a mean over its window, over the larger; ``None`` for a rigid law and unknown peaks.
    """
    times = exact.time if exact.steps is None else _all_times(run, exact)
    if run.steps is None:
        times = times[np.isin(times, run.time)]
    rounding = max(rounding_of(run), rounding_of(exact))
    duration = float(exact.time[-1] - exact.time[0])
    impulses = [impulse_difference(run, exact), impulse_difference(exact, run)]
    return Distance(
        motion(_columns_at(run, times), _columns_at(exact, times), rounding),
        contact_time_difference(run, exact, window) / duration,
        max(np.nan_to_num(impulses).tolist()),
        None if exact.scene.contact.rigid else _peaks_apart(run, exact),
    )


def motion(columns: Mapping[str, np.ndarray], exact: Mapping[str, np.ndarray], rounding: float = 0.0) -> float:
    """Return the larger of the largest differences of u_tip and of y, `apart`, at equal times; ∞ without any."""
    names = [name for name in ("u_tip", "y") if name in columns and name in exact]
    found = (apart(columns[name], exact[name], rounding) for name in names)
    return max((float(each.max(initial=0.0)) for each in found), default=inf)


def apart(values: np.ndarray, exact: np.ndarray, rounding: float = 0.0) -> np.ndarray:
    """Return the differences beyond ``rounding``, over the range of ``exact`` as of `span`; absolute if all are 0."""
    scale = span(exact, rounding) or 1.0
    return np.asarray(np.maximum(np.abs(values - exact) - rounding, 0.0) / scale)


def _columns_at(run: Trajectory, times: np.ndarray) -> Mapping[str, np.ndarray]:
    """Return the columns of ``run`` at ``times`` [s], which are rows of it if it is a reference."""
    if run.steps is not None:
        return at(run, times).columns
    rows = np.isin(run.time, times)
    return {name: values[rows] for name, values in run.columns.items()}


def _all_times(run: Trajectory, exact: Trajectory) -> np.ndarray:
    rows = np.union1d(run.time, exact.time)
    return np.append((rows[:-1, None] + _BETWEEN * np.diff(rows)[:, None]).ravel(), rows[-1])


def _peaks_apart(run: Trajectory, exact: Trajectory) -> float | None:
    if not all("contact_force_max" in of.summary for of in (run, exact)):
        return None
    peak, other = (float(of.summary["contact_force_max"]) for of in (run, exact))
    return abs(peak - other) / (max(peak, other) or 1.0)
