"""Interface laws of the references, one class each (``docs/model.md``, "Interface laws").

C [N] lifts the tip and presses the spring; p = y − u is the penetration [m], ṗ = z − v its rate. A rigid law has u = y
in every phase but `free`, and C is the multiplier of that; any other law is a force C(p, ṗ). To add one, write a class
here and name it in `REFERENCE_LAWS`; the equations of motion, the integrator and the event logic use it.

Phases: `free` without force; `tied` and `touch`, joined for either sign of C and while C ≥ 0; `slack`, touching without
force (results have it as `touch`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np

from ..scene import Scene, SceneError

ContactState = Literal["free", "touch", "slack", "tied"]
Unit = Literal["m", "m/s", "N"]


class ReferencePhase(NamedTuple):
    """Which equations hold: what joins the ends, and whether the lower one stands on the foundation."""

    contact: ContactState
    seated: bool = False

    @property
    def name(self) -> str:
        """Return the phase as results have it."""
        return "seated" if self.seated else "touch" if self.contact == "slack" else self.contact


class EndsMotion(NamedTuple):
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
    function: Callable[[EndsMotion], np.ndarray]
    unit: Unit  #: of its values; it determines the rounding of a zero
    level: float | None = None  #: where the spring's top is when it happens [m]


#: What follows most events: the contact, and the event's name in results if it is one there.
_AFTER: dict[str, tuple[ContactState, str | None]] = {
    "meet": ("touch", "impact"),
    "separate": ("free", "separation"),
    "retie": ("tied", "retie"),
    "slacken": ("slack", None),
    "press": ("touch", None),
}


class Law:
    """A law with one force, `force`, in phase `touch`, which begins and ends at p = 0."""

    #: Whether u = y in every phase but `free`.
    rigid = False
    #: Where a run starts; a law that starts elsewhere than in `free` joins the ends for good.
    start: ContactState = "free"

    def __init__(self, scene: Scene) -> None:
        self.stiffness: float = getattr(scene.contact, "stiffness", 0.0)
        self.exponent: float = getattr(scene.contact, "exponent", 1.0)
        self.damping: float = getattr(scene.contact, "damping", 0.0)
        self.equilibrium = 0.0 if scene.spring is None else scene.spring.equilibrium

    def acts(self, contact: ContactState) -> bool:
        """Return whether C is `force`."""
        return not self.rigid and contact in ("touch", "tied")

    def force(self, p: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """Return C [N] at penetrations p [m] with rates ṗ [m/s]."""
        raise NotImplementedError

    def potential(self, p: np.ndarray) -> np.ndarray:
        """Return the energy [J] that the law stores."""
        raise NotImplementedError

    def dissipation(self, contact: ContactState, p: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """Return the power [W] that the law takes: C ṗ less the growth of `potential`."""
        return np.zeros_like(p)

    def inside(self, C: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return the part of C that is normal compliance [N], at tip deflections u [m]; 0 of a rigid law."""
        return np.zeros_like(C) if self.rigid else C

    def watched(self, phase: ReferencePhase) -> list[Watch]:
        """Return what ends a phase, but for the foundation; nothing ends one that the ends are joined in for good."""
        if self.start != "free":
            return []
        if phase.contact == "free":
            return [Watch("meet", lambda m: m.u - m.y, "m")]
        return [Watch("separate", lambda m: m.y - m.u, "m")]

    def after(self, happened: str, together: EndsMotion, noise: float) -> tuple[ContactState, str | None]:
        """Return the contact that follows what has happened, and the event's name in results if it is one there.

        ``together`` is the motion if the ends stay together, ``noise`` what rounding leaves of a height that is 0 [m].
        """
        return _AFTER[happened]


