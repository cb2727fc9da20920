"""Soft laws at any degree: the step whose force is the projected law of the step's own penetration.

Given the responses of both bodies, the force that a penetration would have and the penetration that a force would make
are two lines (or curves) whose crossing is sought, on the penetration's numbers x (`Projection`), without a step of any
body:

    f(x) = E (x − x_k) + A(x) − a_k = 0,     E = (−∂x/∂a)⁻¹,

x_k being what the bodies did under a_k. For degree 0 f rises and has one root; above, Newton's method is damped, and
starts from the law softened where it does not find the root. `StepSolver` then tries the crossing on the bodies.
"""

from __future__ import annotations

from operator import sub

import numpy as np

from ..bodies.protocol import Body, Force
from ..contact.laws import SoftLaw
from . import energy
from .projection import Projected, Projection
from .protocol import Booking, Coupling, Ends, ErrorEstimate, NotConverged, Scales, Step, Window
from .small import Matrix, Vector, inverse, inverse_by_minors, times
from .solver import StepSolver

_MAX_NEWTON, _MAX_DAMPING = 60, 8
#: A correction smaller than this share of the penetration's numbers changes nothing.
_SETTLED = 4.0 * 2.0**-52
#: The crossing is known to this share of a correction before Newton's last, quadratic step.
_LAST_STEP = 1e-9
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
            self.dissipated += self._solver.projection.dissipated(start, x, step.size)

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
        start = low.displacement - tip.displacement
        return not any(self.projection(start, [-g for g in gap], window.size).a)

    def aim(self, gap: Vector, a: Vector, descent: Matrix, window: Window) -> tuple[Vector, Vector]:
        tip, low = window.ends
        line = _Line(self.projection, low.displacement - tip.displacement, window.size, [-g for g in gap], a, descent)
        x, projected = line.crossing()
        return [-value for value in x], projected.a


class _Line:
    """The crossing of one step's law and responses; ``descent`` is −E."""

    def __init__(
        self, projection: Projection, start: float, size: float, x: Vector, a: Vector, descent: Matrix
    ) -> None:
        self._projection, self._start, self._size = projection, start, size
        self._x, self._a, self._descent = x, a, descent

    def crossing(self) -> tuple[Vector, Projected]:
        """Raises NotConverged."""
        if self._projection.degree == 0:
            return self._bracketed()
        try:
            found = self._newton(self._x, 1.0) or self._stiffened()
        except np.linalg.LinAlgError:
            found = None
        if found is None:
            raise NotConverged(max(map(abs, self._x)), _MAX_NEWTON)
        return found

    def _law(self, x: Vector) -> Projected:
        return self._projection(self._start, x, self._size)

    def _residual(self, x: Vector, a: Vector, softness: float) -> Vector:
        """Return −f of the law times ``softness``."""
        moved = times(self._descent, list(map(sub, x, self._x)))
        return [m - softness * new + old for m, new, old in zip(moved, a, self._a, strict=True)]

    def _flexibility(self, slope: Matrix, softness: float) -> Matrix:
        """Return (E + A′)⁻¹ [m/N], of the law times ``softness``."""
        return inverse_by_minors(
            [
                [softness * s - d for s, d in zip(row, line, strict=True)]
                for row, line in zip(slope, self._descent, strict=True)
            ]
        )

    def _bracketed(self) -> tuple[Vector, Projected]:
        """Degree 0: Newton's method, kept between bounds that f's sign tells."""
        low, high = -float("inf"), float("inf")
        E = -self._descent[0][0]
        x = self._x[0]
        for _ in range(_MAX_NEWTON):
            projected = self._law([x])
            residual = self._residual([x], projected.a, 1.0)[0]
            low, high = (x, high) if residual > 0.0 else (low, x)
            rise = E + projected.slope[0][0]
            if not rise > 0.0:  # responses that rounding has spoilt
                raise NotConverged(abs(x), _MAX_NEWTON)
            change = residual / rise
            if abs(change) <= _SETTLED * max(abs(x), abs(self._start)) or high <= low:
                return [x], projected
            x += change
            if not low < x < high:
                x = 0.5 * (low + high)
        return [x], self._law([x])

    def _newton(self, x: Vector, softness: float) -> tuple[Vector, Projected] | None:
        """Damped Newton iteration from ``x``, a correction being accepted where the next one would be shorter."""
        projected = self._law(x)
        residual = self._residual(x, projected.a, softness)
        for _ in range(_MAX_NEWTON):
            flexibility = self._flexibility(projected.slope, softness)
            change = times(flexibility, residual)
            length = max(map(abs, change))
            scale = max(abs(self._start), *map(abs, x))
            share = 1.0
            for _ in range(_MAX_DAMPING):
                tried = [value + share * step for value, step in zip(x, change, strict=True)]
                there = self._law(tried)
                left = self._residual(tried, there.a, softness)
                if length <= _LAST_STEP * scale:
                    return tried, there
                following = max(map(abs, times(flexibility, left)))
                if following <= (1.0 - 0.25 * share) * length:
                    break
                share *= 0.5
            else:
                return None
            x, projected, residual = tried, there, left
            if following <= _SETTLED * scale:
                return x, projected
        return None

    def _stiffened(self) -> tuple[Vector, Projected] | None:
        """Start from the law so soft that the bodies hardly feel it, and stiffen it from crossing to crossing."""
        alone = [value - step for value, step in zip(self._x, times(inverse(self._descent), self._a), strict=True)]
        slope = self._law(alone).slope
        gain = max(abs(value) for row in slope for value in row) / max(abs(e) for row in self._descent for e in row)
        softness = min(1.0, 1.0 / gain) if gain > 0.0 else 1.0
        x = alone
        while True:
            found = self._newton(x, softness)
            if found is None or softness == 1.0:
                return found
            x, softness = found[0], min(1.0, _STIFFER * softness)
