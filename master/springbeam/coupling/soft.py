"""Soft laws at any degree: the step whose force is the projected law of the step's own penetration.

Given the responses of both bodies, the force that a penetration would have and the penetration that a force would make
are two lines (or curves) whose crossing is sought, on the penetration's numbers x (`Projection`), without a step of any
body:

    f(x) = E (x − x_k) + A(x) − a_k = 0,     E = (−∂x/∂a)⁻¹,

x_k being what the bodies did under a_k. Newton's method is damped, and starts from the law softened where it does not
find the root. `StepSolver` then tries the crossing on the bodies.
"""

from __future__ import annotations

from functools import partial
from operator import add, neg, sub

import numpy as np

from ..bodies.protocol import Body, Force
from ..contact.laws import SoftLaw
from . import energy
from .projection import Projection
from .protocol import Booking, Coupling, Ends, ErrorEstimate, NotConverged, Scales, Step, Window
from .small import Matrix, Vector, inverse, times
from .solver import StepSolver

_MAX_NEWTON, _MAX_DAMPING = 60, 8
#: A correction smaller than this share of the penetration's numbers changes nothing.
_SETTLED = 4.0 * 2.0**-52
#: A correction that leaves more than this share of itself asks for the law's slope anew.
_SLOW = 1e-3
#: Corrections below this share of the penetration's numbers may be roundings, which do not become shorter.
_ROUNDING = 1e-12
#: A softened law is this much stiffer from one crossing to the next.
_STIFFER = 16.0


class SoftSolver(Coupling):
    """Coupling by a soft law; a step that does not converge at its degree is made at degree 0, which conserves as well.

    Parameters
    ----------
    law
        The contact law.
    degree
        Degree of the contact force over a step.
    tolerance
        Tolerance as of `StepSolver`.
    """

    CHECKPOINTED = ("_solver", "_simpler", "_simplified", "_reduced", "dissipated")

    def __init__(self, law: SoftLaw, degree: int, tolerance: float) -> None:
        self.law, self.degree = law, degree
        self._solver = _Crossing(law, degree, tolerance)
        self._simpler = _Crossing(law, 0, tolerance) if degree > 0 else None
        self._simplified, self._reduced = False, 0  #: the last step tried, and the steps made
        self.dissipated = 0.0  #: by the law since the start [J]

    @property
    def iterations(self) -> int:
        return self._solver.iterations + (0 if self._simpler is None else self._simpler.iterations)

    @property
    def reduced(self) -> int:
        return self._reduced

    def solve(self, upper: Body, lower: Body, window: Window, guess: Force) -> Force:
        self._simplified = False
        try:
            return self._solver.solve(upper, lower, window, guess)
        except NotConverged:
            if self._simpler is None:
                raise
        self._simplified = True
        return self._simpler.solve(upper, lower, window, (guess[0], 0.0, 0.0))

    def accept(self, step: Step) -> None:
        self._reduced += self._simplified
        if self.law.damped:
            start, x = penetration(step, self.degree)
            self.dissipated += self._solver.projection.dissipated(start, step.size, x)

    def booking(self, ends: Ends) -> Booking:
        tip, low = ends
        return Booking(self.law.potential(low.displacement - tip.displacement), self.dissipated)

    def local_errors(self, step: Step, scales: Scales) -> list[ErrorEstimate]:
        """Estimate from the part of the law's force that the polynomial leaves out: it changes velocities."""
        start, x = penetration(step, self.degree)
        left_out = abs(self._solver.projection.left_out(start, x))
        if left_out == 0.0 or scales.reduced_mass == 0.0:
            return []
        return [(step.size * left_out / (6.0 * scales.reduced_mass * scales.speed), self.degree + 2)]


def penetration(step: Step, degree: int) -> tuple[float, Vector]:
    """Return the penetration at the start of ``step`` [m], and its numbers over the step as `Projection` takes them."""
    tip, low = step.start
    conditions = energy.CONDITIONS[degree]
    x = list(map(sub, conditions(step.end[1], step.size), conditions(step.end[0], step.size)))
    return low.displacement - tip.displacement, x


