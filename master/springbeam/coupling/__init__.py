"""The contact force over one macro step.

On a step of size H the force is a polynomial of degree d; its d + 1 coefficients are found from d + 1 conditions on
the gap g = u_tip − y over that step. A *scheme* is the choice of these conditions:

* `energy`  — g(t+H) = 0 and vanishing moments of g: the contact force does no net work, at any H;
* `hermite` — g(t+H) = ġ(t+H) = 0 and vanishing moments: displacements and velocities agree at every macro point.

`tie` solves the conditions of either; `compliance` is the discrete gradient of the normal-compliance law, `one_way`
the same with one body that does not feel it, `exchange` what ordinary masters do.
``docs/coupling.md`` derives all of it.
"""

from __future__ import annotations

from collections.abc import Callable

from ..bodies.protocol import Motion
from . import energy, hermite

#: Conditions of a scheme as a linear map of an end's motion over a step of size H, each in metres.
Conditions = Callable[[Motion, float], tuple[float, ...]]


def conditions(scheme: str, degree: int) -> Conditions:
    """The d + 1 conditions of ``scheme`` at ``degree``."""
    return {"energy": energy.CONDITIONS, "hermite": hermite.CONDITIONS}[scheme][degree]
