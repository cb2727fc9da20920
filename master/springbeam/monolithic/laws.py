"""Interface laws of the references, one class each (``docs/model.md``, "Interface laws").

C [N] lifts the tip and presses the spring; p = y − u is the penetration [m], ṗ = z − v its rate. A rigid law has u = y
in every phase but `free`, and C is the multiplier of that; any other law is a force C(p, ṗ). To add one, write a class
here and name it in `LAWS`: the equations of motion, both integrators and the event logic ask it for the rest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

import numpy as np

from ..scene import Scene

Contact = Literal["free", "touch", "tied"]


class Phase(NamedTuple):
    """Which equations hold: what joins the ends, and whether the lower one stands on the foundation."""

    contact: Contact
    seated: bool = False

    @property
    def name(self) -> str:
        """The phase as results have it."""
        return "seated" if self.seated else self.contact


@dataclass(frozen=True)
class Motion:
    """Interface quantities of states X, each with the leading shape of X."""

    u: np.ndarray  #: tip deflection [m]
    v: np.ndarray  #: tip velocity [m/s]
    y: np.ndarray  #: spring top [m]
    z: np.ndarray  #: its velocity [m/s]
    C: np.ndarray  #: contact force on the beam's tip, upward [N]
    N: np.ndarray  #: force of the foundation, upward [N]
    a: np.ndarray  #: modal accelerations ä
    z_dot: np.ndarray  #: acceleration of the spring top [m/s²]


class Watch(NamedTuple):
    """A function of the motion that is ≥ 0 as long as its phase lasts."""

    name: str  #: of what happens where it becomes negative
    function: Callable[[Motion], np.ndarray]
    unit: Literal["m", "m/s", "N"]  #: of its values; tells what rounding leaves of a zero
    level: float | None = None  #: where the spring's top is when it happens [m]


class Ends(Protocol):
    """What a law may ask about tip and spring top at an event."""

    def below(self) -> bool:
        """Return whether, sharing one velocity, they are below Ψ or about to be."""

    def pressed(self) -> bool:
        """Return whether C > 0 if they stay together."""


class Law:
    """A law with one force, `force`, in phase `touch`, which begins and ends at p = 0."""

    #: Whether u = y in every phase but `free`.
    rigid = False

    def __init__(self, scene: Scene) -> None:
        contact = scene.contact
        self.stiffness, self.exponent = contact.stiffness, contact.exponent
        self.equilibrium = 0.0 if scene.spring is None else scene.spring.equilibrium

    def holds(self, contact: Contact) -> bool:
        """Return whether u = y holds as a constraint."""
        return self.rigid and contact != "free"

    def acts(self, contact: Contact) -> bool:
        """Return whether C is `force`."""
        return not self.rigid and contact != "free"

    def force(self, p: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """Return C [N] at penetrations p [m] with rates ṗ [m/s]."""
        raise NotImplementedError

    def slopes(self, p: float, rate: float) -> tuple[float, float]:
        """Return ∂C/∂p [N/m] and ∂C/∂ṗ [N·s/m]."""
        raise NotImplementedError

    def potential(self, p: np.ndarray) -> np.ndarray:
        """Return the energy [J] that the law stores."""
        raise NotImplementedError

    def inside(self, C: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return the part of C that is normal compliance [N], at tip deflections u [m]."""
        return C

    def watched(self, phase: Phase) -> list[Watch]:
        """Return what ends a phase, but for the foundation."""
        if phase.contact == "free":
            return [Watch("meet", lambda m: m.u - m.y, "m")]
        return [Watch("separate", lambda m: m.y - m.u, "m")]

    def after(self, happened: str, ends: Ends) -> tuple[Contact, str]:
        """Return the contact that follows what has happened, and the event's name in results."""
        return ("touch", "impact") if happened == "meet" else ("free", "separation")


class Transmission(Law):
    """Ends that have met are tied below Ψ, where C may have either sign, and touch with C ≥ 0 above."""

    rigid = True

    def inside(self, C: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return λ_nc (Ψ − u)₊^q [N]."""
        return np.asarray(self.stiffness * np.maximum(self.equilibrium - u, 0.0) ** self.exponent)

    def watched(self, phase: Phase) -> list[Watch]:
        psi = self.equilibrium
        if phase.contact == "free":
            return super().watched(phase)
        if phase.contact == "touch":
            return [
                Watch("retie", lambda m: m.y - psi, "m", level=psi),
                Watch("separate", lambda m: m.C, "N"),
            ]
        return [] if phase.seated else [Watch("release", lambda m: psi - m.y, "m", level=psi)]

    def after(self, happened: str, ends: Ends) -> tuple[Contact, str]:
        if happened == "meet":
            return "tied" if ends.below() else "touch", "impact"
        if happened == "release":
            return "touch" if ends.pressed() else "free", "release"
        if happened == "retie":
            return "tied", "retie"
        return "free", "separation"


class Compliance(Law):
    """Normal compliance with a moving obstacle, C = λ_nc p₊^q."""

    def force(self, p: np.ndarray, rate: np.ndarray) -> np.ndarray:
        return np.asarray(self.stiffness * np.maximum(p, 0.0) ** self.exponent)

    def slopes(self, p: float, rate: float) -> tuple[float, float]:
        return self.stiffness * self.exponent * max(p, 0.0) ** (self.exponent - 1.0), 0.0

    def potential(self, p: np.ndarray) -> np.ndarray:
        depth, q = np.maximum(p, 0.0), self.exponent
        return np.asarray(self.stiffness * depth ** (q + 1.0) / (q + 1.0))


#: By their names in a scene.
LAWS: dict[str, type[Law]] = {"transmission": Transmission, "compliance": Compliance}


def law_of(scene: Scene) -> Law:
    """Return the law of a scene. Raises ValueError if it is none of `LAWS`."""
    if scene.contact.law not in LAWS:
        known = ", ".join(f"'{name}'" for name in LAWS)
        raise ValueError(f"contact.law = {scene.contact.law!r}: this reference knows {known}")
    return LAWS[scene.contact.law](scene)