class _Crossing(StepSolver):
    """Aims at the crossing of the law with the bodies' responses."""

    def __init__(self, law: SoftLaw, degree: int, tolerance: float) -> None:
        super().__init__(energy.CONDITIONS[degree], degree, tolerance)
        self.projection = Projection(law, degree)

    def apart(self, gap: Vector, a: Vector, window: Window) -> bool:
        if any(a):
            return False
        tip, low = window.ends
        return not any(self.projection.force(low.displacement - tip.displacement, window.size, list(map(neg, gap))))

    def aim(self, gap: Vector, a: Vector, descent: Matrix, window: Window) -> tuple[Vector, Vector]:
        tip, low = window.ends
        x = list(map(neg, gap))
        try:
            found = _Line(self.projection, low.displacement - tip.displacement, window.size, x, a, descent).crossing()
        except np.linalg.LinAlgError:
            found = None
        if found is None:
            raise NotConverged(max(map(abs, x)), _MAX_NEWTON)
        x, a = found
        return list(map(neg, x)), a


class _Line:
    """The crossing of one step's law and responses; ``descent`` is −E."""

    __slots__ = ("_a", "_descent", "_force", "_slope", "_start", "_x")

    def __init__(
        self, projection: Projection, start: float, size: float, x: Vector, a: Vector, descent: Matrix
    ) -> None:
        self._force, self._slope = partial(projection.force, start, size), partial(projection.slope, start, size)
        self._start, self._x, self._a, self._descent = start, x, a, descent

    def crossing(self) -> tuple[Vector, Vector] | None:
        """Return x and A(x), ``None`` if they are not found. Raises numpy.linalg.LinAlgError."""
        return self._newton(self._x, 1.0) or self._stiffened()

    def _missing(self, x: Vector, a: Vector, softness: float) -> Vector:
        """Return −f of the law times ``softness``, whose force is ``a``."""
        if x is self._x and softness == 1.0:
            return list(map(sub, self._a, a))
        moved = times(self._descent, list(map(sub, x, self._x)))
        return [m - softness * new + old for m, new, old in zip(moved, a, self._a, strict=True)]

    def _flexibility(self, x: Vector, softness: float) -> Matrix:
        """Return (E + A′)⁻¹ [m/N], of the law times ``softness``."""
        return inverse(
            [
                [softness * s - d for s, d in zip(row, line, strict=True)]
                for row, line in zip(self._slope(x), self._descent, strict=True)
            ]
        )

    def _newton(self, x: Vector, softness: float) -> tuple[Vector, Vector] | None:
        """Return the crossing with the law times ``softness``, ``None`` if it is not found.

        Damped Newton iteration from ``x``, a correction being accepted where the next one would be shorter; the slope
        of the law is kept where that is much shorter (Deuflhard 2004, section 2.1).
        """
        force, start = self._force, self._start
        missing = self._missing(x, force(x), softness)
        flexibility = self._flexibility(x, softness)
        change = times(flexibility, missing)
        length = max(map(abs, change))
        for _ in range(_MAX_NEWTON):
            share = 1.0
            for _ in range(_MAX_DAMPING):
                tried = list(map(add, x, change if share == 1.0 else [share * step for step in change]))
                a = force(tried)
                missing = self._missing(tried, a, softness)
                following = times(flexibility, missing)
                left = max(map(abs, following))
                scale = max(abs(start), *map(abs, tried))
                if left <= (1.0 - 0.25 * share) * length or length <= _ROUNDING * scale:
                    break
                share *= 0.5
            else:
                return None
            x = tried
            if left * left <= _SETTLED * scale * length or length <= _ROUNDING * scale:
                # The correction after the next would be left²/length. For the next one the law's slope tells the force.
                felt = times(self._descent, following)
                return list(map(add, x, following)), [c + m + d for c, m, d in zip(a, missing, felt, strict=True)]
            if left > _SLOW * length:
                flexibility = self._flexibility(x, softness)
                following = times(flexibility, missing)
                left = max(map(abs, following))
            change, length = following, left
        return None

    def _stiffened(self) -> tuple[Vector, Vector] | None:
        """Start from the law so soft that the bodies hardly feel it, and stiffen it from crossing to crossing."""
        alone = [value - step for value, step in zip(self._x, times(inverse(self._descent), self._a), strict=True)]
        slope = self._slope(alone)
        gain = max(abs(value) for row in slope for value in row) / max(abs(e) for row in self._descent for e in row)
        softness = min(1.0, 1.0 / gain) if gain > 0.0 else 1.0
        x = alone
        while True:
            found = self._newton(x, softness)
            if found is None or softness == 1.0:
                return found
            x, softness = found[0], min(1.0, _STIFFER * softness)
