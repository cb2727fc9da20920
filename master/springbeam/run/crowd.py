"""Events that crowd: how many may follow each other closely before the contact is said to chatter."""

from __future__ import annotations

from .outcome import RunStopped
from .stepping import State

#: Events closer than this fraction of H are at once; so many of them and the contact is said to chatter. Impacts that
#: die out are up to 370 (e = 0.997) between this and `_NO_TIME` of `springbeam.run.detection`, where they are seated.
SIMULTANEOUS, _MAX_SIMULTANEOUS = 1e-6, 500
#: Events within H. Impacts that die out are up to 18,000 (e = 0.999); those of a lossy body on a lossless stop are
#: without end.
_MAX_IN_STEP = 20_000


def count_crowd(state: State, end: float, size: float, macro_step: float) -> None:
    """Count a step of ``size`` [s] that was cut and ends at ``end`` [s]. Raises RunStopped if events crowd."""
    state.at_once = _counted(state.at_once, end, SIMULTANEOUS * macro_step)
    state.in_step = _counted(state.in_step, end, macro_step)
    if state.at_once[0] > _MAX_SIMULTANEOUS:
        raise RunStopped(f"the contact chatters: {_MAX_SIMULTANEOUS} events at once", end - size)
    if state.in_step[0] > _MAX_IN_STEP:
        raise RunStopped(
            f"the contact chatters: {_MAX_IN_STEP} events within a macro step of {macro_step:g} s; a restitution "
            "below 1 lets impacts die out",
            end - size,
        )


def _counted(events: tuple[int, float], end: float, span: float) -> tuple[int, float]:
    number, since = events
    return (number + 1, since) if end - since <= span else (1, end)
