"""How the contact force of a macro step is found.

On a step of size H the force is a polynomial of degree d; a *coupling* (``protocol``; start there) finds its d + 1
coefficients and advances both bodies. ``tie`` holds ends together by the conditions of a scheme (``energy`` creates no
energy at any H, with ``hermite`` velocities agree, too), ``soft`` applies a contact law that is a function of the
penetration, ``projection`` says what that is over a step; both are ``solver`` with another aim. ``exchange`` is what
ordinary masters do. Imports `contact`, `bodies` and `scene`.
"""

from __future__ import annotations

from ..contact.laws import SoftLaw
from ..scene import Scene
from ..scene.statics import tip_reach
from ..scene.tables import ORDINARY_SCHEMES
from .exchange import Exchange
from .protocol import Coupling
from .soft import SoftSolver
from .tie import Tie


def coupling_of(scene: Scene, law: SoftLaw | None) -> Coupling:
    """Return what couples the bodies of ``scene`` while ``law`` acts between them, or a tie if there is none."""
    asked = scene.coupling
    if law is None:
        expected = 0.0 if scene.beam is None else tip_reach(scene.beam)
        # An exchange of values is for soft laws; a tip alone rests on its foundation by the default scheme.
        scheme = "energy" if asked.scheme in ORDINARY_SCHEMES else asked.scheme
        return Tie(scheme, asked.degree, asked.tolerance, expected)
    if asked.scheme in ORDINARY_SCHEMES:
        return Exchange(law, asked.scheme == "gauss_seidel", asked.degree)
    return SoftSolver(law, asked.degree, asked.tolerance)
