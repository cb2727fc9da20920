"""Coupling schemes: how the contact force of a step is found, and how long steps are.

A scheme is one table of keys, a `Coupling` named in `SCHEMES`. Only this module and `springbeam.coupling`, which has
the schemes, compare their names.
"""

from typing import Any, ClassVar, Literal

from pydantic import model_validator

from .tables import TOLERANCE_KEYS, OneOf, SceneError, Table, key

#: The key that sets the length of macro steps, where no tolerances do.
STEP_KEY = "macro_step"
#: H [s] of a scene that gives neither: that of Ahn & Tate's section 6.
DEFAULT_STEP = 0.004
#: Keys that ``accuracy`` sets, by table.
PICKED_BY_ACCURACY = {
    "coupling": ("scheme", "degree", STEP_KEY, *TOLERANCE_KEYS, "tolerance"),
    "spring": TOLERANCE_KEYS,
}


class Coupling(Table):
    """Scheme of the contact force, and size of the steps (``docs/coupling.md``)."""

    scheme: str
    degree: int | None
    macro_step: float | None

    #: Whether values are exchanged once per macro step, as ordinary masters do; the energy may then change.
    exchanges: ClassVar[bool] = False

    @property
    def adaptive(self) -> bool:
        """Whether the steps follow from tolerances."""
        return False

    @property
    def H(self) -> float:
        """The macro step [s]. Raises SceneError if tolerances are given instead."""
        if self.macro_step is None:
            raise SceneError("[coupling] macro_step: needed here; this scene gives tolerances instead")
        return self.macro_step


class EnergyCoupling(Coupling):
    """The force of a step is found by iteration, so that it creates no energy."""

    scheme: Literal["energy"] = key("–", "the force of a step is found by iteration", "energy")
    degree: int | None = key(
        "–", "degree of the contact force over a step", None, ge=0, le=2,
        otherwise="the highest that both bodies allow",
    )  # fmt: skip
    macro_step: float | None = key("s", "length H of a macro step", None, gt=0.0, otherwise="0.004 without tolerances")
    relative_tolerance: float | None = key(
        "–", "largest error of a step, relative to the motion so far", None, gt=0.0, le=0.1
    )
    absolute_tolerance: float | None = key("m", "largest error of a step", None, gt=0.0)
    tolerance: float = key("–", "relative tolerance of the contact force of a step", 1.0e-12, gt=0.0, le=1e-3)

    WAYS = (((STEP_KEY,), TOLERANCE_KEYS),)

    @model_validator(mode="before")
    @classmethod
    def _default_step(cls, data: Any) -> Any:
        if isinstance(data, dict) and all(data.get(key) is None for key in (STEP_KEY, *TOLERANCE_KEYS)):
            return {**data, STEP_KEY: DEFAULT_STEP}
        return data

    @property
    def adaptive(self) -> bool:
        return self.relative_tolerance is not None or self.absolute_tolerance is not None


class _Exchange(Coupling):
    degree: int | None = key(
        "–", "degree of the contact force over a step", None, ge=0, le=1, otherwise="0: held over the step"
    )
    macro_step: float = key("s", "length H of a macro step", DEFAULT_STEP, gt=0.0)

    exchanges = True
    #: Nothing is iterated, and no step repeated.
    tolerance: ClassVar[float] = 0.0
    relative_tolerance: ClassVar[None] = None
    absolute_tolerance: ClassVar[None] = None


class GaussSeidelCoupling(_Exchange):
    """One body advances after the other, once per macro step."""

    scheme: Literal["gauss_seidel"] = key("–", "one body advances after the other, once")


class JacobiCoupling(_Exchange):
    """Both bodies advance at once, under the force at the start of the macro step."""

    scheme: Literal["jacobi"] = key("–", "both bodies advance at once, under the force at the start of the step")


Scheme = EnergyCoupling | GaussSeidelCoupling | JacobiCoupling
#: By their names in a scene.
SCHEMES: dict[str, type[Coupling]] = {
    "energy": EnergyCoupling,
    "gauss_seidel": GaussSeidelCoupling,
    "jacobi": JacobiCoupling,
}
SCHEME = OneOf(Coupling, "scheme", "coupling scheme", SCHEMES, "energy")
