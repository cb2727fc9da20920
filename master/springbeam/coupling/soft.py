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
from .projection import Booked
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


class SoftSolver(Booked, StepSolver):
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
        Booked.__init__(self, law, degree)
        self.state = SoftState()

    def no_contact(self, gap: Vector, size: float, start: Ends) -> bool:
        tip, low = start
        return not any(self._projection.force(low.displacement - tip.displacement, size, list(map(neg, gap))))

    def aim(self, gap: Vector, a: Vector, descent: Matrix, size: float, start: Ends) -> Aim:
        tip, low = start
        x = list(map(neg, gap))
        step = (low.displacement - tip.displacement, size, x, a, descent)
        last_size, flexibility = self.state.last_crossing
        found = None
        try:
            if self.degree > 0 and size == last_size:  # at degree 0 the law's slope costs no more than a third force
                found = self._newton(*step, flexibility)
            found = found or self._newton(*step) or self._stiffened(*step)
        except np.linalg.LinAlgError:
            pass
        if found is None:
            raise NotConverged(max(map(abs, x)), _MAX_NEWTON)
        x, better = found
        return list(map(neg, x)), list(map(sub, better, a)), better

    def _newton(
        self, start: float, size: float, x: Vector, a: Vector, descent: Matrix, flexibility: Matrix | None = None
    ) -> tuple[Vector, Vector] | None:
        """Return the x and A(x) that law and bodies have in common, ``None`` if they are not found.

        Damped Newton iteration from ``x``, where the bodies are under ``a``, a correction being accepted where the next
        one would be shorter; the slope of the law is kept where that is much shorter (Deuflhard 2004, section 2.1).
        ``descent`` is −E, ``flexibility`` a guess of (E + A′)⁻¹, good if it makes corrections shrink as much. Raises
        numpy.linalg.LinAlgError.
        """
        force = self._projection.force
        under_a = x
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
                tried = list(map(add, x, change if share == 1.0 else [share * step for step in change]))
                of_law = force(start, size, tried)
                moved = times(descent, list(map(sub, tried, under_a)))
                missing = [m - new + old for m, new, old in zip(moved, of_law, a, strict=True)]
                following = times(flexibility, missing)
                left = max(map(abs, following))
                scale = max(abs(start), *map(abs, tried))
                if left <= (1.0 - 0.25 * share) * length or length <= _ROUNDING * scale:
                    break
                share *= 0.5
            else:
                return None
            x = tried
            slow = left > _SLOW * length
            settled = left * left <= _SETTLED * scale * length or length <= _ROUNDING * scale
            if settled and not (guessed and slow):
                self.state.last_crossing = (size, flexibility)
                # The correction after the next would be left²/length; its force follows from the law's slope.
                change = times(descent, following)
                return list(map(add, x, following)), [
                    c + m + d for c, m, d in zip(of_law, missing, change, strict=True)
                ]
            if slow:
                flexibility = self._flexibility(start, size, x, of_law, descent)
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
        x = list(map(sub, x, times(inverse(descent), a)))
        a = [0.0] * len(a)
        slope = self._projection.slope(start, size, x, self._projection.force(start, size, x))
        gain = max(abs(value) for row in slope for value in row) / max(abs(e) for row in descent for e in row)
        softness = min(1.0, 1.0 / gain) if gain > 0.0 else 1.0
        while True:
            harder = [[e / softness for e in row] for row in descent]
            found = self._newton(start, size, x, [c / softness for c in a], harder)
            if found is None or softness == 1.0:
                return found
            x = found[0]
            a = [softness * c for c in found[1]]
            softness = min(1.0, _STIFFER * softness)
