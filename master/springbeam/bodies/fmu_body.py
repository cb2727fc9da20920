"""An FMU as a body: a table says which variable has which role, a port makes its steps."""

from __future__ import annotations

from math import isfinite
from typing import Any, NamedTuple

from ..scene.partners import ForeignFmu
from .functions import WARNING
from .port import CANNOT, Port, Reading
from .protocol import (
    NO_FORCE,
    Body,
    FmuError,
    Force,
    Motion,
    StepRefused,
)


class FmuState(NamedTuple):
    """State of a body outside of the FMU."""

    motion: Motion = Motion(0.0, 0.0, 0.0, 0.0)
    #: Motion and energies as the FMU has returned them, with the work of impulses since.
    reported: tuple[float, ...] = ()
    pending: float = 0.0  #: upward impulse that the FMU applies at the start of its next step [N·s]


#: Roles of variables in a body, as the keys of a scene name them.
MOTION = ForeignFmu.MOTION
ENERGIES = ForeignFmu.ENERGIES


class FmuBody(Body):
    """A body of an FMU: what the numbers of its port mean.

    Its table says which variable has which role: ``force``, ``impulse``, those of `MOTION` and `ENERGIES`,
    ``acceleration``.
    """

    state: Any
    _port: Port
    _n_motion = 4  #: how many of the outputs are the motion; the others are energies
    #: Whether anything happened since the state was marked.
    _moved = False
    #: Steps begun, and how often the state was set back.
    steps_made: int = 0
    rewinds: int = 0

    def _begin(self, mass: float) -> None:
        """Start from the motion of the initialised FMU; an impulse at the end moves ``mass`` [kg]."""
        if not isfinite(mass):
            raise FmuError(f"{self._port.path}: the mass of its end is {mass}")
        self.mass = mass
        try:
            self._take(self._port.read())
        except StepRefused as refused:
            raise FmuError(f"{self._port.path}: starts with a motion that is {refused}") from refused
        super().mark()

    def mark(self) -> None:
        port = self._port
        if (status := port.get_state()) > WARNING:
            raise port.failed(status, CANNOT["get_state"])
        self._moved = False
        self._marked = self.state

    def rewind(self) -> None:
        if self._moved:
            port = self._port
            if (status := port.set_state()) > WARNING:
                raise port.failed(status, CANNOT["set_state"])
            self._moved = False
            self.state = self._marked
            self.rewinds += 1

    def motion(self) -> Motion:
        motion: Motion = self.state.motion
        return motion

    def apply_impulse(self, impulse: float) -> None:
        # The FMU applies it at the start of its next step; motion and energies already show it.
        motion, reported, pending, *_ = self.state
        self._moved = True
        velocity = motion.velocity + impulse / self.mass
        n = self._n_motion
        work = 0.5 * impulse * (motion.velocity + velocity)
        reported = (*reported[:n], *[kinetic + work for kinetic in reported[n : n + 1]], *reported[n + 1 :])
        self.state = self.state._replace(
            motion=motion._replace(velocity=velocity), reported=reported, pending=pending + impulse
        )

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE) -> Motion:
        self.steps_made += 1
        self._moved = True
        return self._take(self._port.step(self._given(time, size, contact, foundation)), size)

    def _given(self, time: float, size: float, contact: Force, foundation: Force) -> tuple[float, ...]:
        """Return what the port takes for a step under these forces and the loads."""
        raise NotImplementedError

    def _tried(self, time: float, size: float, foundation: Force = NO_FORCE, read: Reading | None = None) -> Any:
        """Return the outputs, or what ``read`` does, after a step under the loads, which is undone."""
        self.steps_made += 1
        self.rewinds += 1
        return self._port.trial(self._given(time, size, NO_FORCE, foundation), read)

    def _take(self, reported: tuple[float, ...], size: float = 0.0) -> Motion:
        """Set motion and energies to the outputs after a step of ``size`` [s]; no impulse is pending any more."""
        raise NotImplementedError

    def close(self) -> None:
        self._port.close()
