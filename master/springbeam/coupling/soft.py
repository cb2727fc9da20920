"""Soft laws at any degree: find the force that is the projection of the law for the penetration which it causes.

Given the responses of both bodies, the force that a penetration would have and the penetration that a force would make
are two lines (or curves) whose crossing is sought, on the penetration's numbers x (`Projection`), without a step of any
body:

    f(x) = E (x − x_k) + A(x) − a_k = 0,     E = (−∂x/∂a)⁻¹,

x_k being what the bodies did under a_k. Newton's method is damped, and starts from the law softened where it does not
find the root. `StepSolver` then tries the crossing on the bodies.
"""

from __future__ import annotations

from dataclasses import dataclass
from operator import add, neg, sub

import numpy as np

from ..bodies.protocol import Ends
from ..scene.laws import SoftLaw
from .projection import SoftCoupling
from .protocol import NotConverged
from .small import Matrix, Vector, inverse, less, times
from .solver import Aim, Responses, StepSolver

_MAX_NEWTON = 60
_MAX_DAMPING = 8
#: A correction smaller than this share of the penetration's numbers changes nothing.
_SETTLED = 4.0 * 2.0**-52
#: A correction that leaves more than this share of itself asks for the law's slope anew.
_SLOW = 1e-3
#: Corrections below this share of the penetration's numbers may be roundings, which do not become shorter.
_ROUNDING = 1e-12
#: A softened law is this much stiffer from one crossing to the next.
_STIFFER = 16.0


@dataclass
class SoftState(Responses):
    """What the solver of a soft law remembers."""

    #: Size of the last step [s], and (E + A′)⁻¹ [m/N] where its crossing was found.
    last_crossing: tuple[float, Matrix] = (0.0, [])


class SoftSolver(SoftCoupling, StepSolver):
    """Coupling by a soft law.

    Parameters
    ----------
    law
        The contact law.
    degree
        Degree of the contact force over a step.
    tolerance
        Tolerance as of `StepSolver`.
    """

    state: SoftState

    def __init__(self, law: SoftLaw, degree: int, tolerance: float) -> None:
        StepSolver.__init__(self, degree, tolerance)
        SoftCoupling.__init__(self, law, degree)
        self.state = SoftState()

    def no_contact(self, gap: Vector, size: float, start: Ends) -> bool:
        tip, low = start
        return not any(self._projection.force(low.displacement - tip.displacement, size, list(map(neg, gap))))

    def aim(self, gap: Vector, a: Vector, descent: Matrix, size: float, start: Ends) -> Aim:
        tip, low = start
        x = list(map(neg, gap))
        data = (low.displacement - tip.displacement, size, x, a, descent)
        last_size, flexibility = self.state.last_crossing
        crossing = None
        try:
            if self.degree > 0 and size == last_size:  # at degree 0 the law's slope costs no more than a third force
                crossing = self._newton(*data, flexibility)
            crossing = crossing or self._newton(*data) or self._stiffened(*data)
        except np.linalg.LinAlgError:
            pass
        if crossing is None:
            raise NotConverged(max(map(abs, x)), _MAX_NEWTON)
        moved, step = crossing
        return list(map(neg, map(add, x, moved))), step, list(map(add, a, step))

    def _newton(
        self, start: float, size: float, x: Vector, a: Vector, descent: Matrix, flexibility: Matrix | None = None
    ) -> tuple[Vector, Vector] | None:
        """Return by how much x and force are to change to where law and bodies meet, ``None`` if that is not found.

        Damped Newton iteration from ``x``, where the bodies are under ``a``, a correction being accepted where the next
        one would be shorter; the slope of the law is kept where that is much shorter (Deuflhard 2004, section 2.1).
        ``descent`` is −E, ``flexibility`` a guess of (E + A′)⁻¹, good if it makes corrections shrink as much. The
        unknown is the change of x: in a short step it is less than the rounding of x, and what it does to the force is
        not. Raises numpy.linalg.LinAlgError.
        """
        force = self._projection.force
        moved = [0.0] * len(x)
        of_law = force(start, size, x)
        missing = list(map(sub, a, of_law))  # −f
        guessed = flexibility is not None
        if flexibility is None:
            flexibility = self._flexibility(start, size, x, of_law, descent)
        change = times(flexibility, missing)
        length = max(map(abs, change))
        for _ in range(_MAX_NEWTON):
            share = 1.0
            for _ in range(_MAX_DAMPING):
                tried = list(map(add, moved, change if share == 1.0 else [share * step for step in change]))
                there = list(map(add, x, tried))
                of_law = force(start, size, there)
                pushed = times(descent, tried)
                missing = [old + new - law for old, new, law in zip(a, pushed, of_law, strict=True)]
                following = times(flexibility, missing)
                left = max(map(abs, following))
                scale = max(abs(start), *map(abs, there))
                rounded = length <= _ROUNDING * scale
                if left <= (1.0 - 0.25 * share) * length or rounded:
                    break
                share *= 0.5
            else:
                return None
            moved = tried
            slow = left > _SLOW * length
            push = times(descent, following)
            # The correction after the next would be left²/length, in position and in force.
            exact = left * left <= _SETTLED * scale * length
            exact &= left * max(map(abs, push)) <= _SETTLED * length * max(map(abs, [*of_law, *a]))
            if (exact and not (guessed and slow)) or (rounded and left >= 0.5 * length):
                self.state.last_crossing = (size, flexibility)
                return list(map(add, moved, following)), list(map(add, pushed, push))
            if slow:
                flexibility = self._flexibility(start, size, there, of_law, descent)
                guessed = False
                following = times(flexibility, missing)
                left = max(map(abs, following))
            change = following
            length = left
        return None

    def _flexibility(self, start: float, size: float, x: Vector, of_law: Vector, descent: Matrix) -> Matrix:
        """Return (E + A′)⁻¹ [m/N], where the law's force is ``of_law``."""
        return inverse(less(self._projection.slope(start, size, x, of_law), descent))

    def _stiffened(
        self, start: float, size: float, x: Vector, a: Vector, descent: Matrix
    ) -> tuple[Vector, Vector] | None:
        """Start from the law so soft that the bodies hardly feel it, and stiffen it from crossing to crossing.

        The law softened by a factor s has its crossing where the law itself has one with E/s and a/s.
        """
        softened = list(map(sub, x, times(inverse(descent), a)))
        acting = [0.0] * len(a)
        slope = self._projection.slope(start, size, softened, self._projection.force(start, size, softened))
        gain = max(abs(value) for row in slope for value in row) / max(abs(e) for row in descent for e in row)
        softness = min(1.0, 1.0 / gain) if gain > 0.0 else 1.0
        while True:
            harder = [[e / softness for e in row] for row in descent]
            crossing = self._newton(start, size, softened, [c / softness for c in acting], harder)
            if crossing is None:
                return None
            moved, pushed = crossing
            softened = list(map(add, softened, moved))
            acting = [c + softness * push for c, push in zip(acting, pushed, strict=True)]
            if softness == 1.0:
                return list(map(sub, softened, x)), list(map(sub, acting, a))
            softness = min(1.0, _STIFFER * softness)
