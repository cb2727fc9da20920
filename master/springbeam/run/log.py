"""The log of a run: its records, which are checked some hundred at a time and handed to the recorder."""

from __future__ import annotations

import numpy as np

from ..results.columns import first_not_finite
from ..results.recording import Recorder
from ..results.steps import STEP
from ..results.trajectory import SHAPE_COLUMNS, Event
from ..scene import Scene
from .ledger import Balance
from .neglect import Past, neglected
from .outcome import RunStopped

#: Records that are checked and handed on together.
TOGETHER = 256


class Log:
    """What a run says of its steps, on its way to ``recorder``; ``balance`` judges its energy, if anything does."""

    def __init__(self, scene: Scene, recorder: Recorder, balance: Balance | None = None) -> None:
        self._scene, self._recorder, self._balance = scene, recorder, balance
        self._stiffness = scene.driver_stiffness
        self.events = 0  #: number of events so far
        #: What the recorder does not have yet; records are as of `springbeam.results.steps.packed`.
        self.records, self._events, self._shapes = list[bytes](), list[Event](), list[list[float]]()
        #: What the checks of later records need of those before.
        self._first, self._past = np.empty(0, STEP), Past()

    def happened(self, event: Event) -> None:
        """Take an event of the step whose record comes next."""
        self.events += 1
        self._events.append(event)

    def show(self, time: float, shape: np.ndarray) -> None:
        """Take the beam's shape [m], shape (21,), at the ``time`` [s] of the last record. Raises RunStopped."""
        if not np.isfinite(shape).all():
            raise RunStopped("the beam's shape is not finite", time)
        self._shapes.append([time, *shape.tolist()])

    def catch_up(self) -> None:
        """Take note of the records that the recorder has of a run that goes on."""
        steps = self._recorder.steps()
        if len(steps):
            self.events, self._first = int(steps["events"][-1]), steps[:1].copy()
            if self._balance is not None:
                self._balance.first_wrong(steps)
            if self._stiffness is not None:
                self._past = neglected(steps, self._stiffness, self._past).past

    def hand_over(self, macro_step: float) -> None:
        """Check the records and hand them to the recorder.

        Raises RunStopped where one shows that the run has gone wrong; what came after it is dropped. ``macro_step`` [s]
        is named then.
        """
        if not self.records:
            return
        steps, stopped = self._sound(np.frombuffer(b"".join(self.records), STEP), macro_step)
        last, known = (steps["time"][-1], int(steps["events"][-1])) if len(steps) else (-np.inf, self.events)
        shapes = np.reshape(self._shapes, (-1, len(SHAPE_COLUMNS)))
        events = self._events[: len(self._events) - (self.events - known)] if len(steps) else []
        self.records, self._events, self._shapes = [], [], []
        self._recorder.keep(steps, events, shapes[shapes[:, 0] <= last])
        if stopped is not None:
            raise stopped

    def _sound(self, steps: np.ndarray, macro_step: float) -> tuple[np.ndarray, RunStopped | None]:
        """Return the next records up to where the run has gone wrong, and how."""
        if not self._first.size:
            self._first = steps[:1].copy()
        times, stopped = steps["time"].tolist(), None
        if (found := first_not_finite(self._scene, steps, self._first)) is not None:
            row, what = found
            steps, stopped = steps[:row], RunStopped(f"{what} at t = {times[row]!r} s: not a finite number", times[row])
        if len(steps) and self._balance is not None and (wrong := self._balance.first_wrong(steps)) is not None:
            row, share = wrong
            steps, stopped = steps[: row + 1], RunStopped(self._balance.cause(share, macro_step), times[row])
        if len(steps) and self._stiffness is not None:
            feedback, allowed = self._scene.coupling.feedback, self._scene.coupling.feedback_tolerance
            motion, of_penetration, self._past = neglected(steps, self._stiffness, self._past)
            if (of_penetration > allowed).any():
                row = int(np.argmax(of_penetration > allowed))
                cause = (
                    f"coupling.feedback = {feedback!r} may by now neglect {motion[row]:.3g} m of the driving end's "
                    f"motion, {of_penetration[row]:.2g} of the largest penetration; allowed is "
                    f"coupling.feedback_tolerance = {allowed:g}. Take 'two_way', or allow more"
                )
                steps, stopped = steps[: row + 1], RunStopped(cause, times[row])
        return steps, stopped
