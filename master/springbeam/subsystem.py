"""What the coupling knows of a body: one end that a force moves. The coupling knows nothing of FMPy."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np

#: A force over one step, as FMI carries it: (F, Ḟ, F̈) at the step's start [N, N/s, N/s²].
Polynomial = np.ndarray
ZERO_FORCE: Polynomial = np.zeros(3)


class StepRefused(RuntimeError):
    """A body could not complete a step (fmi2Discard, a numerical failure, a non-finite result)."""


class Motion(NamedTuple):
    """The interface end of a body at the end of its last step."""

    displacement: float  #: w [m]
    velocity: float  #: ẇ [m/s]
    integral: float  #: ∫ w dτ over the last step [m·s]
    integral_2: float  #: ∫∫ w dτ dτ over the last step [m·s²]

    def minus(self, other: Motion) -> Motion:
        return Motion(*(a - b for a, b in zip(self, other, strict=True)))


class Energies(NamedTuple):
    """All in J; ``dissipated`` since the start; ``load_potential`` of the constant loads, −(their work)."""

    kinetic: float
    potential: float
    dissipated: float
    load_potential: float

    @property
    def stored(self) -> float:
        return self.kinetic + self.potential


class Body(Protocol):
    """A body with one interface end and a state that can be saved and restored.

    ``advance`` prescribes the contact force C on the step: the beam takes it as +C, the spring as −C.
    Impulses act at once: ``motion`` and ``energies`` show the state after them.
    """

    #: What an impulse at the end meets [kg].
    mass: float

    def advance(self, time: float, size: float, contact: Polynomial, foundation: Polynomial = ZERO_FORCE) -> None:
        """Advance from ``time`` by ``size`` [s]. Raises StepRefused; the state is then to be restored."""

    def motion(self) -> Motion: ...

    def energies(self) -> Energies: ...

    def apply_impulse(self, impulse: float) -> None:
        """Upward impulse [N·s]."""

    def save(self) -> Any:
        """A token for the present state, valid until released."""

    def restore(self, token: Any) -> None: ...

    def release(self, token: Any) -> None: ...
