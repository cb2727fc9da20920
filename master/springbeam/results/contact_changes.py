"""Differences of two runs in the times of contact and of impacts on the foundation, and in their impulses.

Contacts shorter than a window with a negligible impulse are ignored: rounding decides whether they close at all.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import inf, nan
from typing import NamedTuple

import numpy as np

from .contact_times import Interval, foundation_contacts, kicks, tip_contacts
from .records import impulse
from .trajectory import Trajectory

#: Share of the impulse of a run below which a contact or an impact is negligible.
SLIGHT = 2e-3


class ContactChange(NamedTuple):
    """Tip and spring meet (``closes``) or part (``opens``); the foundation is reached (``strikes``) or left after a
    rest on it (``leaves``)."""

    kind: str
    time: float  #: [s]


def contact_changes(run: Trajectory, window: float) -> list[ContactChange]:
    """Return the changes of contact in their order, without contacts and flights shorter than ``window`` [s].

    Impacts on the foundation that follow each other within ``window`` are one.
    """
    changes = []
    for since, until in _merged(tip_contacts(run.scene, run.events, inf), window):
        if until - since >= window:
            changes += [ContactChange("closes", since), ContactChange("opens", until)]
    for since, until in _merged(foundation_contacts(run.events, inf), window):
        changes += [ContactChange("strikes", since)]
        if until > since:
            changes += [ContactChange("leaves", until)]
    return sorted((change for change in changes if change.time < inf), key=lambda change: change.time)


def contact_time_difference(first: Trajectory, second: Trajectory, window: float) -> float:
    """Return the largest difference of the times of contact of two runs [s].

    Each beginning and end of a contact is compared with the nearest one of the other run, or with the end of the run,
    if it is the later. Contacts closer than ``window`` [s] to each other are one. Shorter ones with less than `SLIGHT`
    of the impulse are left out; so are all short ones of tip and spring in a run without steps, as of a reference,
    whose impulses are not known.
    """
    end = float(second.time[-1])
    worst = 0.0
    for ours, theirs in zip(_contacts_and_impacts(first, end), _contacts_and_impacts(second, end), strict=True):
        for one, other in ((ours, theirs), (theirs, ours)):
            worst = max(worst, _furthest(_lasting(*one, window), other[0], end))
    return worst


def impulse_difference(run: Trajectory, reference: Trajectory) -> float:
    """Return the relative difference of the sums of all impacts' impulses to ``reference``; NaN if it has none.

    The sums are of the impulses on the tip and of those of the foundation.
    """
    ours, exact = (
        np.sum([(0.0, 0.0), *((event.impulse_contact, event.impulse_foundation) for event in of.events)], axis=0)
        for of in (run, reference)
    )
    scale = float(np.abs(exact).sum())
    return float(np.abs(ours - exact).sum()) / scale if scale > 0.0 else nan


def _merged(intervals: list[Interval], window: float) -> list[Interval]:
    """Join intervals closer than ``window`` [s]."""
    merged: list[Interval] = []
    for begin, end in intervals:
        if merged and begin - merged[-1][1] < window:
            begin, _ = merged.pop()
        merged.append((begin, end))
    return merged


def _contacts_and_impacts(run: Trajectory, end: float) -> Iterator[tuple[list[Interval], np.ndarray, np.ndarray]]:
    """Yield the contacts of tip and spring, and those with the foundation, in a run that ends at ``end`` [s].

    With them are times [s] and the magnitude of the impulse up to each since the one before [N·s]; none if unknown.
    """
    times = np.empty(0)
    passed = np.empty(0)
    if run.steps is not None:
        times = run.steps["time"]
        passed = np.abs(impulse(run.steps)) + np.abs(kicks(times, run.events))
    yield tip_contacts(run.scene, run.events, end), times, passed
    times = np.array([event.time for event in run.events])
    yield (
        foundation_contacts(run.events, end),
        times,
        np.array([abs(e.impulse_foundation) for e in run.events]),
    )


def _lasting(intervals: list[Interval], times: np.ndarray, passed: np.ndarray, window: float) -> list[Interval]:
    """Join ``intervals`` closer than ``window`` [s]; return those longer or transmitting `SLIGHT` of all impulses.

    Other parameters as of `_contacts_and_impacts`.
    """
    least = SLIGHT * passed.sum() if times.size else inf

    def lasts(since: float, until: float) -> bool:
        within = slice(np.searchsorted(times, since, "left"), np.searchsorted(times, until, "right"))
        return until - since > window or passed[within].sum() >= least

    return [interval for interval in _merged(intervals, window) if lasts(*interval)]


def _furthest(ours: list[Interval], theirs: list[Interval], end: float) -> float:
    """Return the largest distance of a beginning or an end from the nearest one of the others [s]."""
    return max((min([end - i[k], *(abs(i[k] - j[k]) for j in theirs)]) for i in ours for k in (0, 1)), default=0.0)