class Transmission(Law):
    """Ends that have met are tied below Ψ, where C may have either sign, and touch with C ≥ 0 above."""

    rigid = True

    def inside(self, C: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return λ_nc (Ψ − u)₊^q [N]."""
        return self.stiffness * np.maximum(self.equilibrium - u, 0.0) ** self.exponent

    def watched(self, phase: ReferencePhase) -> list[Watch]:
        psi = self.equilibrium
        if phase.contact == "free":
            return super().watched(phase)
        if phase.contact == "touch":
            return [Watch("retie", lambda m: m.y - psi, "m", level=psi), Watch("separate", lambda m: m.C, "N")]
        return [] if phase.seated else [Watch("release", lambda m: psi - m.y, "m", level=psi)]

    def after(self, happened: str, together: EndsMotion, noise: float) -> tuple[ContactState, str | None]:
        if happened == "release":
            return "touch" if together.C > 0.0 else "free", "release"
        height = float(together.y) - self.equilibrium
        if abs(height) <= noise:  # where they go tells
            height = float(together.z) if together.z != 0.0 else float(together.z_dot)
        return ("tied", "impact") if happened == "meet" and height < 0.0 else _AFTER[happened]


class Unilateral(Law):
    """Ends that touch with C ≥ 0 at any height."""

    rigid = True

    def watched(self, phase: ReferencePhase) -> list[Watch]:
        return [Watch("separate", lambda m: m.C, "N")] if phase.contact == "touch" else super().watched(phase)


class Tie(Law):
    """Ends that are one from the start, for either sign of C."""

    rigid = True
    start = "tied"

    def after(self, happened: str, together: EndsMotion, noise: float) -> tuple[ContactState, str | None]:
        return "tied", "impact"


class Link(Law):
    """An elastic link with a damper, C = λ_nc p + c ṗ for either sign of p."""

    start = "tied"

    def force(self, p: np.ndarray, rate: np.ndarray) -> np.ndarray:
        return self.stiffness * p + self.damping * rate

    def potential(self, p: np.ndarray) -> np.ndarray:
        return 0.5 * self.stiffness * p**2

    def dissipation(self, contact: ContactState, p: np.ndarray, rate: np.ndarray) -> np.ndarray:
        return self.damping * rate**2


class _Pressing(Law):
    """A damped law that never pulls, with F = λ p₊^q.

    Where its `force` would be negative the contact is `slack`, until it would be positive again or p = 0.
    """

    unit: Unit  #: of `pushing`

    def _elastic(self, p: np.ndarray) -> np.ndarray:
        """Return F [N]."""
        return self.stiffness * np.maximum(p, 0.0) ** self.exponent

    def potential(self, p: np.ndarray) -> np.ndarray:
        return self._elastic(p) * np.maximum(p, 0.0) / (self.exponent + 1.0)

    def dissipation(self, contact: ContactState, p: np.ndarray, rate: np.ndarray) -> np.ndarray:
        elastic = self._elastic(p)
        return ((0.0 if contact == "slack" else self.force(p, rate)) - elastic) * rate

    def pushing(self, m: EndsMotion) -> np.ndarray:
        """Return what is negative where `force` would be, in ``unit``."""
        raise NotImplementedError

    def watched(self, phase: ReferencePhase) -> list[Watch]:
        watched = super().watched(phase)
        if self.damping == 0.0 or phase.contact == "free":
            return watched
        if phase.contact == "slack":
            return [*watched, Watch("press", lambda m: -self.pushing(m), self.unit)]
        return [*watched, Watch("slacken", self.pushing, self.unit)]


class Compliance(_Pressing):
    """Normal compliance with a moving obstacle, C = F (1 + χ ṗ) with F = λ_nc p₊^q (Hunt & Crossley 1975)."""

    unit = "m/s"

    def force(self, p: np.ndarray, rate: np.ndarray) -> np.ndarray:
        return self._elastic(p) * (1.0 + self.damping * rate)

    def pushing(self, m: EndsMotion) -> np.ndarray:
        return m.z - m.v + 1.0 / self.damping


class KelvinVoigt(_Pressing):
    """A unilateral spring and damper, C = F + c ṗ with F = λ p^q."""

    unit = "N"

    def force(self, p: np.ndarray, rate: np.ndarray) -> np.ndarray:
        return self._elastic(p) + self.damping * rate

    def pushing(self, m: EndsMotion) -> np.ndarray:
        return self.force(m.y - m.u, m.z - m.v)


#: By their names in a scene.
REFERENCE_LAWS: dict[str, type[Law]] = {
    "transmission": Transmission,
    "unilateral": Unilateral,
    "compliance": Compliance,
    "kelvin_voigt": KelvinVoigt,
    "tie": Tie,
    "link": Link,
}


def law_of(scene: Scene) -> Law:
    """Return the law of a scene. Raises SceneError if it is none of `REFERENCE_LAWS`."""
    if scene.contact.law not in REFERENCE_LAWS:
        known = ", ".join(f"'{name}'" for name in REFERENCE_LAWS)
        raise SceneError(f"contact.law = '{scene.contact.law}': no reference has it; those there are know {known}")
    return REFERENCE_LAWS[scene.contact.law](scene)
