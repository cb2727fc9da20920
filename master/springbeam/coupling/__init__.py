"""How the contact force of a macro step is found.

On a step of size H the force is a polynomial of degree d; a *coupling* (``protocol``; start there) finds its d + 1
coefficients and advances both bodies. ``solver`` holds ends together, and creates no energy at any H; ``soft`` is the
same with another aim: it applies a contact law that is a function of the penetration, and ``projection`` says what that
is over a step. ``exchange`` is what ordinary masters do. Imports `contact`, `bodies` and `scene`.
"""

from __future__ import annotations

from ..scene import Scene
from ..scene.laws import SoftLaw
from ..scene.statics import tip_reach
from ..scene.tables import ORDINARY_SCHEMES
from .exchange import Exchange
from .protocol import Coupling
from .soft import SoftSolver
from .solver import StepSolver


def coupling_of(scene: Scene, law: SoftLaw | None) -> Coupling:
    """Return what couples the bodies of ``scene`` while ``law`` acts between them, or a tie if there is none."""
    asked = scene.coupling
    if law is None:
        expected = 0.0 if scene.beam is None else tip_reach(scene.beam)
        return StepSolver(scene.degree, asked.tolerance, expected)
    if asked.scheme in ORDINARY_SCHEMES:
        return Exchange(law, asked.scheme == "gauss_seidel", scene.degree)
    return SoftSolver(law, scene.degree, asked.tolerance)
