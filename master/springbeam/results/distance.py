"""Distance of a run from an exact or a finer one: one measure for all comparisons of two runs."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import NamedTuple

import numpy as np

from .contact_changes import contact_time_difference, impulse_difference
from .dense import PLACES, SPEEDS, ends_at
from .spans import FLOOR, ROUNDING, energy_of_force, rounding_of, span
from .trajectory import Trajectory

#: Shares of the time from one row to the next, of either run, at which two runs are compared.
_BETWEEN = np.arange(4.0) / 4.0
#: Times closer than this share of the run are one.
_SAME = 1e-12


class Distance(NamedTuple):
    """Relative differences of two runs; see `distance`."""

    motion: float
    times: float
    impulses: float
    force: float | None
    velocities: float | None
    energies: float | None


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
        common. ``times``: the largest difference of a beginning or an end of a contact, over the length of the run.
        ``impulses``: the difference of the sums of all impacts' impulses on the tip and on the foundation, over the
        smaller sum that is not 0; 0 where both are. ``force``: the difference of the peaks of a soft contact force,
        over the larger; ``None`` for a rigid law and unknown peaks. ``velocities``: that of v_tip or of z, as of
        the motion, but where an event comes earlier in one run than in the other. ``energies``: that of an energy at
        the end of the runs, over the largest energy; both ``None`` beside a reference.
    """
    curves = run.steps is not None and exact.steps is not None
    times = _all_times(run, exact) if curves else exact.time if exact.steps is None else run.time
    if run.steps is None:
        times = times[np.isin(times, run.time)]
    rounding = max(rounding_of(run), rounding_of(exact))
    duration = float(exact.time[-1] - exact.time[0])
    impulses = [impulse_difference(run, exact), impulse_difference(exact, run)]
    late = contact_time_difference(run, exact, window)
    ours, theirs = (_ends_at(of, times) for of in (run, exact))
    speeds = None
    if curves:
        speeds = _velocities_apart(ours, theirs, times, _moments(run, exact, late), rounding / _step(exact))
    return Distance(
        motion(ours, theirs, rounding),
        late / duration,
        max(np.nan_to_num(impulses).tolist()),
        None if exact.scene.contact.rigid else _peaks_apart(run, exact),
        speeds,
        _energies_apart(run, exact) if curves else None,
    )


def motion(columns: Mapping[str, np.ndarray], exact: Mapping[str, np.ndarray], rounding: float = 0.0) -> float:
    """Return the larger of the largest differences of u_tip and of y, `apart`, at equal times; ∞ without any."""
    names = [name for name in PLACES if name in columns and name in exact]
    differences = (apart(columns[name], exact[name], rounding) for name in names)
    return max((float(each.max(initial=0.0)) for each in differences), default=inf)


def apart(values: np.ndarray, exact: np.ndarray, rounding: float = 0.0) -> np.ndarray:
    """Return the differences beyond ``rounding``, over the range of ``exact`` as of `span`; absolute if all are 0."""
    scale = span(exact, rounding) or 1.0
    return np.asarray(np.maximum(np.abs(values - exact) - rounding, 0.0) / scale)


def _velocities_apart(
    columns: Mapping[str, np.ndarray],
    exact: Mapping[str, np.ndarray],
    times: np.ndarray,
    moments: np.ndarray,
    rounding: float,
) -> float:
    """Return the largest difference of a velocity, `apart`, but within ``moments`` [s], shape (n, 2).

    ``rounding`` [m/s] is that of positions over a step.
    """
    near_event = np.searchsorted(moments[:, 0], times, "right") > np.searchsorted(moments[:, 1], times, "left")
    largest = [0.0]
    for name in (name for name in SPEEDS if name in columns and name in exact):
        fastest = max(float(np.abs(exact[of]).max(initial=0.0)) for of in SPEEDS if of in exact)
        off = apart(columns[name], exact[name], max(rounding, ROUNDING * fastest))
        largest.append(float(off[~near_event].max(initial=0.0)))
    return max(largest)


def _moments(run: Trajectory, exact: Trajectory, late: float) -> np.ndarray:
    """Return the times around the events of both runs in which they may have come in one of them only, (n, 2)."""
    at = np.sort([event.time for of in (run, exact) for event in of.events])
    slack = late + _SAME * float(exact.time[-1])
    return np.column_stack([at - slack, at + slack])


def _energies_apart(run: Trajectory, exact: Trajectory) -> float:
    """Return the largest difference of an energy at the end of two runs, over the largest energy until then.

    That is at least the rounding of works that cancel, as of `span`.
    """
    assert exact.steps is not None
    largest = FLOOR * ROUNDING * float(energy_of_force(exact.steps).sum())
    difference = 0.0
    for name in (name for name in exact.columns if name.startswith("e_")):
        largest = max(largest, float(np.abs(exact[name]).max()))
        difference = max(difference, abs(float(run[name][-1] - exact[name][-1])))
    return difference / (largest or 1.0)


def _step(run: Trajectory) -> float:
    """Return the longest step of a run [s]."""
    assert run.steps is not None
    return float(run.steps["size"].max())


def _ends_at(run: Trajectory, times: np.ndarray) -> Mapping[str, np.ndarray]:
    """Return the motion of both ends at ``times`` [s], which are rows of the run if it is a reference."""
    if run.steps is not None:
        return ends_at(run, times)
    rows = np.isin(run.time, times)
    return {name: run[name][rows] for name in (*PLACES, *SPEEDS) if name in run.columns}


def _all_times(run: Trajectory, exact: Trajectory) -> np.ndarray:
    rows = np.sort(np.concatenate([run.time, exact.time]))
    return np.append((rows[:-1, None] + _BETWEEN * np.diff(rows)[:, None]).ravel(), rows[-1])


def _peaks_apart(run: Trajectory, exact: Trajectory) -> float | None:
    if not all("contact_force_max" in of.summary for of in (run, exact)):
        return None
    peak, other = (float(of.summary["contact_force_max"]) for of in (run, exact))
    return abs(peak - other) / (max(peak, other) or 1.0)
