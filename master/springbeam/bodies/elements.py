"""Simple partners that need no FMU: a free mass, a mass on a linear spring and damper, an end that moves as given.

They fit in either place. Each step of a mass is exact: the state with the polynomial force and the integrals is one
linear system, s = (x, ẋ, F, Ḟ, F̈, ∫x, ∫∫x), ṡ = A s, stepped by exp(A H) s = s + A H φ₁(A H) s. Dissipation is the work
of the forces minus the stored energy.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ..scene import Load
from .force import combined, quadrature, value, work_on
from .protocol import NO_FORCE, SIZES_REMEMBERED, Body, Energies, Force, Motion

#: Points of the quadrature of a height over a step, and one more for each radian that it turns.
_WALL_POINTS = 8
#: How far before the end of a step its speed is taken, and the length of differences of it, over the step.
_BEFORE = 1e-12
_TRIAL = 2.0**-8
#: The derivative by five values backward, to fourth order.
_BACKWARD = np.array([25.0, -48.0, 36.0, -16.0, 3.0]) / 12.0


class EndLoaded(Body):
    """A body that takes loads on its end; if it is a mass there, also the acceleration of its base."""

    _on_end: Force = NO_FORCE

    def expect_loads(self, loads: Sequence[Load]) -> None:
        #: What a unit of each load is at the end [N].
        self._at_end = [-self.mass if load.on == "base" else 1.0 for load in loads]

    def set_loads(self, forces: Sequence[Force]) -> None:
        self._on_end = combined(self._at_end, forces)

    def load_on_end(self) -> Force:
        return self._on_end


class MassState(NamedTuple):
    """State of a mass."""

    motion: Motion
    dissipated: float = 0.0  #: so far [J]
    load_work: float = 0.0  #: of the loads so far [J]
    force: float = 0.0  #: of other body, foundation and loads at the end of the last step [N]


class SpringDamper(EndLoaded):
    """m ẍ + c ẋ + k (x − x₀) = F + f, F being the force of other body, foundation and loads, upward.

    Parameters
    ----------
    mass, stiffness, damping
        m > 0 [kg], k [N/m], c [N·s/m].
    rest
        x₀, where the spring has no force [m].
    displacement, velocity
        x [m] and ẋ [m/s] at the start.
    external_force
        f, constant, upward [N].

    Raises ValueError for an impossible mass or damping.
    """

    state: MassState
    damping: float

    def __init__(
        self,
        mass: float,
        stiffness: float = 0.0,
        damping: float = 0.0,
        rest: float = 0.0,
        displacement: float = 0.0,
        velocity: float = 0.0,
        external_force: float = 0.0,
    ) -> None:
        if not (0.0 < mass < float("inf") and damping >= 0.0):
            raise ValueError(f"mass = {mass}, damping = {damping}: a mass is positive and finite, damping not negative")
        self.mass = mass
        self._stiffness = stiffness
        self.damping = damping
        self._rest = rest
        self._load = external_force
        self._sign = 1.0
        self.state = MassState(Motion(displacement, velocity, 0.0, 0.0))
        self._maps = lru_cache(SIZES_REMEMBERED)(self._map)

    def take_place(self, *, upper: bool) -> None:
        self._sign = 1.0 if upper else -1.0

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE) -> Motion:
        before, dissipated, load_work, _ = self.state
        on_end = self._on_end
        forces = [self._sign * c + n + q for c, n, q in zip(contact, foundation, on_end, strict=True)]
        at_end = value((forces[0], forces[1], forces[2]), size)
        forces[0] += self._load + self._stiffness * self._rest
        start = np.array([*before[:2], *forces, 0.0, 0.0])
        dx, dv, once, twice = (self._maps(size) @ start).tolist()
        end = Motion(before.displacement + dx, before.velocity + dv, once, twice)
        if self.damping > 0.0:
            forces[0] -= self._stiffness * self._rest
            work = work_on((forces[0], forces[1], forces[2]), before, end, size)
            dissipated += work + sum(self._stored(before)) - sum(self._stored(end))
        self.state = MassState(end, dissipated, load_work + work_on(on_end, before, end, size), at_end)
        return end

    def _map(self, size: float) -> np.ndarray:
        """Return the rows of exp(A H) − 1 = A H φ₁(A H) of x, ẋ, ∫x, ∫∫x, shape (4, 7).

        Increments, because the rounding of exp(A H) itself would be the same error in each of many short steps.
        """
        from scipy.linalg import expm  # takes a tenth of a second to load: only for such a body

        A = np.zeros((7, 7))
        A[0, 1] = A[2, 3] = A[3, 4] = A[5, 0] = A[6, 5] = 1.0
        A[1, :3] = -self._stiffness / self.mass, -self.damping / self.mass, 1.0 / self.mass
        both = np.block([[A * size, np.eye(7)], [np.zeros((7, 14))]])
        increments: np.ndarray = (A * size @ expm(both)[:7, 7:])[[0, 1, 5, 6]]
        return increments

    def stiffness(self, displacement: Any) -> float:
        return self._stiffness

    def motion(self) -> Motion:
        return self.state.motion

    def acceleration(self) -> float:
        motion = self.state.motion
        return (self.state.force - self.holding_force(motion.displacement, motion.velocity)) / self.mass

    def energies(self) -> Energies:
        motion, dissipated, load_work, _ = self.state
        return Energies(*self._stored(motion), dissipated, -self._load * motion.displacement - load_work)

    def _stored(self, motion: Motion) -> tuple[float, float]:
        """Return the energies of mass and spring [J]."""
        stretched = motion.displacement - self._rest
        return 0.5 * self.mass * motion.velocity * motion.velocity, 0.5 * self._stiffness * stretched**2

    def apply_impulse(self, impulse: float) -> None:
        motion = self.state.motion
        self.state = self.state._replace(motion=motion._replace(velocity=motion.velocity + impulse / self.mass))

    def holding_force(self, displacement: float, velocity: float) -> float:
        return self._stiffness * (displacement - self._rest) + self.damping * velocity - self._load


class PointMass(SpringDamper):
    """A free mass, m ẍ = F + f; parameters as of `SpringDamper`."""

    def __init__(
        self, mass: float, displacement: float = 0.0, velocity: float = 0.0, external_force: float = 0.0
    ) -> None:
        super().__init__(mass, displacement=displacement, velocity=velocity, external_force=external_force)


class Prescribed(Body):
    """An end with a prescribed motion under any force: a driving body."""

    mass = float("inf")
    damping = 0.0

    def stiffness(self, displacement: Any) -> float:
        return float("inf")

    def __init__(self, motion: Motion) -> None:
        self.state = motion

    def rewind(self) -> None: ...

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE) -> Motion:
        return self.motion()

    def motion(self) -> Motion:
        motion: Motion = self.state
        return motion

    def acceleration(self) -> float | None:
        return 0.0

    def trial_acceleration(self, time: float, size: float) -> float | None:
        return 0.0

    def apply_impulse(self, impulse: float) -> None: ...

    def holding_force(self, displacement: float, velocity: float) -> float:
        return 0.0


class RigidWall(Prescribed):
    """An end held at rest at ``position`` [m]: the foundation, an elastic stop, or a seated spring."""

    def __init__(self, position: float) -> None:
        super().__init__(Motion(position, 0.0, 0.0, 0.0))

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE) -> Motion:
        w = self.motion().displacement
        self.state = Motion(w, 0.0, w * size, 0.5 * w * size * size)
        return self.motion()

    def expect_loads(self, loads: Sequence[Load]) -> None: ...


class WallState(NamedTuple):
    """State of a moving wall."""

    motion: Motion
    time: float  #: [s]
    size: float  #: of the last step [s]
    received: float = 0.0  #: work of the forces on it so far [J]


class MovingWall(Prescribed):
    """An end that moves as the sum of ``loads`` [m] about ``position`` [m], whatever force acts on it.

    The work of that force leaves the pair: it counts as minus the work of a load. ``time`` [s] is that of the start.
    """

    state: WallState

    def __init__(self, position: float, loads: Sequence[Load], time: float = 0.0) -> None:
        self._position = position
        self._loads = loads
        self._sign = 1.0
        self.state = WallState(Motion(float(self._height(time)), float(self._speed(time)), 0.0, 0.0), time, 0.0)

    def take_place(self, *, upper: bool) -> None:
        self._sign = 1.0 if upper else -1.0

    def rewind(self) -> None:
        Body.rewind(self)

    def expect_loads(self, loads: Sequence[Load]) -> None: ...

    def _height(self, times: Any) -> Any:
        return sum((load.value(times) for load in self._loads), start=self._position)

    def _speed(self, times: Any) -> Any:
        return sum((load.change(times) for load in self._loads), start=0.0)

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE) -> Motion:
        before, _, _, received = self.state
        until = time + size
        inside = sorted({edge for load in self._loads for edge in load.edges if time < edge < until})
        turns = max((load.rate for load in self._loads), default=0.0) * size
        s, weights = quadrature(time, size, inside, _WALL_POINTS + int(turns))
        weighted = 0.5 * size * weights * self._height(time + 0.5 * size * (s + 1.0))
        left = until - _BEFORE * size  # at a kink, the speed before it
        end = Motion(
            float(self._height(left) + _BEFORE * size * self._speed(left)),
            float(self._speed(left)),
            float(weighted.sum()),
            float((0.5 * size * (1.0 - s) * weighted).sum()),
        )
        received += work_on(combined([self._sign, 1.0], [contact, foundation]), before, end, size)
        self.state = WallState(end, until, size, received)
        return end

    def motion(self) -> Motion:
        return self.state.motion

    def acceleration(self) -> float | None:
        """Return the derivative of the speed at the end of the last step, from points before it."""
        _, time, size, _ = self.state
        if size == 0.0:
            return None
        step = _TRIAL * size
        speeds = self._speed(time - _BEFORE * size - step * np.arange(5.0))
        return float(_BACKWARD @ speeds) / step

    def trial_acceleration(self, time: float, size: float) -> float | None:
        step = _TRIAL * size
        return -float(_BACKWARD @ self._speed(time + _BEFORE * size + step * np.arange(5.0))) / step

    def energies(self) -> Energies:
        return Energies(0.0, 0.0, 0.0, self.state.received)

    def apply_impulse(self, impulse: float) -> None:
        state = self.state
        self.state = state._replace(received=state.received + impulse * state.motion.velocity)


#: The elements by their names in a scene; the keys of their tables are the parameters.
ELEMENTS: dict[str, Callable[..., Body]] = {  # a moving wall is made with its loads
    "point_mass": PointMass,
    "spring_damper": SpringDamper,
    "rigid_wall": RigidWall,
}
