"""Contacts of tip and spring and with the foundation, as intervals of the phases that events begin."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import dropwhile, groupby, zip_longest

import numpy as np

from ..motion.events import Event
from ..scene import Scene

#: Beginning and end of a contact [s]; an impact that separates at once has no length.
Interval = tuple[float, float]


def tip_contacts(scene: Scene, events: Iterable[Event], end: float) -> list[Interval]:
    """Return the contacts of tip and spring; a last one without an end ends at ``end`` [s]. A single body has none."""
    if not scene.coupled:
        return []
    return _intervals(((event.time, event.joint != "free") for event in events), end)


def foundation_contacts(events: Iterable[Event], end: float) -> list[Interval]:
    """Return the impacts on the foundation, and the rests on it; a last rest without an end ends at ``end`` [s]."""
    changes = []
    for event in events:
        if event.kind.strikes:
            changes.append((event.time, True))
        changes.append((event.time, event.seated))
    return _intervals(changes, end)


def _intervals(changes: Iterable[tuple[float, bool]], end: float) -> list[Interval]:
    """Return the intervals of contact from ``changes``: times [s], and whether there is contact from then on."""
    begun = dropwhile(lambda change: not change[1], changes)
    edges = [next(alike)[0] for _, alike in groupby(begun, key=lambda change: change[1])]
    return list(zip_longest(edges[::2], edges[1::2], fillvalue=end))


def kicks(times: np.ndarray, events: Iterable[Event]) -> np.ndarray:
    """Return the events' impulses on the tip [N·s] at each of ``times`` [s], those of one time at its last row."""
    at = np.array([(event.time, event.impulse_contact) for event in events]).reshape(-1, 2)
    return np.bincount(np.searchsorted(times, at[:, 0], side="right") - 1, at[:, 1], len(times))
