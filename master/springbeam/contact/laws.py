"""Interface laws: which contact force belongs to the penetration of the two ends, and what it stores and dissipates.

The penetration p = y − u_tip [m] is positive where the tip has sunk into what lies below it, its rate ṗ = z − v_tip
[m/s]; the contact force C [N] lifts the tip and presses the lower end. ``docs/model.md`` states the laws. A *rigid* law
has no force of its own: it holds the ends together, and C is whatever that takes. A *soft* one is a function of both,

    C = F(p) + D(p, ṗ),     F = Φ′,     D ṗ ≥ 0,

so that Φ is what it stores and ∫ D ṗ dt what it dissipates. To add a law, write its class here, name it in `LAWS`, say
what it is in `springbeam.scene.laws`, and write it again, independently, in `springbeam.monolithic.laws`
(``docs/contributing.md``).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Protocol

from ..scene import Contact, Scene
from ..scene.linearised import contact_energy


class SoftLaw(Protocol):
    """A contact force that is a function of the penetration and its rate."""

    #: Whether F vanishes for p ≤ 0; if not, F is linear.
    one_sided: ClassVar[bool]

    @property
    def damped(self) -> bool:
        """Whether D is not zero."""

    def force(self, p: float, rate: float = 0.0) -> float:
        """Return C [N] at a penetration p [m] that grows at ``rate`` [m/s]. Raises OverflowError past all doubles."""

    def potential(self, p: float) -> float:
        """Return Φ(p) [J]. Raises OverflowError past all doubles."""

    def slope(self, p: float) -> float:
        """Return F′(p) [N/m]."""

    def resistance(self, p: float, rate: float) -> tuple[float, float, float]:
        """Return D [N], ∂D/∂p [N/m] and ∂D/∂ṗ [N·s/m]; asked for only if `damped`."""


@dataclass(frozen=True)
class Compliance:
    """Normal compliance C = λ p₊^q (1 + χ ṗ)₊ (Ahn & Tate, (5), with the moving obstacle y; χ: Hunt & Crossley 1975).

    Parameters
    ----------
    stiffness
        λ [N/m^q].
    exponent
        q ≥ 1.
    damping
        χ ≥ 0 [s/m]; the force never pulls.
    """

    stiffness: float
    exponent: float
    damping: float = 0.0

    one_sided: ClassVar[bool] = True

    @property
    def damped(self) -> bool:
        return self.damping > 0.0

    def force(self, p: float, rate: float = 0.0) -> float:
        if p <= 0.0:
            return 0.0
        elastic: float = self.stiffness * p**self.exponent
        return elastic if rate == 0.0 else elastic * max(1.0 + self.damping * rate, 0.0)

    def potential(self, p: float) -> float:
        q = self.exponent + 1.0
        return float(self.stiffness * p**q / q) if p > 0.0 else 0.0

    def slope(self, p: float) -> float:
        return float(self.exponent * self.stiffness * p ** (self.exponent - 1.0)) if p > 0.0 else 0.0

    def resistance(self, p: float, rate: float) -> tuple[float, float, float]:
        force, share = self.force(p), max(self.damping * rate, -1.0)
        return force * share, self.slope(p) * share, self.damping * force if share > -1.0 else 0.0


@dataclass(frozen=True)
class Link:
    """An elastic link C = k p + c ṗ, whatever the sign of p.

    Parameters
    ----------
    stiffness
        k [N/m].
    damping
        c ≥ 0 [N·s/m].
    """

    stiffness: float
    damping: float = 0.0

    one_sided: ClassVar[bool] = False

    @property
    def damped(self) -> bool:
        return self.damping > 0.0

    def force(self, p: float, rate: float = 0.0) -> float:
        return self.stiffness * p + self.damping * rate

    def potential(self, p: float) -> float:
        return 0.5 * self.stiffness * p * p

    def slope(self, p: float) -> float:
        return self.stiffness

    def resistance(self, p: float, rate: float) -> tuple[float, float, float]:
        return self.damping * rate, 0.0, self.damping


#: How a scene's table ``[contact]`` names the soft laws.
LAWS: dict[str, Callable[[Contact], SoftLaw]] = {
    "compliance": lambda contact: Compliance(contact.stiffness, contact.exponent, contact.damping),
    "link": lambda contact: Link(contact.stiffness, contact.damping),
}


def law_of(scene: Scene) -> SoftLaw | None:
    """Return the soft law that acts in ``scene``; ``None`` where its law is rigid, or nothing meets."""
    return LAWS[scene.contact.law](scene.contact) if scene.coupled and scene.contact.soft else None


def stiffest(scene: Scene) -> float:
    """Return F′ of the scene's law [N/m] where it has taken all the energy at first contact; 0 of a law that is rigid.

    A law that is not one-sided is linear: how deep it goes does not matter.
    """
    law = law_of(scene)
    if law is None:
        return 0.0
    return law.slope(depth(law, contact_energy(scene)) if law.one_sided else 0.0)


def depth(law: SoftLaw, energy: float) -> float:
    """Return the penetration [m] at which a one-sided ``law`` stores ``energy`` [J], to rounding."""
    if energy <= 0.0:
        return 0.0

    def stores_less(p: float) -> bool:
        try:
            return law.potential(p) < energy
        except OverflowError:
            return False

    low, high = 0.0, 1.0
    while stores_less(high):
        low, high = high, 2.0 * high
    while low < (middle := 0.5 * (low + high)) < high:
        low, high = (middle, high) if stores_less(middle) else (low, middle)
    return high
