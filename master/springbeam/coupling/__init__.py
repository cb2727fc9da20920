"""How the contact force of a macro step is found.

On a step of size H the force is a polynomial of degree d; a *coupling* (``protocol``; start there) finds its d + 1
coefficients and advances both bodies. ``solver`` holds ends together, and creates no energy at any H; ``soft`` is the
same with another aim: it applies a contact law that is a function of the penetration, and ``projection`` says what that
is over a step. ``exchange`` is what ordinary masters do. Imports `contact` and `bodies`.
"""

from __future__ import annotations

from ..scene.laws import SoftLaw
from .exchange import Exchange
from .protocol import Coupling
from .soft import SoftSolver
from .solver import StepSolver


def coupling_of(scheme: str, degree: int, tolerance: float, law: SoftLaw | None, expected: float = 0.0) -> Coupling:
    """Return what couples two bodies while ``law`` acts between them, or a tie if there is none.

    Parameters
    ----------
    scheme, degree, tolerance
        Of a scene's table ``[coupling]``.
    law
        The soft law.
    expected
        As of `StepSolver`.
    """
    if law is None:
        return StepSolver(degree, tolerance, expected)
    if scheme == "energy":
        return SoftSolver(law, degree, tolerance)
    return Exchange(law, scheme == "gauss_seidel", degree)
