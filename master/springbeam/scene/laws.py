"""Interface laws: the contact force as a function of the penetration of the ends, its potential and dissipation.

The penetration p = y − u_tip [m] is positive if the tip has sunk into the body below it; its rate is ṗ = z − v_tip
[m/s]. The contact force C [N] lifts the tip and presses the lower end. ``docs/model.md`` states the laws. A *rigid* law
holds the ends together, and C is the reaction. A *soft* law is a function of penetration and rate,

    C = F(p) + D(p, ṗ),     F = Φ′,     D ṗ ≥ 0,

with the potential Φ and the dissipation ∫ D ṗ dt. A law is one table of keys, a `Contact` named in `LAWS`; a soft one
makes its force, a `SoftLaw`. Only this module and `springbeam.monolithic.laws`, which implements each law again,
independently, compare names of laws. ``docs/contributing.md`` shows how to add a law.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import model_validator
from typing_extensions import Self

from ..lazily import Later
from .tables import OfProgram, OneOf, Table, key

if TYPE_CHECKING:
    import numpy as np
else:
    np = Later("numpy")

# -- forces ------------------------------------------------------------------------------------------------------------


class SoftLaw:
    """A contact force that is a function of the penetration and its rate."""

    #: Whether F vanishes for p ≤ 0; if not, F is linear.
    one_sided: ClassVar[bool] = True

    @property
    def lasting(self) -> bool:
        """Whether it joins the ends from the start and for good, for either sign of C."""
        return not self.one_sided

    @property
    def damped(self) -> bool:
        """Whether D is not zero."""
        return False

    def force(self, p: float, rate: float = 0.0) -> float:
        """Return C [N] at a penetration p [m] that grows at ``rate`` [m/s]. Raises OverflowError past all doubles."""
        raise NotImplementedError

    def potential(self, p: float) -> float:
        """Return Φ(p) [J]. Raises OverflowError past all doubles."""
        raise NotImplementedError

    def slope(self, p: float) -> float:
        """Return F′(p) [N/m]."""
        raise NotImplementedError

    def resistance(self, p: float, rate: float) -> tuple[float, float, float]:
        """Return D [N], ∂D/∂p [N/m] and ∂D/∂ṗ [N·s/m]; called only if `damped`."""
        raise NotImplementedError


@dataclass(frozen=True)
class _Power(SoftLaw):
    """A law with F = λ p₊^q.

    Parameters
    ----------
    stiffness
        λ [N/m^q].
    exponent
        q ≥ 1.
    damping
        Of the law, ≥ 0; the force never pulls.
    """

    stiffness: float
    exponent: float
    damping: float = 0.0

    @property
    def damped(self) -> bool:
        return self.damping > 0.0

    def potential(self, p: float) -> float:
        q = self.exponent + 1.0
        return float(self.stiffness * p**q / q) if p > 0.0 else 0.0

    def slope(self, p: float) -> float:
        return float(self.exponent * self.stiffness * p ** (self.exponent - 1.0)) if p > 0.0 else 0.0


class Compliance(_Power):
    """Normal compliance C = λ p₊^q (1 + χ ṗ)₊ (Ahn & Tate, (5), with the moving obstacle y; χ: Hunt & Crossley 1975).

    ``damping`` is χ [s/m].
    """

    def force(self, p: float, rate: float = 0.0) -> float:
        if p <= 0.0:
            return 0.0
        elastic: float = self.stiffness * p**self.exponent
        return elastic if rate == 0.0 else elastic * max(1.0 + self.damping * rate, 0.0)

    def resistance(self, p: float, rate: float) -> tuple[float, float, float]:
        force = self.force(p)
        share = max(self.damping * rate, -1.0)
        return force * share, self.slope(p) * share, self.damping * force if share > -1.0 else 0.0


class KelvinVoigt(_Power):
    """Unilateral spring and damper, C = (λ p^q + c ṗ)₊ for p > 0, else 0; ``damping`` is c [N·s/m]."""

    def force(self, p: float, rate: float = 0.0) -> float:
        if p <= 0.0:
            return 0.0
        return max(float(self.stiffness * p**self.exponent) + self.damping * rate, 0.0)

    def resistance(self, p: float, rate: float) -> tuple[float, float, float]:
        if p <= 0.0:
            return 0.0, 0.0, 0.0
        elastic = self.force(p)
        viscous = self.damping * rate
        if elastic + viscous > 0.0:
            return viscous, 0.0, self.damping
        return -elastic, -self.slope(p), 0.0


@dataclass(frozen=True)
class Link(SoftLaw):
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


# -- tables ------------------------------------------------------------------------------------------------------------


class Contact(Table):
    """The contact force C as a function of the penetration p = y − u_tip (``docs/model.md``, "Interface laws")."""

    def __new__(cls, *args: Any, **keys: Any) -> Self:
        """Make the table of the law that the key ``law`` names."""
        kind: type[Any] = LAWS.get(keys.get("law", LAW.default), cls) if cls is Contact else cls
        return super().__new__(kind)

    law: str
    force_window: float | None = key(
        "s", "time over which the force of a rigid contact is averaged before its peak is taken", None, gt=0.0,
        otherwise="a fiftieth of the beam's slowest period",
    )  # fmt: skip
    gap: float = key(
        "m", "height of the unbent beam above the unloaded spring: equilibrium and unloaded of [spring] are −gap", 0.0
    )

    #: Whether ends that have met share one position; C is then a reaction.
    rigid: ClassVar[bool] = True
    #: Whether the law joins the ends from the start and for good, for either sign of C.
    lasting: ClassVar[bool] = False
    #: Whether a rigid law ties the ends below Ψ, so that C may pull there.
    ties: ClassVar[bool] = False
    #: Legend of the column ``compliance_force``, and its addition for a damped law.
    legend: ClassVar[str] = ""
    damper: ClassVar[str] = ""

    def force(self) -> SoftLaw | None:
        """Return C as a function of the penetration and its rate; ``None`` for a rigid law."""
        return None

    def compliance(self, p: "np.ndarray") -> "np.ndarray":
        """Return the part of a rigid law's force that the paper calls normal compliance [N], at depths p [m] below Ψ.

        That is the column ``compliance_force``.
        """
        return np.zeros_like(p)

    @property
    def words(self) -> str:
        """A description of the law in a few words."""
        return str(type(self).model_fields["law"].description)

    @property
    def own_keys(self) -> dict[str, float]:
        """Keys of the law beyond those of any law."""
        fields = type(self).model_fields
        return {name: getattr(self, name) for name in fields if name not in Contact.model_fields}

    @property
    def soft(self) -> bool:
        """Whether C is a function of the penetration and its rate."""
        return not self.rigid

    @property
    def opens(self) -> bool:
        """Whether the law is soft, and contact begins and ends."""
        return self.soft and not self.lasting

    @property
    def impacts(self) -> bool:
        """Whether ends that meet have an impact: different velocities before it, one velocity after it."""
        return self.rigid and not self.lasting

    def doubted(self, speed: float) -> str | None:
        """Return in words what is improbable of the law where ends meet at ``speed`` [m/s], ``None`` if nothing is."""
        return None

    @property
    def damped(self) -> bool:
        """Whether the law dissipates."""
        force = self.force()
        return force is not None and force.damped


class TransmissionContact(Contact):
    """Ends that have met are tied below Ψ, where C may pull, and only push above; the keys are those of a column alone.

    They determine ``compliance_force``, a part of C that drives nothing.
    """

    law: Literal["transmission"] = key("–", "tied below Ψ, rigid ends that only push above", "transmission")
    stiffness: float = key("N/m^p", "λ_nc of the part of C that is normal compliance", 1.0e4, ge=0.0)
    exponent: float = key("–", "exponent p of normal compliance", 3.0, ge=1.0, le=100.0)

    ties = True
    legend = "part λ(Ψ − u)₊ᵖ"

    def compliance(self, p: "np.ndarray") -> "np.ndarray":
        with np.errstate(over="ignore"):
            return self.stiffness * np.maximum(p, 0.0) ** self.exponent


class UnilateralContact(Contact):
    """Rigid ends that only push, 0 ≤ C ⊥ u_tip − y ≥ 0 (Signorini); those that meet get one velocity."""

    law: Literal["unilateral"] = key("–", "rigid ends that only push", "unilateral")


class ComplianceContact(Contact):
    """Normal compliance, C = λ p₊^q (1 + χ ṗ)₊."""

    law: Literal["compliance"] = key("–", "normal compliance", "compliance")
    stiffness: float = key("N/m^p", "stiffness λ_nc of normal compliance", gt=0.0)
    exponent: float = key("–", "exponent p of normal compliance", ge=1.0, le=100.0)
    damping: float = key("s/m", "χ (Hunt & Crossley 1975)", 0.0, ge=0.0)

    rigid = False
    legend = "of the law λ(y − u)₊ᵖ"
    damper = " (1 + χ ṗ)"

    def force(self) -> Compliance:
        return Compliance(self.stiffness, self.exponent, self.damping)

    def doubted(self, speed: float) -> str | None:
        ratio = self.damping * speed
        if ratio <= 1.0:
            return None
        return (
            f"contact.damping = {self.damping:g} s/m: where the ends meet, at {speed:.3g} m/s, the damping force is "
            f"{ratio:.3g} times the elastic one; above 1 is improbable of a solid. A damper in N·s/m is "
            'law = "kelvin_voigt"'
        )


class KelvinVoigtContact(Contact):
    """A unilateral spring and damper, C = (λ p^q + c ṗ)₊ for p > 0."""

    law: Literal["kelvin_voigt"] = key("–", "a unilateral spring and damper", "kelvin_voigt")
    stiffness: float = key("N/m^p", "stiffness λ of the contact", gt=0.0)
    exponent: float = key("–", "exponent of the penetration in the elastic force", 1.0, ge=1.0, le=100.0)
    damping: float = key("N·s/m", "damping c of the contact", 0.0, ge=0.0)

    rigid = False
    legend = "of the law λ(y − u)₊ᵖ"
    damper = " + c(z − v)"

    def force(self) -> KelvinVoigt:
        return KelvinVoigt(self.stiffness, self.exponent, self.damping)


class TieContact(Contact):
    """Ends that are joined from the start to the end."""

    law: Literal["tie"] = key("–", "tied for good", "tie")

    lasting = True


class LinkContact(Contact):
    """An elastic link with a damper, C = k p + c ṗ, from the start to the end."""

    law: Literal["link"] = key("–", "an elastic link", "link")
    stiffness: float = key("N/m", "stiffness k of the link", ge=0.0)
    damping: float = key("N·s/m", "damping c of the link", 0.0, ge=0.0)

    rigid = False
    lasting = True
    legend = "of the link λ(y − u)"
    damper = " + c(z − v)"

    @model_validator(mode="after")
    def _links(self) -> Self:
        if self.stiffness == self.damping == 0.0:
            raise ValueError('stiffness = 0.0: law = "link" needs a stiffness or a damping greater than 0')
        return self

    def force(self) -> Link:
        return Link(self.stiffness, self.damping)


class OwnContact(OfProgram, Contact):
    """The law that a program makes: ``with_changes(scene, contact=law)``, a `SoftLaw`."""

    law: str = key("–", "a law of your own", "own")
    own: SoftLaw

    rigid = False

    @property
    def lasting(self) -> bool:  # type: ignore[override]
        """Whether the law joins the ends from the start and for good."""
        return self.own.lasting

    def force(self) -> SoftLaw:
        return self.own


#: By their names in a scene.
LAWS: dict[str, type[Contact]] = {
    "transmission": TransmissionContact,
    "unilateral": UnilateralContact,
    "compliance": ComplianceContact,
    "kelvin_voigt": KelvinVoigtContact,
    "tie": TieContact,
    "link": LinkContact,
}
#: Names of laws elsewhere.
_ELSEWHERE = {
    "elastogap": "kelvin_voigt",
    "impact": "kelvin_voigt",
    "springdamper": "kelvin_voigt",
    "voigt": "kelvin_voigt",
    "huntcrossley": "compliance",
    "hertz": "compliance",
    "penalty": "compliance",
    "normalcompliance": "compliance",
    "signorini": "unilateral",
    "rigid": "unilateral",
    "hard": "unilateral",
    "bonded": "tie",
    "fixed": "tie",
    "bushing": "link",
}
LAW = OneOf(
    Contact, "law", "the interface law (docs/choose.md helps to choose)", LAWS, "transmission", elsewhere=_ELSEWHERE
)
