"""What the coupling knows of a body: one end that a force moves. The coupling knows nothing of FMPy."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ..scene import Load, SceneError

#: A force over one step, as FMI carries it: (F, Ḟ, F̈) at the step's start [N, N/s, N/s²].
Force = tuple[float, float, float]
#: Step sizes for which a body or a coupling remembers its response: the macro step's, and some of steps cut by events.
SIZES_REMEMBERED = 64
#: An impulse that changes the velocity by less than this share is rounding.
ROUNDED_IMPULSE = 1e-12
#: No force over the whole step.
NO_FORCE: Force = (0.0, 0.0, 0.0)
#: Length of a trial step that shows an acceleration, over a macro step.
_TRIAL = 2.0**-8


class StepRefused(RuntimeError):
    """A body could not complete a step (fmi2Discard, a numerical failure, a non-finite result)."""


class BodyFailed(RuntimeError):
    """A body cannot go on, whatever the step (fmi2Error of any other call, fmi2Fatal)."""


class FmuError(BodyFailed):
    """An FMU cannot be found, loaded or initialised, or a call has failed; the message names file and cause."""


class Motion(NamedTuple):
    """The interface end of a body at the end of its last step."""

    displacement: float  #: w [m]
    velocity: float  #: ẇ [m/s]
    integral: float  #: ∫ w dτ over the last step [m·s]
    integral_2: float  #: ∫∫ w dτ dτ over the last step [m·s²]


_T = TypeVar("_T", bound=tuple[Any, ...])
#: ``made_of(kind, values)`` is ``kind(*values)`` of a named tuple in a third of the time.
made_of: Callable[[type[_T], tuple[Any, ...]], _T] = tuple.__new__

#: The interface ends (tip, lower end): the spring top, or without a spring the foundation.
Ends = tuple[Motion, Motion]


class Energies(NamedTuple):
    """Energies [J]: ``dissipated`` since the start, ``load_potential`` minus the work of loads, up to a constant."""

    kinetic: float
    potential: float
    dissipated: float
    load_potential: float


class InnerForces(NamedTuple):
    """Inner forces of a beam at the end of its last step."""

    acceleration: float  #: of its tip [m/s²]
    clamp_force: float  #: of the clamp on the beam, upward [N]
    clamp_moment: float  #: of the clamp on the beam, counter-clockwise [N·m]
    bending_stress: float  #: the largest along the beam [Pa]; 0 where the height of its section is not known


@dataclass(frozen=True)
class Abilities:
    """Abilities of a body; the defaults are those of our own."""

    state: bool = True  #: its state can be saved and restored
    any_size: bool = True  #: its steps may have any size
    velocity: bool = True  #: it returns its velocity
    integrals: int = 2  #: it returns ∫x (1) and ∫∫x (2) over a step
    slopes: int = 2  #: highest derivative of a force over a step that it follows
    impulse: bool = True  #: it takes impulses
    energies: bool = True  #: it returns its energies
    order: int = 2  #: its displacement answers a force to this order of its solver: 1, or 2 and more


#: Abilities that a body has by a method, which it may leave out.
_BY_METHOD = {"impulse": "apply_impulse", "energies": "energies"}


class Body:
    """A body with one interface end and a state that can be restored; a body of your own derives from it.

    Impulses act at once: ``motion`` and ``energies`` show the state after them. Every method but ``close`` may raise
    BodyFailed.
    """

    #: All of the body that changes, a value that is replaced and never changed in place.
    state: Any = None
    #: Mass that an impulse on the end moves [kg].
    mass: float
    #: Whether columns have its acceleration and inner forces: true of our own beam and spring.
    reports = False

    #: What a run has to say of the body.
    warnings: tuple[str, ...] = ()
    #: Damping of the velocity of the end [N·s/m]; ``None`` if unknown.
    damping: float | None = None
    #: Expected displacement of the end [m]; 0 if unknown.
    reach = 0.0
    #: Relative tolerance of the solver of its motion.
    tolerance = 0.0

    def stiffness(self, displacement: Any) -> Any:
        """Return ∂F/∂w [N/m] of `holding_force` at ``displacement`` [m], a float or an array; ``None`` if unknown."""
        return None

    @property
    def massless(self) -> bool:
        """Whether the end has no inertia: it takes the velocity of the end that it is joined to."""
        return self.mass == 0.0

    #: Declared abilities; `can` returns the actual ones.
    abilities = Abilities()
    #: Steps begun and states restored so far; ``None`` if not counted.
    steps_made: int | None = None
    rewinds: int | None = None
    #: Work that the end has received so far [J], if the energy of the interface judges the coupling.
    received: float | None = None

    def can(self) -> Abilities:
        """Return the `abilities` without those whose methods the class leaves out."""
        left_out = {
            ability: False
            for ability, method in _BY_METHOD.items()
            if getattr(getattr(self, method), "__func__", None) is getattr(Body, method)
        }
        return replace(self.abilities, **left_out)

    def take_place(self, *, upper: bool) -> None:
        """Receive, before the run, whether the body is the upper one."""

    def mark(self) -> None:
        """Save `state`: a value that the body replaces and never changes in place."""
        if self.state is None:
            raise NotImplementedError(f"{type(self).__name__} has neither mark nor state")
        self._marked = self.state

    def rewind(self) -> None:
        """Restore the saved state; any number of times."""
        self.state = self._marked

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE) -> Motion:
        """Advance from ``time`` by ``size`` [s] and return the `motion`.

        Parameters
        ----------
        contact, foundation
            C, which acts as +C on an upper body and −C on a lower one, and N, upward: (F, Ḟ, F̈) at ``time`` [N, s].

        Raises StepRefused to ask for a shorter step; ``rewind`` then recovers.
        """
        raise NotImplementedError

    def advance_alone(self, time: float, size: float) -> Motion:
        """Advance with nothing at the end; parameters and errors as of `advance`."""
        return self.advance(time, size, NO_FORCE)

    def motion(self) -> Motion:
        """Return the `Motion` at the end of the last step."""
        raise NotImplementedError

    def acceleration(self) -> float | None:
        """Return ẅ of the end [m/s²] in its present state, under the forces at the end of its last step.

        ``None`` if unknown; `trial_acceleration` may find it.
        """
        return None

    def trial_acceleration(self, time: float, size: float) -> float | None:
        """Return ẅ of the end [m/s²] in its present state at ``time`` [s], with the loads but no other force on it.

        It follows, to second order, from the velocities after two trial steps of a small share of ``size`` [s] and of
        half of it, which are undone: those after one step follow a force whatever the order of the body's solver, and
        displacements do not. ``None`` if the body makes no such steps.
        """
        if not (self.abilities.state and self.abilities.any_size and self.abilities.velocity):
            return None
        h = _TRIAL * size
        v = self.motion().velocity
        half = self._trial(time, 0.5 * h)
        end = self._trial(time, h)
        return None if half is None or end is None else (4.0 * half.velocity - end.velocity - 3.0 * v) / h

    def decay(self, time: float, size: float, speed: float) -> float | None:
        """Return the decrease of ẅ of the end per unit of velocity that an impulse adds [1/s].

        It follows from mass and damping, or without them from two trial steps at ``time`` [s] as of
        `trial_acceleration`, one of them after an impulse that adds ``speed`` [m/s]. ``None`` if the body makes none.
        """
        if self.damping is not None and self.stiffness(0.0) is not None:
            return self.damping / self.mass if 0.0 < self.mass < inf else 0.0
        before = self.state
        free = self.trial_acceleration(time, size)
        if free is None or not self.abilities.impulse:
            return None
        try:
            self.apply_impulse(self.mass * speed)
            after = self.trial_acceleration(time, size)
        finally:
            self.state = before
        return None if after is None else (free - after) / speed

    def _trial(self, time: float, size: float) -> Motion | None:
        """Return the motion after a step without force on the end, and undo it; ``None`` if it cannot be undone."""
        if self.state is None:
            return None
        before = self.state
        end = self.advance_alone(time, size)
        self.state = before
        return end

    def energies(self) -> Energies:
        """Return the stored and dissipated `Energies`; without this method the run warns that it cannot check them."""
        return Energies(0.0, 0.0, 0.0, 0.0)

    def inner_forces(self) -> InnerForces:
        """Return the inner forces of a beam that `reports`; called once a step."""
        raise NotImplementedError(f"{type(self).__name__} has no inner_forces, and says that it reports them")

    def shape(self) -> np.ndarray | None:
        """Return deflections [m], bending moments [N·m] and shear forces [N] one after another, shape (63,).

        Points are `springbeam.scene.statics.SHAPE_POINTS`; ``None`` for a body without a shape.
        """
        return None

    def apply_impulse(self, impulse: float) -> None:
        """Apply an upward impulse [N·s] on the end.

        The laws ``transmission`` and ``unilateral``, ``[stop]`` and a tie of ends of two velocities need it. An impulse
        within rounding counts as none.
        """
        if abs(impulse) > ROUNDED_IMPULSE * self.mass * abs(self.motion().velocity):
            raise BodyFailed(f"{type(self).__name__} has no apply_impulse, and meets an impulse of {impulse:.6g} N·s")

    def holding_force(self, displacement: float, velocity: float) -> float:
        """Return the upward force [N] that holds the end, as a stop does, at a displacement [m] and velocity [m/s]."""
        raise NotImplementedError(f"{type(self).__name__} has no holding_force, which a body seated on a stop needs")

    def expect_loads(self, loads: Sequence[Load]) -> None:
        """Receive, before the first step, the loads that act on the body. Raises SceneError if it does not take one."""
        first = loads[0]
        raise SceneError(f'[[loads]] on = "{first.on}": {type(self).__name__} has no expect_loads, and takes no loads')

    def set_loads(self, forces: Sequence[Force]) -> None:
        """Set (q, q̇, q̈) of the loads at the start of the next steps, in the order of `expect_loads`.

        Units are N, N/m or, for the base, m/s².
        """

    def start_under(self, contact: float) -> None:
        """Receive, before the first step, the contact force C [N] at the start, which acts there with the loads.

        Acceleration and inner forces of the start depend on it.
        """

    def load_on_end(self) -> Force:
        """Return these loads as an upward force on the end [N], which the foundation bears while the body is seated."""
        return NO_FORCE

    def join(self, velocity: float) -> None:
        """Set the velocity [m/s] of a massless end to that of the end it is joined to; other ends keep theirs."""

    def release(self) -> float:
        """Release a massless end, which may spring back; return the energy lost [J]."""
        return 0.0

    def close(self) -> None:
        """Free the resources of the body; it is not used afterwards."""
