"""What the coupling knows of a body: one end that a force moves. The coupling knows nothing of FMPy."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import inf, sqrt
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
#: Length of a trial step that tells an acceleration, over a macro step.
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

#: ω² [1/s²], 2 ζ ω [1/s] and the displacement of the end [1/√kg] of modes of unit mass, (n,) each.
Modes = tuple[np.ndarray, np.ndarray, np.ndarray]
#: The interface ends (tip, lower end): the spring top, or without a spring the foundation.
Ends = tuple[Motion, Motion]


class Energies(NamedTuple):
    """All in J; ``dissipated`` since the start; ``load_potential`` is −(the work of the loads), up to a constant."""

    kinetic: float
    potential: float
    dissipated: float
    load_potential: float


class InnerForces(NamedTuple):
    """What happens inside a beam at the end of its last step, under the forces that act there."""

    acceleration: float  #: of its tip [m/s²]
    clamp_force: float  #: of the clamp on the beam, upward [N]
    clamp_moment: float  #: of the clamp on the beam, counter-clockwise [N·m]
    bending_stress: float  #: the largest along the beam [Pa]; 0 where the height of its section is not known


@dataclass(frozen=True)
class Abilities:
    """What a body can do; the default is that of our own."""

    state: bool = True  #: its state can be saved and restored
    any_size: bool = True  #: its steps may have any size
    velocity: bool = True  #: it tells its velocity
    integrals: int = 2  #: it tells ∫x (1) and ∫∫x (2) over a step
    slopes: int = 2  #: highest derivative of a force over a step that it follows
    impulse: bool = True  #: it takes impulses
    energies: bool = True  #: it tells its energies


#: Abilities that a body has by a method, which it may leave out.
_BY_METHOD = {"impulse": "apply_impulse", "energies": "energies"}


class Body:
    """A body with one interface end and a state that can be rewound; a body of one's own derives from it.

    ``advance`` prescribes the contact force C on the step: the upper body takes it as +C, the lower one as −C.
    Impulses act at once: ``motion`` and ``energies`` show the state after them. Every method but ``close`` may raise
    BodyFailed.
    """

    #: All of the body that changes, a value that is replaced and never changed in place.
    state: Any = None
    #: What an impulse at the end meets [kg].
    mass: float
    #: Whether columns tell its acceleration and the forces inside it: of our own beam and spring.
    tells = False

    #: What resists the velocity of the end [N·s/m]; ``None`` where that is not known.
    damping: float | None = None
    #: A displacement of the end that is to be expected [m], 0 where that is not known.
    reach = 0.0
    #: Relative tolerance of the solver of its motion.
    tolerance = 0.0

    @property
    def inertia(self) -> float:
        """What a force meets that acts for long beside the waves inside the body [kg]."""
        return self.mass

    def stiffness(self, displacement: Any) -> Any:
        """Return ∂F/∂w of the force that holds the end at ``displacement`` [N/m], also of an array of them.

        ``None`` where that is not known.
        """
        return None

    def oscillation(self, displacement: Any = 0.0) -> tuple[float, float] | None:
        """Return the lowest frequency of the body alone [rad/s] and its damping ratio, 0 where nothing oscillates.

        Of an array of displacements [m] it is where the body is stiffest; ``None`` where that is not known.
        """
        stiffness = self.stiffness(displacement)
        if stiffness is None or self.damping is None:
            return None
        stiffest = float(np.max(stiffness))
        if stiffest <= 0.0 or not 0.0 < self.mass < inf:
            return 0.0, 0.0
        omega = sqrt(stiffest / self.mass)
        return omega, 0.5 * self.damping / (self.mass * omega)

    def modes(self, displacement: Any = 0.0) -> Modes | None:
        """Return the modes of the end, as of a linear body; ``None`` where they are not known.

        Of an array of displacements [m] they are those where the body is stiffest.
        """
        stiffness = self.stiffness(displacement)
        if stiffness is None or self.damping is None:
            return None
        if not 0.0 < self.mass < inf:
            return np.zeros(1), np.zeros(1), np.zeros(1)
        stiffest = float(np.max(stiffness))
        return np.array([stiffest / self.mass]), np.array([self.damping / self.mass]), np.array([self.mass**-0.5])

    def moved_by(self, load: Load) -> float:
        """Return the largest force on a mode of a ``load`` of 1, over the displacement of the end in that mode.

        0 where that is not known.
        """
        return 0.0

    @property
    def massless(self) -> bool:
        """Whether the end has no inertia: it then has the velocity of what it is joined to, and springs back alone."""
        return self.mass == 0.0

    #: What the body says that it can do; `can` has the answer. Where its state cannot be saved, a step is made once, by
    #: the schemes that never repeat one.
    abilities = Abilities()
    #: Steps begun so far, and how often the state was set back; ``None`` where nobody counts.
    steps: int | None = None
    rewinds: int | None = None
    #: Work that the end has received so far [J], of a body by which the coupling is judged, not by its energies.
    received: float | None = None

    def can(self) -> Abilities:
        """Return what the body can do: its `abilities` without those whose methods it leaves out."""
        left_out = {
            ability: False
            for ability, method in _BY_METHOD.items()
            if getattr(getattr(self, method), "__func__", None) is getattr(Body, method)
        }
        return replace(self.abilities, **left_out)

    def take_place(self, *, upper: bool) -> None:
        """Learn, before the run, whether it is the upper body; one that fits in either place needs to know."""

    def mark(self) -> None:
        """Remember `state` as the one ``rewind`` returns to."""
        if self.state is None:
            raise NotImplementedError(f"{type(self).__name__} has neither mark nor state")
        self._marked = self.state

    def rewind(self) -> None:
        """Return to the marked state."""
        self.state = self._marked

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE) -> Motion:
        """Advance from ``time`` by ``size`` [s] and return `motion`. Raises StepRefused; ``rewind`` then recovers."""
        raise NotImplementedError

    def advance_alone(self, time: float, size: float) -> Motion:
        """Advance with nothing at the end; parameters and errors as of `advance`."""
        return self.advance(time, size, NO_FORCE)

    def motion(self) -> Motion:
        raise NotImplementedError

    def acceleration(self) -> float | None:
        """Return ẅ of the end [m/s²] in its present state, under the forces at the end of its last step.

        ``None`` if the body cannot tell: `trial_acceleration` then may.
        """
        return None

    def trial_acceleration(self, time: float, size: float) -> float | None:
        """Return ẅ of the end [m/s²] in its present state at ``time`` [s], with the loads but no other force on it.

        A trial step of a small share of ``size`` [s] tells it, to second order; the body stays where it is. ``None`` if
        the body makes no such step.
        """
        if not (self.abilities.state and self.abilities.any_size and self.abilities.velocity):
            return None
        h, (w, v, _, _) = _TRIAL * size, self.motion()
        end = self._trial(time, h)
        return None if end is None else 6.0 * (end.displacement - w - h * v) / (h * h) - 2.0 * (end.velocity - v) / h

    def decay(self, time: float, size: float, speed: float) -> float | None:
        """Return by how much ẅ of the end falls for each unit of velocity that an impulse gives it [1/s].

        It follows from the modes. Of a body that has none, two trial steps at ``time`` [s] as of `trial_acceleration`
        tell it, one of them after an impulse that changes its velocity by ``speed`` [m/s]. ``None`` if it makes none.
        """
        modes = self.modes()
        if modes is not None:
            _, damping, tip = modes
            return float(tip**2 @ damping) / (float(tip @ tip) or 1.0)
        before = self.state
        free = self.trial_acceleration(time, size)
        if free is None or not self.abilities.impulse:
            return None
        try:
            self.apply_impulse(self.mass * speed)
            struck = self.trial_acceleration(time, size)
        finally:
            self.state = before
        return None if struck is None else (free - struck) / speed

    def _trial(self, time: float, size: float) -> Motion | None:
        """Return the motion after a step with nothing at the end, which is then undone; ``None`` if it cannot be."""
        if self.state is None:
            return None
        before = self.state
        end = self.advance_alone(time, size)
        self.state = before
        return end

    def energies(self) -> Energies:
        """Return what the body stores and has dissipated; a body that cannot tell stores nothing."""
        return Energies(0.0, 0.0, 0.0, 0.0)

    def inner_forces(self) -> InnerForces:
        """Return what a beam that `tells` feels, asked once a step."""
        raise NotImplementedError(f"{type(self).__name__} has no inner_forces, and says that it tells")

    def shape(self) -> np.ndarray | None:
        """Return deflections [m], bending moments [N·m] and shear forces [N] one after another, shape (63,).

        They are those at `springbeam.scene.statics.SHAPE_POINTS`; ``None`` of a body that shows no shape.
        """
        return None

    def apply_impulse(self, impulse: float) -> None:
        """Change the velocity of the end at once by an upward impulse [N·s].

        A body that leaves it out is refused where a scene needs impulses (`springbeam.bodies.gate`); an impulse that
        changes nothing but by rounding is none.
        """
        if abs(impulse) > ROUNDED_IMPULSE * self.mass * abs(self.motion().velocity):
            raise BodyFailed(f"{type(self).__name__} has no apply_impulse, and meets an impulse of {impulse:.6g} N·s")

    def holding_force(self, displacement: float, velocity: float) -> float:
        """Return the upward force [N] that keeps the end at ``displacement`` [m] and ``velocity`` [m/s].

        The force on a spring seated on a stop comes from here.
        """
        raise NotImplementedError(f"{type(self).__name__} has no holding_force, which a body seated on a stop needs")

    def expect_loads(self, loads: Sequence[Load]) -> None:
        """Say once, before the first step, which of a scene's loads act on this body.

        Raises SceneError for a load that it does not take.
        """
        first = loads[0]
        raise SceneError(f'[[loads]] on = "{first.on}": {type(self).__name__} has no expect_loads, and takes no loads')

    def set_loads(self, forces: Sequence[Force]) -> None:
        """Let the loads act on every step from here on, rewound or not, each a polynomial over the step.

        They are in the order of `expect_loads`, and in the unit of each: N, N/m or, of the base, m/s².
        """

    def load_on_end(self) -> Force:
        """Return what the loads of `set_loads` amount to at the end of a body that is a mass there [N], upward.

        The foundation bears it while the body is seated.
        """
        return NO_FORCE

    def join(self, velocity: float) -> None:
        """Let a massless end take the velocity [m/s] of what it is joined to; other ends keep theirs."""

    def release(self) -> float:
        """Let go of a massless end, which may spring back; return the energy that this loses [J]."""
        return 0.0

    def close(self) -> None:
        """Free what the body holds; it is not used afterwards."""
