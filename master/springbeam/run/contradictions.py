"""Results that contradict the setup: an end below a rigid stop, ends beyond each other, times beyond the run.

A step that misses an event leaves no other trace, so the records of every run are searched for these.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ..contact.interface import Rigid
from ..motion.events import Event
from ..results.spans import Extremes, rounding_of_steps, span
from .setup import Setup

#: Columns whose extremes are searched.
PLACES = ("u_tip", "y", "gap")
#: Largest penetration over the range of an end: the error of curves between right rows.
_MOST = 0.01
#: Times closer than this share of the run are one.
_SAME = 1e-9


def contradictions(
    setup: Setup,
    steps: np.ndarray,
    events: Sequence[Event],
    contact_time: float,
    places: Mapping[str, Extremes],
) -> list[str]:
    """Return in words the results of a run that contradict its ``setup``; a right run has none.

    Parameters
    ----------
    setup
        What was run.
    steps, events
        Of the whole run so far; steps of dtype `springbeam.results.records.STEP`.
    contact_time
        Total duration of all contacts of the run [s].
    places
        Extremes of `PLACES`.
    """
    if not len(steps):
        return []
    rounding = rounding_of_steps(steps, setup.tolerance)
    return [*_ends(setup, rounding, *(places[name] for name in PLACES)), *_times(steps, events, contact_time)]


def _ends(setup: Setup, rounding: float, tip: Extremes, top: Extremes, gap: Extremes) -> Iterator[str]:
    meeting = isinstance(setup.law, Rigid)
    if setup.floor is not None:
        places, name = (top, "the spring's top") if setup.lower else (tip, "the tip")
        if setup.floor - places.lowest > _MOST * _range(places, rounding):
            yield (
                f"{name} is at {places.lowest:.6g} m at {places.lowest_time:.6g} s, below the rigid stop at "
                f"{setup.floor:.6g} m"
            )
    if meeting and -gap.lowest > _MOST * min(_range(tip, rounding), _range(top, rounding)):
        yield f"the tip is {-gap.lowest:.6g} m below the spring's top at {gap.lowest_time:.6g} s"


def _range(places: Extremes, rounding: float) -> float:
    return span((places.lowest, places.highest), rounding)


def _times(steps: np.ndarray, events: Sequence[Event], contact_time: float) -> Iterator[str]:
    start = float(steps["time"][0])
    end = float(steps["time"][-1])
    slack = _SAME * (end - start)
    before = start
    for event in events:
        if not before - slack <= event.time <= end + slack:
            yield (
                f"the event {event.kind} at {event.time:.9g} s is not between the one before, or the start, at "
                f"{before:.9g} s and the end at {end:.9g} s"
            )
            return
        before = event.time
    if contact_time > end - start + slack:
        yield f"contacts last {contact_time:.6g} s in a run of {end - start:.6g} s"
