"""What the coupling knows of a body: one end that a force moves. The coupling knows nothing of FMPy."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np

from .memory import Memory

#: A force over one step, as FMI carries it: (F, Ḟ, F̈) at the step's start [N, N/s, N/s²].
Force = tuple[float, float, float]
#: Nothing touches the end. (A contact force that comes out as 0 is another tuple: a massless end tells them apart.)
NO_FORCE: Force = (0.0, 0.0, 0.0)


class StepRefused(RuntimeError):
    """A body could not complete a step (fmi2Discard, a numerical failure, a non-finite result)."""


class BodyFailed(RuntimeError):
    """A body cannot go on, whatever the step (fmi2Error of any other call, fmi2Fatal)."""


class Motion(NamedTuple):
    """The interface end of a body at the end of its last step."""

    displacement: float  #: w [m]
    velocity: float  #: ẇ [m/s]
    integral: float  #: ∫ w dτ over the last step [m·s]
    integral_2: float  #: ∫∫ w dτ dτ over the last step [m·s²]


class Energies(NamedTuple):
    """All in J; ``dissipated`` since the start; ``load_potential`` of the constant loads, −(their work)."""

    kinetic: float
    potential: float
    dissipated: float
    load_potential: float


class Body(Protocol):
    """A body with one interface end and a state that can be rewound.

    ``advance`` prescribes the contact force C on the step: the beam takes it as +C, the spring as −C.
    Impulses act at once: ``motion`` and ``energies`` show the state after them.
    """

    #: What an impulse at the end meets [kg].
    mass: float

    def mark(self) -> None:
        """Remember the present state as the one ``rewind`` returns to."""

    def rewind(self) -> None:
        """Return to the marked state. Costs nothing if nothing happened since."""

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE) -> Motion:
        """Advance from ``time`` by ``size`` [s]; returns `motion`. Raises StepRefused; ``rewind`` then recovers.

        This and every other method but ``close`` may raise BodyFailed.
        """

    def motion(self) -> Motion: ...

    def energies(self) -> Energies: ...

    def apply_impulse(self, impulse: float) -> None:
        """Upward impulse [N·s]."""

    def save(self) -> dict[str, Any]:
        """Everything that the body's future depends on, and its counts, as `springbeam.bodies.memory.Memory.save`."""

    def restore(self, saved: dict[str, Any]) -> None:
        """Go on from what ``save`` of a body with the same parameters returned, to the last bit as that would have."""

    def close(self) -> None:
        """Free what the body holds; it is not used afterwards."""


class BeamBody(Body, Protocol):
    def shape(self) -> np.ndarray:
        """Deflection [m] at `springbeam.scene.statics.SHAPE_POINTS`, shape (21,)."""


class Held(Memory):
    """An end held at rest at a fixed position: the foundation, or a spring seated on it."""

    REMEMBERED = ("_size",)

    mass = float("inf")

    def __init__(self, position: float) -> None:
        self._position = position
        self._size = 0.0

    def mark(self) -> None: ...

    def rewind(self) -> None: ...

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE) -> Motion:
        self._size = size
        return self.motion()

    def motion(self) -> Motion:
        w, h = self._position, self._size
        return Motion(w, 0.0, w * h, 0.5 * w * h * h)

    def energies(self) -> Energies:
        return Energies(0.0, 0.0, 0.0, 0.0)

    def apply_impulse(self, impulse: float) -> None: ...

    def close(self) -> None: ...
