"""Bodies in place of our beam or our spring: an FMU of others, or an element of a few keys.

``[beam]`` is the upper body, ``[spring]`` the lower one. Either table is our own body, or, by its key ``fmu`` or
``element``, one of these.
"""

from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator
from pydantic_core import PydanticKnownError

from .tables import Beam, OneOf, Spring, Table, key


def _no_boolean(value: Any) -> Any:
    """Return ``value``; refuse true and false, which equal 1 and 0 in Python."""
    if isinstance(value, bool):
        raise PydanticKnownError("int_type")
    return value


class ForeignFmu(Table):
    """A co-simulation FMU of FMI 2.0 or 3.0 with one end that a force moves, and the names of its variables.

    Missing names limit the couplings that are possible (`springbeam.run.validation`).
    """

    INPUTS: ClassVar = ("force", "impulse")
    #: In the order of `springbeam.bodies.protocol.Motion` and `springbeam.bodies.protocol.Energies`.
    MOTION: ClassVar = ("displacement", "velocity", "integral", "integral_2")
    ENERGIES: ClassVar = ("kinetic_energy", "potential_energy", "dissipated_energy", "load_potential")

    fmu: str = key("–", "the file; relative to the scene's")
    force: str = key("N", "input: the contact force, which presses the lower body down and lifts the upper one")
    force_sign: Annotated[Literal[1, -1], BeforeValidator(_no_boolean)] = key(
        "–", "-1 where a positive input does the opposite", 1
    )
    displacement: str = key("m", "output, upward")
    velocity: str | None = key("m/s", "output", None)
    integral: str | None = key("m·s", "output: ∫ x dτ over the last step, 0 at its start", None)
    integral_2: str | None = key("m·s²", "output: ∫∫ x dτ dτ over the last step", None)
    acceleration: str | None = key(
        "m/s²", "output, upward", None, otherwise="the derivative of the velocity, or computed by a trial step"
    )
    impulse: str | None = key("N·s", "input, upward, applied at the start of the next step", None)
    mass: float | None = key("kg", "mass that an impulse moves", None, gt=0.0, otherwise="it is measured")
    kinetic_energy: str | None = key("J", "output", None)
    potential_energy: str | None = key("J", "output", None)
    dissipated_energy: str | None = key("J", "output, since the start", None)
    load_potential: str | None = key("J", "output: −(work of loads inside)", None)
    parameters: dict[str, float | int | bool | str] = key(
        "–", "values of the FMU's parameters, start values and guesses, by name, in the units of the FMU", {}
    )

    @property
    def named(self) -> dict[str, str]:
        """The variables that have names, by key."""
        keys = (*self.INPUTS, *self.MOTION, *self.ENERGIES, "acceleration")
        return {key: name for key in keys if (name := getattr(self, key)) is not None}

    @property
    def integrals(self) -> int:
        """Number of integrals of its displacement that it has."""
        return 0 if self.integral is None else 1 if self.integral_2 is None else 2


class PointMassElement(Table):
    """A free mass, m ẍ = ± C + N + f."""

    START = "displacement"
    AT_GAP: ClassVar[tuple[str, ...]] = ("displacement",)

    element: Literal["point_mass"] = key("–", "a free mass")
    mass: float = key("kg", "mass m", gt=0.0)
    displacement: float = key("m", "position at the start", 0.0)
    velocity: float = key("m/s", "velocity at the start, upward", 0.0)
    external_force: float = key("N", "constant force f, upward", 0.0)


class SpringDamperElement(PointMassElement):
    """A mass on a linear spring and damper, m ẍ + c ẋ + k (x − x₀) = ± C + N + f."""

    AT_GAP = ("displacement", "rest")

    element: Literal["spring_damper"] = key("–", "a mass on a linear spring and damper")  # type: ignore[assignment]
    stiffness: float = key("N/m", "stiffness k", ge=0.0)
    damping: float = key("N·s/m", "damping c", 0.0, ge=0.0)
    rest: float = key("m", "where the spring has no force, x₀", 0.0)


class RigidWallElement(Table):
    """An end that is held at rest under any force."""

    START: ClassVar[str | None] = "position"
    AT_GAP = ("position",)

    element: Literal["rigid_wall"] = key("–", "an end at rest under any force")
    position: float = key("m", "where it is", 0.0)


class MovingWallElement(RigidWallElement):
    """An end that moves as given under any force, by the loads with ``on = "wall"``."""

    START = None

    element: Literal["moving_wall"] = key("–", "an end that moves as given")  # type: ignore[assignment]
    position: float = key("m", "where it is while those loads are 0", 0.0)


Partner = ForeignFmu | PointMassElement | SpringDamperElement | RigidWallElement | MovingWallElement
#: The tables of partners by what names them: the key ``fmu``, or the value of ``element``.
PARTNERS: dict[str, type[Table]] = {
    "fmu": ForeignFmu,
    "point_mass": PointMassElement,
    "spring_damper": SpringDamperElement,
    "rigid_wall": RigidWallElement,
    "moving_wall": MovingWallElement,
}
OWN = "own"


def kind_of(table: Any) -> str:
    """Return the kind of body of a table: a key of `PARTNERS`, `OWN`, or an unknown ``element``."""
    if not isinstance(table, dict):
        return next((kind for kind, model in PARTNERS.items() if type(table) is model), OWN)
    return "fmu" if "fmu" in table else str(table["element"]) if "element" in table else OWN


class _Body(OneOf):
    def kind(self, content: Any) -> str:
        return kind_of(content)

    def kept(self, content: dict[str, Any], kind: str) -> dict[str, Any]:
        """Return nothing: keys of another body do not apply to this one."""
        return {}


def _body(own: type[Table]) -> OneOf:
    return _Body(Table, "element", "the body in place of our own", {OWN: own, **PARTNERS}, OWN)


UPPER = _body(Beam)
LOWER = _body(Spring)
