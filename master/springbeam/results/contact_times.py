"""When contact opens and closes and the foundation is struck, and how far two runs are apart in it.

What lasts less than a window of a few macro steps is no evidence either way: whether a contact opens and closes again
within a macro step is decided by rounding.
"""

from __future__ import annotations

import itertools

from .trajectory import Trajectory

#: From when to when something is touched [s]; an impact that lets go at once has no length.
Interval = tuple[float, float]


def apart(first: Trajectory, second: Trajectory, window: float) -> tuple[float, int]:
    """How far the times of two runs are apart [s], and how many of ``second`` that is about.

    Each beginning and end of a contact is compared with the nearest one of the other run, or with the end of the run,
    if it is the later. Contacts closer than ``window`` [s] to each other are one, those between tip and spring that
    are shorter than that are left out.
    """
    end = float(second.time[-1])
    worst, number = 0.0, 0
    for intervals, least in ((_joined, window), (_on_foundation, 0.0)):
        ours, theirs = intervals(first, end), intervals(second, end)
        worst = max(worst, _furthest(_lasting(ours, window, least), theirs, end))
        lasting = _lasting(theirs, window, least)
        worst = max(worst, _furthest(lasting, ours, end))
        number += sum(t < end for interval in lasting for t in set(interval))
    return worst, number


def changes_of_contact(run: Trajectory) -> int:
    """How often contact opened or closed or the foundation was struck, after the first time."""
    times = [t for intervals in (_joined, _on_foundation) for i in intervals(run, float("inf")) for t in set(i)]
    return max(sum(t < float("inf") for t in times) - 1, 0)


def _joined(run: Trajectory, end: float) -> list[Interval]:
    """Contacts of tip and spring."""
    edges: list[float] = []
    events = [e for e in run.events if e.kind in ("impact", "separation", "release", "retie")]
    for event, after in itertools.zip_longest(events, events[1:]):
        if event.kind == "release":  # to `touch`, or to `free`
            joined = run.phase[-1] != "free" if after is None else after.kind != "impact"
        else:
            joined = event.kind != "separation"
        if joined == (len(edges) % 2 == 0):
            edges.append(event.time)
    if len(edges) % 2:
        edges.append(end)
    return list(zip(edges[::2], edges[1::2], strict=True))


def _on_foundation(run: Trajectory, end: float) -> list[Interval]:
    """Impacts on the foundation, and rests on it."""
    intervals: list[Interval] = []
    since: float | None = None
    for event in run.events:
        if event.kind == "stop_impact":
            intervals.append((event.time, event.time))
        elif event.kind == "seated":
            since = event.time
        elif event.kind in ("unseated", "separation") and since is not None:
            intervals.append((since, event.time))
            since = None
    return intervals if since is None else [*intervals, (since, end)]


def _lasting(intervals: list[Interval], window: float, least: float) -> list[Interval]:
    """Closer than ``window`` they are one; then those of at least ``least``."""
    merged: list[Interval] = []
    for begin, end in intervals:
        if merged and begin - merged[-1][1] < window:
            merged[-1] = (merged[-1][0], end)
        else:
            merged.append((begin, end))
    return [(begin, end) for begin, end in merged if end - begin >= least]


def _furthest(ours: list[Interval], theirs: list[Interval], end: float) -> float:
    """Largest distance of a beginning or an end from the nearest one of the others."""
    return max((min([end - i[k], *(abs(i[k] - j[k]) for j in theirs)]) for i in ours for k in (0, 1)), default=0.0)
