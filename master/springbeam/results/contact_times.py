"""When contact opens and closes and the foundation is struck, how hard, and how far two runs are apart in it.

What lasts less than a window and passes on hardly any impulse is no evidence either way: whether such a contact closes
at all is decided by rounding.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from math import inf, nan
from typing import NamedTuple

import numpy as np

from .steps import impulse
from .trajectory import Event, EventKind, Trajectory

#: Share of the impulse of a run below which a contact or a stroke is none to speak of.
SLIGHT = 2e-3

#: From when to when something is touched [s]; an impact that lets go at once has no length.
Interval = tuple[float, float]


class ContactChange(NamedTuple):
    """Tip and spring meet (``closes``) or part (``opens``); the foundation is reached (``strikes``) or left after a
    rest on it (``leaves``)."""

    kind: str
    time: float  #: [s]


def contact_changes(run: Trajectory, window: float) -> list[ContactChange]:
    """Return the changes of contact in their order, without contacts and flights shorter than ``window`` [s].

    Strokes on the foundation that follow each other within ``window`` are one.
    """
    changes = []
    for intervals, least, begin, end in (
        (_contacts(run, inf), window, "closes", "opens"),
        (foundation_contacts(run.events, inf), 0.0, "strikes", "leaves"),
    ):
        for since, until in _lasting(intervals, window, least):
            changes.append(ContactChange(begin, float(since)))
            if until < inf and (until > since or end == "opens"):
                changes.append(ContactChange(end, float(until)))
    return sorted(changes, key=lambda change: change.time)


def contact_time_difference(first: Trajectory, second: Trajectory, window: float) -> float:
    """Return how far the times of two runs are apart [s].

    Each beginning and end of a contact is compared with the nearest one of the other run, or with the end of the run,
    if it is the later. Contacts closer than ``window`` [s] to each other are one. Those shorter than that which pass on
    less than `SLIGHT` of the impulse are left out; so are all short ones of tip and spring in a run without steps, as
    of a reference, whose impulses are not known.
    """
    end = float(second.time[-1])
    worst = 0.0
    runs = first, second
    tip = [_contacts(run, end) for run in runs]
    low = [foundation_contacts(run.events, end) for run in runs]
    for all_of, felt in (
        (tip, [_felt(found, _passed_to_tip(run), window) for found, run in zip(tip, runs, strict=True)]),
        (low, [_felt(found, _passed_to_foundation(run), window) for found, run in zip(low, runs, strict=True)]),
    ):
        worst = max(worst, _furthest(felt[0], all_of[1], end), _furthest(felt[1], all_of[0], end))
    return worst


def impulse_difference(run: Trajectory, reference: Trajectory) -> float:
    """Return how far the sums of all impacts' impulses are apart, over those of ``reference``; NaN if it has none.

    The sums are of what the tip gets and of what the foundation gives.
    """

    def total(trajectory: Trajectory) -> np.ndarray:
        events = [(e.impulse_contact, e.impulse_foundation) for e in trajectory.events]
        return np.asarray(np.sum(np.reshape(events, (-1, 2)), axis=0))

    exact = total(reference)
    scale = float(np.abs(exact).sum())
    return float(np.abs(total(run) - exact).sum()) / scale if scale > 0.0 else nan


def _contacts(run: Trajectory, end: float) -> list[Interval]:
    return tip_contacts(run.events, end, free_at_end=run.phase[-1] == "free")


def tip_contacts(events: Iterable[Event], end: float, *, free_at_end: bool) -> list[Interval]:
    """Return the contacts of tip and spring; one that goes on ends at ``end`` [s]."""
    edges: list[float] = []
    events = [event for event in events if event.kind.joins]
    for event, after in itertools.zip_longest(events, events[1:]):
        if event.kind is EventKind.RELEASE:  # to `touch`, or to `free`
            joined = not free_at_end if after is None else after.kind is not EventKind.IMPACT
        else:
            joined = event.kind is not EventKind.SEPARATION
        if joined == (len(edges) % 2 == 0):
            edges.append(event.time)
    if len(edges) % 2:
        edges.append(end)
    return list(zip(edges[::2], edges[1::2], strict=True))


def touches(events: Iterable[Event]) -> list[Interval]:
    """Return from when to when released ends still touch until they part [s]."""
    joins = [event for event in events if event.kind.joins]
    return [
        (event.time, after.time)
        for event, after in itertools.pairwise(joins)
        if (event.kind, after.kind) == (EventKind.RELEASE, EventKind.SEPARATION)
    ]


def foundation_contacts(events: Iterable[Event], end: float) -> list[Interval]:
    """Return the impacts on the foundation, and the rests on it; a rest that goes on ends at ``end`` [s]."""
    intervals: list[Interval] = []
    since: float | None = None
    for event in events:
        if event.kind is EventKind.STOP_IMPACT:
            intervals.append((event.time, event.time))
        elif event.kind is EventKind.SEATED:
            since = event.time
        elif event.kind in (EventKind.UNSEATED, EventKind.SEPARATION) and since is not None:
            intervals.append((since, event.time))
            since = None
    return intervals if since is None else [*intervals, (since, end)]


def _lasting(intervals: list[Interval], window: float, least: float) -> list[Interval]:
    """Join intervals closer than ``window``; return those that then last at least ``least`` [s]."""
    merged: list[Interval] = []
    for begin, end in intervals:
        if merged and begin - merged[-1][1] < window:
            merged[-1] = (merged[-1][0], end)
        else:
            merged.append((begin, end))
    return [(begin, end) for begin, end in merged if end - begin >= least]


def _felt(intervals: list[Interval], passed: tuple[np.ndarray, np.ndarray], window: float) -> list[Interval]:
    """Join ``intervals`` closer than ``window`` [s]; return those that last longer or pass on `SLIGHT` of the impulses.

    ``passed`` is times [s], and the impulse [N·s] up to and with each, without signs; none if it is not known.
    """
    times, total = passed
    total = np.append(0.0, total)

    def impulse_over(since: float, until: float) -> float:
        return float(total[np.searchsorted(times, until, "right")] - total[np.searchsorted(times, since, "left")])

    found = _lasting(intervals, window, 0.0)
    return [(s, u) for s, u in found if u - s > window or (times.size and impulse_over(s, u) >= SLIGHT * total[-1])]


def _passed_to_tip(run: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    if run.steps is None:
        return np.empty(0), np.empty(0)
    steps = run.steps
    return steps["time"], np.cumsum(np.abs(impulse(steps, steps["size"])) + np.abs(kicks(steps["time"], run.events)))


def _passed_to_foundation(run: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    passed = np.cumsum([abs(event.impulse_foundation) for event in run.events])
    return np.array([event.time for event in run.events]), passed


def kicks(times: np.ndarray, events: Iterable[Event]) -> np.ndarray:
    """Return the events' impulses on the tip [N·s] at each of ``times`` [s], those of one time at its last row."""
    found = np.zeros(len(times))
    for event in events:
        if event.impulse_contact != 0.0:
            found[np.searchsorted(times, event.time, side="right") - 1] += event.impulse_contact
    return found


def _furthest(ours: list[Interval], theirs: list[Interval], end: float) -> float:
    """Return the largest distance of a beginning or an end from the nearest one of the others [s]."""
    return max((min([end - i[k], *(abs(i[k] - j[k]) for j in theirs)]) for i in ours for k in (0, 1)), default=0.0)
