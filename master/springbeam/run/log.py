"""The log of a run: its records are checked a thousand at a time, or each second, and go to the recorder."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic

import numpy as np

from ..motion.events import Event
from ..results.columns import first_not_finite
from ..results.recording import Recorder
from ..results.records import STEP
from ..results.trajectory import SHAPE_COLUMNS
from .outcome import RunStopped

#: Most records that are checked and recorded together.
TOGETHER = 1024
#: Longest time that a record waits for it [s].
_WAITS = 1.0
#: Judges the next records of a run, shape (n,), beside its first one, shape (1,): returns whether each is wrong, and
#: what says by its number why the run stops there.
Check = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, Callable[[int], str]]]


class Log:
    """What a run says of its steps, on its way to ``recorder``; ``checks`` judge records whose numbers are finite."""

    def __init__(self, recorder: Recorder, *checks: Check) -> None:
        self._recorder = recorder
        self._checks = checks
        #: What the recorder does not have yet: records as of `springbeam.results.records.packed`, events of these and
        #: the next one, and the beam's shapes at some records, the numbers of `SHAPE_COLUMNS`.
        self.records = list[bytes]()
        self.events = list[Event]()
        self.shapes = list[np.ndarray]()
        self._events = 0  #: number of those that the recorder has
        self._first = np.empty(0, STEP)  #: record of the run
        self.due = monotonic() + _WAITS  #: when the next records go to the recorder, however few [s]

    def flush(self) -> None:
        """Check the records and hand them to the recorder.

        Raises RunStopped where one shows that the run has gone wrong; what came after it is dropped.
        """
        self.due = monotonic() + _WAITS
        if not self.records:
            return
        steps, stopped = self._sound(np.frombuffer(b"".join(self.records), STEP))
        shapes = np.array(self.shapes).reshape(-1, len(SHAPE_COLUMNS))
        last, known = (steps["time"][-1], int(steps["events"][-1])) if len(steps) else (-np.inf, 0)
        events = self.events[: max(known - self._events, 0)]
        self._events += len(events)
        self.records = []
        self.events = []
        self.shapes = []
        self._recorder.keep(steps, events, shapes[shapes[:, 0] <= last])
        if stopped is not None:
            raise stopped

    def _sound(self, steps: np.ndarray) -> tuple[np.ndarray, RunStopped | None]:
        """Return the next records up to where the run has gone wrong, and how; those not finite are left out."""
        if not self._first.size:
            self._first = steps[:1].copy()
        stopped = None
        time = steps["time"]
        infinite = first_not_finite(self._recorder.scene, steps, self._first)
        if infinite is not None:
            row, what = infinite
            cause = f"{what} at t = {float(time[row])!r} s: not a finite number"
            stopped = RunStopped(cause, float(time[row]))
            steps = steps[:row]
        for check in self._checks if len(steps) else ():
            wrong, cause_at = check(steps, self._first)
            if wrong.any():
                row = int(np.argmax(wrong))
                stopped = RunStopped(cause_at(row), float(time[row]))
                steps = steps[: row + 1]
        return steps, stopped
