"""Bodies in units of their own, where all that is not said is 1: what exact solutions are stated for."""

from __future__ import annotations

from typing import Any

from .tables import Beam, Spring

#: ρ = A = I = E = G = K = L = 1: ρA = ρI = EI = KAG = 1.
UNIT_BEAM: dict[str, Any] = dict.fromkeys(
    ("density", "length", "area", "second_moment_of_area", "young_modulus", "shear_modulus", "shear_coefficient"), 1.0
)
UNIT_SPRING: dict[str, Any] = {"mass": 1.0, "linear_stiffness": 1.0}


def unit_beam(**keys: Any) -> Beam:
    """Return `UNIT_BEAM` with some keys changed."""
    return Beam(**{**UNIT_BEAM, **keys})


def unit_spring(**keys: Any) -> Spring:
    """Return `UNIT_SPRING` with some keys changed."""
    return Spring(**{**UNIT_SPRING, **keys})
