"""Each contact of a run: when, how long, its impulse, peak force, depth and loss, velocities before and after it."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, nan

import numpy as np

from ..motion.events import Event
from ..scene import Scene
from .contact_times import between_tip_and_spring, with_foundation
from .dense import inside
from .law_peak import peak_of_law
from .records import impulse
from .trajectory import Contact, Trajectory
from .window_peak import peak_force


def contacts_as_array(each_contact: Sequence[Contact]) -> np.ndarray:
    """Return contacts as an array of their columns, NaN for ``None``."""
    kind = np.dtype([(name, "<f8") for name in Contact._fields])
    return np.array([tuple(nan if value is None else value for value in contact) for contact in each_contact], kind)


def contacts(scene: Scene, steps: np.ndarray, events: Sequence[Event], window: float | None) -> list[Contact]:
    """Return the contacts of a run in their order; a law that joins the ends for good has none.

    Parameters
    ----------
    scene
        As run.
    steps, events
        Of the whole run so far; steps of dtype `springbeam.results.records.STEP`.
    window
        Over which the force of a rigid contact is averaged [s]; ``None`` for a soft law, or if it is not known, as of a
        run that was killed.
    """
    if not len(steps) or (scene.coupled and scene.contact.lasting):
        return []
    events = events[: int(steps["events"][-1])]  # a run that was killed may have some without their records
    between = between_tip_and_spring(events) if scene.coupled else with_foundation(events)
    run = _Run(scene, steps, events, window)
    return [run.contact(*each) for each in between]


def contacts_of(run: Trajectory) -> list[Contact]:
    """Return the contacts of ``run`` in their order; none of one without steps, as by a reference."""
    steps = np.empty(0) if run.steps is None else run.steps
    return contacts(run.scene, steps, run.events, run.summary.get("contact_force_window"))


class _Run:
    """What all contacts of a run follow from; parameters as of `contacts`."""

    def __init__(self, scene: Scene, steps: np.ndarray, events: Sequence[Event], window: float | None) -> None:
        self._steps = steps
        self._events = events
        self._window = window
        self._law = scene.soft_law
        #: Whether there is a foundation and nothing but the lower body above it, on which its impulses act.
        self._lower = scene.upper is None
        self._pair = scene.coupled
        force = "foundation_force" if self._lower else "contact_force"
        self._gained = impulse(steps, force)
        self._shared = np.zeros(len(steps))  #: time of a step that contacts by a soft law overlap [s]
        if self._law is not None:
            for each in between_tip_and_spring(events):
                self._shared[self._rows(*each)] += self._overlap(*each)

    def contact(self, first: int, last: int | None) -> Contact:
        begin, end = self._times(first, last)
        if self._law is not None:
            after = (None, None) if last is None else _velocities(self._events[last])
            return Contact(begin, end - begin, *self._soft(first, last), *_velocities(self._events[first]), *after)
        rows = self._rows(first, last)
        events = self._events[first : None if last is None else last + 1]
        return Contact(begin, end - begin, *self._rigid(rows, events), *self._velocities(rows, last is None))

    def _times(self, first: int, last: int | None) -> tuple[float, float]:
        """Return when a contact begins and ends [s]."""
        return self._events[first].time, float(self._steps["time"][-1]) if last is None else self._events[last].time

    def _rows(self, first: int, last: int | None) -> slice:
        """Return the records of a contact, from that of its first event to that of its last one."""
        begin, end = np.searchsorted(self._steps["events"], [first + 1, inf if last is None else last + 1])
        return slice(int(begin), int(end) + (last is not None))

    # -- soft ----------------------------------------------------------------------------------------------------------

    def _overlap(self, first: int, last: int | None) -> np.ndarray:
        """Return how long the step of each record of a contact is in it [s]."""
        begin, end = self._times(first, last)
        steps = self._steps[self._rows(first, last)]
        since = np.maximum(begin, steps["time"] - steps["size"])
        return np.maximum(np.minimum(end, steps["time"]) - since, 0.0)

    def _soft(self, first: int, last: int | None) -> tuple[float, float, float, float, float]:
        """Return impulse, peak force and its time, depth and loss; contacts share a step by their times in it."""
        assert self._law is not None
        rows = self._rows(first, last)
        steps = self._steps[max(rows.start - 1, 0) : rows.stop]
        shared = self._shared[rows]
        weights = np.divide(self._overlap(first, last), shared, out=np.ones_like(shared), where=shared > 0.0)
        lost = np.diff(self._steps["law_dissipated"][rows], prepend=steps["law_dissipated"][0])
        deepest = -inside(False, steps, "gap").extremes["gap"].lowest
        return (
            float(weights @ self._gained[rows]),
            *peak_of_law(self._law, steps),
            max(deepest, 0.0),
            float(weights @ lost),
        )

    # -- rigid ---------------------------------------------------------------------------------------------------------

    def _rigid(self, rows: slice, events: Sequence[Event]) -> tuple[float, float | None, float | None, float, float]:
        """Return impulse, peak force and its time, depth and loss."""
        steps = self._steps[rows].copy()
        steps["size"][0] = 0.0  # the step before the contact is no part of it
        kicked = [event.impulse_foundation if self._lower else event.impulse_contact for event in events]
        given = float(self._gained[rows][1:].sum()) + sum(kicked)
        duration = float(steps["time"][-1] - steps["time"][0])
        peak: tuple[float | None, float | None] = (None, None)
        if self._window is not None:
            peak = max(given, 0.0) / self._window, float(steps["time"][0])
            if duration > 0.0 and not self._lower:
                peak = peak_force(steps, events, self._window)
        height = "y" if self._lower or self._pair else "u_tip"
        depth = float(steps[f"{height}_after"][0] - inside(True, steps, height).extremes[height].lowest)
        lost = sum(event.energy_loss for event in events if event.kind.strikes is not self._pair)
        return given, *peak, max(depth, 0.0) if self._pair else 0.0, lost

    def _velocities(self, rows: slice, lasts: bool) -> tuple[float, float, float | None, float | None]:
        """Return the velocities of both ends before the first event and after the last one [m/s]."""
        first = self._steps[rows.start]
        last = self._steps[rows.stop - 1]
        after = (None, None) if lasts else (float(last["v_tip_after"]), float(last["z_after"]))
        return float(first["v_tip"]), float(first["z"]), *after


def _velocities(event: Event) -> tuple[float, float]:
    return event.v_tip or 0.0, event.z or 0.0
