"""The steps of a run, without the rows of events that end no step."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from typing import Any, NamedTuple

import numpy as np

from ...motion.events import Event, EventKind
from ...motion.paths import Path, derivative, value
from ...results.records import Rows

#: Largest angle by which a wave turns in a part of a step [rad], and parts of a step at most: its path has as many
#: coefficients.
_TURN = 1.5
_PARTS = 6
#: The largest angle of a soft contact [rad]: it reverses what it finds misplaced, a difference of large numbers.
_CONTACT_TURN = 0.2


class StepRecords(NamedTuple):
    """Records of steps (`springbeam.results.records.STEP`), (n,) each."""

    before: Rows  #: at the start of each step
    ends: Rows  #: at its end
    last: Rows  #: at its end, after all events there
    size: np.ndarray  #: [s]

    @classmethod
    def of(cls, records: np.ndarray) -> StepRecords:
        """Return those of all ``records`` of a run."""
        made = np.flatnonzero(records["size"] > 0.0)
        last = np.append(made[1:], len(records)) - 1
        return cls(Rows(records, made - 1), Rows(records, made), Rows(records, last), records["size"][made])

    def among(self, which: slice) -> StepRecords:
        """Return ``which`` of them."""
        before, ends, last = (rows.among(which) for rows in (self.before, self.ends, self.last))
        return StepRecords(before, ends, last, self.size[which])

    def parts(self, least: int, fastest: float, contact: float = 0.0) -> int:
        """Return in how many equal parts of each step, at least, waves up to ``fastest`` [rad/s] are seen.

        ``contact`` is the frequency of the ends in a soft contact [rad/s].
        """
        turns = max(fastest / _TURN, contact / _CONTACT_TURN)
        return max(least, min(ceil(turns * float(self.size.max())), _PARTS))

    def ended_by(self, kind: EventKind, events: Sequence[Event]) -> np.ndarray:
        """Return the number of the step that each of the ``events`` of a ``kind`` ends, but those of the start."""
        start = self.before["events"][0]
        number = [n for n, event in enumerate(events, 1) if event.kind is kind and n > start]
        return np.searchsorted(self.last["events"], number)


def path_of(steps: StepRecords, position: str, velocity: str) -> Any:
    """Return the path of a ``position`` inside each step, the coefficients of `Path`, shape (6, n)."""
    size: Any = steps.size
    start: Any = steps.before[f"{position}_after"], steps.before[f"{velocity}_after"]
    end: Any = steps.ends[position], steps.ends[velocity]
    means: Any = steps.ends[f"{position}_integral"] / size, steps.ends[f"{position}_integral_2"] / size**2
    powers: Any = Path.through(start, end, size, means).powers
    return np.array(powers)


def penetration(steps: StepRecords) -> Any:
    """Return the path of y − u inside each step, as of `path_of`."""
    return path_of(steps, "y", "z") - path_of(steps, "u_tip", "v_tip")


def accelerations(steps: StepRecords, position: str, velocity: str, share: float) -> Any:
    """Return those at a ``share`` of each step [m/s²], of the path of an end through both its ends and the moments."""
    return value(derivative(derivative(path_of(steps, position, velocity))), share) / steps.size**2
