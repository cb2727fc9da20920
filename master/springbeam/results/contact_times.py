"""When ends touch: contacts of tip and spring and with the foundation, as the phases between two events."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import dropwhile, groupby, zip_longest

import numpy as np

from ..motion.events import Event
from ..scene import Scene

#: Beginning and end of a contact [s]; an impact that separates at once has no length.
Interval = tuple[float, float]
#: Numbers of the events that begin and end a contact; ``None`` if the run ends in it.
Between = tuple[int, int | None]


def tip_contacts(scene: Scene, events: Iterable[Event], end: float) -> list[Interval]:
    """Return the contacts of tip and spring; a last one without an end ends at ``end`` [s]. A single body has none."""
    events = list(events)
    return _times(between_tip_and_spring(events) if scene.coupled else [], events, end)


def foundation_contacts(events: Iterable[Event], end: float) -> list[Interval]:
    """Return the impacts on the foundation, and the rests on it; a last rest without an end ends at ``end`` [s]."""
    events = list(events)
    return _times(with_foundation(events), events, end)


def between_tip_and_spring(events: Iterable[Event]) -> list[Between]:
    """Return the contacts of tip and spring."""
    return _between((number, event.joint != "free") for number, event in enumerate(events))


def with_foundation(events: Iterable[Event]) -> list[Between]:
    """Return the impacts on the foundation, and the rests on it."""
    changes = []
    for number, event in enumerate(events):
        if event.kind.strikes:
            changes.append((number, True))
        changes.append((number, event.seated))
    return _between(changes)


def _between(changes: Iterable[tuple[int, bool]]) -> list[Between]:
    """Return the contacts by ``changes``: numbers of events, and whether there is contact from there on."""
    begun = dropwhile(lambda change: not change[1], changes)
    edges = [next(alike)[0] for _, alike in groupby(begun, key=lambda change: change[1])]
    return list(zip_longest(edges[::2], edges[1::2]))


def _times(contacts: Iterable[Between], events: Sequence[Event], end: float) -> list[Interval]:
    return [(events[first].time, end if last is None else events[last].time) for first, last in contacts]


def kicks(times: np.ndarray, events: Iterable[Event]) -> np.ndarray:
    """Return the events' impulses on the tip [N·s] at each of ``times`` [s], those of one time at its last row."""
    at = np.array([(event.time, event.impulse_contact) for event in events]).reshape(-1, 2)
    return np.bincount(np.searchsorted(times, at[:, 0], side="right") - 1, at[:, 1], len(times))
