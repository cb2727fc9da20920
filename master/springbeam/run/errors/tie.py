"""What ties leave open inside steps: ends that have one position at each row, and a gap between two."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...motion.events import Event, EventKind
from ...motion.paths import derivative, value
from ...results.records import joined
from .records import StepRecords, accelerations, penetration


class Tie(NamedTuple):
    """What is known of each step of ends that a rigid law joins, (n,) each but the first."""

    #: y − u [m] and its rate [m/s] at the ends of equal parts of each step in which they are joined.
    places: list[list[list[float]]]
    tied: np.ndarray  #: whether the ends are joined over the step
    tied_after: np.ndarray  #: and after its events
    apart: np.ndarray  #: v − z after these [m/s]
    pull: np.ndarray  #: C/ẏ where a tie is released at the end of the step: the impulse by an error of y [N·s/m]
    meet: np.ndarray  #: z − v where ends meet at the end of the step and part at once [m/s]
    part: np.ndarray  #: ü − ÿ with which they do [m/s²]


def tie(steps: StepRecords, events: Sequence[Event], parts: int, quiet: float) -> Tie:
    """Return it for so many ``parts`` of each step; steps whose gap stays below ``quiet`` [m] have one."""
    tied = joined(steps.before)
    path = penetration(steps)[:, tied]
    slope = derivative(path)
    shares = (np.arange(parts) + 1.0) / parts
    inside = np.array([[value(path, s), value(slope, s) / steps.size[tied]] for s in shares]).transpose(2, 0, 1)
    whole = np.abs(inside[:, :, 0]).max(axis=1) <= quiet
    found = (part[-1:] if one else part for part, one in zip(inside.tolist(), whole.tolist(), strict=True))
    places = [next(found) if together else [] for together in tied.tolist()]
    released = (steps.before["phase"] == 1.0) & (steps.last["phase"] == 0.0) & (steps.ends["z"] != 0.0)
    pull = np.divide(steps.ends["contact_force_end"], steps.ends["z"], out=np.zeros(len(tied)), where=released)
    apart = steps.last["v_tip_after"] - steps.last["z_after"]
    tied_after = joined(steps.last)
    meet, part = np.zeros((2, len(tied)))
    at = steps.ended_by(EventKind.IMPACT, events)
    at = at[~tied[at] & ~tied_after[at]]
    if len(at):
        meet[at] = (steps.ends["z"] - steps.ends["v_tip"])[at]
        part[at] = (accelerations(steps, "u_tip", "v_tip", 1.0) - accelerations(steps, "y", "z", 1.0))[at]
    return Tie(places, tied, tied_after, apart, pull, meet, part)
