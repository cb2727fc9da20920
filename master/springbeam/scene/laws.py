"""Facts of the interface laws: what scenes, couplings and pictures must know of a law without having its force.

The forces themselves are in `springbeam.contact.laws`, and again, independently, in `springbeam.monolithic.laws`.
``docs/contributing.md`` says how a law is added. Nothing outside these three modules asks a law for its name.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple


class LawFacts(NamedTuple):
    """What a law is, which keys of ``[contact]`` it has, and what people call it."""

    #: rigid: ends that have met share one position, C is a reaction; soft: C is a function of the penetration and its
    #: rate.
    kind: Literal["rigid", "soft"]
    #: Whether it joins the ends from the start and for good, for either sign of C.
    lasting: bool = False
    #: Keys that the motion depends on.
    takes: tuple[str, ...] = ()
    #: Those of them that must be given.
    needs: tuple[str, ...] = ()
    #: Keys that only the column ``compliance_force`` depends on.
    shows: tuple[str, ...] = ()
    #: Legend of the column ``compliance_force``, and what it has besides where ``damping`` is not 0.
    force: str = "part λ(Ψ − u)₊ᵖ"
    damper: str = ""
    #: What it does, in a few words.
    words: str = ""

    def has(self, key: str) -> bool:
        """Return whether the motion or a column depends on ``key`` of ``[contact]``."""
        return key in (*self.takes, *self.shows)

    @property
    def soft(self) -> bool:
        """Whether C is a function of the penetration and its rate."""
        return self.kind == "soft"

    @property
    def opens(self) -> bool:
        """Whether it is soft, and contact begins and ends."""
        return self.soft and not self.lasting

    @property
    def strikes(self) -> bool:
        """Whether ends that meet are struck: their velocities differ before, and are one from then on."""
        return self.kind == "rigid" and not self.lasting


#: By their names in a scene.
LAWS: dict[str, LawFacts] = {
    "transmission": LawFacts(
        "rigid",
        shows=("stiffness", "exponent"),
        words="the tip and the spring move together while they touch",
    ),
    "compliance": LawFacts(
        "soft",
        takes=("stiffness", "exponent", "damping"),
        needs=("stiffness", "exponent"),
        force="of the law λ(y − u)₊ᵖ",
        damper=" (1 + χ ṗ)",
        words="normal compliance",
    ),
    "tie": LawFacts("rigid", lasting=True, words="tied for good"),
    "link": LawFacts(
        "soft",
        lasting=True,
        takes=("stiffness", "damping"),
        needs=("stiffness",),
        force="of the link λ(y − u)",
        damper=" + c(z − v)",
        words="an elastic link",
    ),
}


def laws_that(are: Callable[[LawFacts], bool]) -> str:
    """Return the names of the laws for which ``are`` holds, as an error offers them: ``"a" or "b"``."""
    return " or ".join(f'"{name}"' for name, law in LAWS.items() if are(law))
