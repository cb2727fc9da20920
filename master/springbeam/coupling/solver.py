"""Find the contact force of a step: Newton's method on conditions of the gap, with responses that are remembered.

Unknowns are the Legendre coefficients a of C; residuals are conditions on the gap over the step, in metres, beside what
the law wants them to be (`StepSolver.aim`: nothing at all, where the ends are tied). The beam is linear: its conditions
are affine in a with a matrix B that depends on H alone, which is measured once per H and remembered. The spring's
matrix S starts as that of a free mass, is measured when a size comes again, and follows by Broyden's rank-one updates,
so a step usually costs two beam steps and two spring steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from operator import add, sub
from typing import ClassVar

import numpy as np

from ..bodies import force
from ..bodies.protocol import Body, Force, Motion
from .protocol import Conditions, Coupling, NotConverged, Window
from .small import Matrix, Vector, broyden, inverse, times, transposed

_MAX_ITERATIONS = 20
#: Rounding of a sum of modes, relative to the largest it has been.
_ROUNDING = 16.0 * float(np.finfo(float).eps)
#: Where the iteration stops to converge within this factor of the tolerance it has met the bodies' own rounding.
_NOISE = 1e3
#: A correction that leaves more than this share of the residual makes no progress.
_STAGNATES = 0.3

#: Step sizes whose responses are remembered: the macro step's, and some of steps cut by events.
SIZES_REMEMBERED = 64


#: How corrections follow from residuals against one kind of lower body: D = −(B − S)⁻¹ [N/m], and whether S was
#: measured; if not, it is that of a free mass, followed by Broyden's updates.
Descent = tuple[Matrix, bool]
#: What is remembered of a size of step: B of the upper body's conditions to a [m/N], and descents by the kind of the
#: lower body.
Response = tuple[Matrix, dict[str, Descent]]


class StepSolver(Coupling):
    """Solver of one set of conditions; keeps the responses of the bodies between steps.

    Parameters
    ----------
    conditions
        On the gap over a step.
    degree
        Degree of the contact force.
    tolerance
        Tolerance of the conditions, relative to the motion over the step, the larger of H·max(|u̇|, |ẏ|) and |Δu|.
    expected
        A displacement that is to be expected [m]: modes whose sum, the tip, is held at 0 are as large.
    """

    CHECKPOINTED: ClassVar[tuple[str, ...]] = ("_sizes", "_last_size", "_reach", "iterations")

    def __init__(self, conditions: Conditions, degree: int, tolerance: float, expected: float = 0.0) -> None:
        self._conditions = conditions
        self.degree = degree
        self._tolerance = tolerance
        self._sizes: dict[float, Response] = {}
        self._last_size = 0.0
        self._reach = 0.0  #: largest displacement of an end under a force found [m]
        self._expected = expected
        self.iterations = 0

    def no_contact(self, gap: Vector, a: Vector, window: Window) -> bool:
        """Return whether nothing acts between the bodies under ``a``, nor should; parameters as of `aim`."""
        return False

    def aim(self, gap: Vector, a: Vector, descent: Matrix, window: Window) -> tuple[Vector, Vector] | None:
        """Return what the conditions should be, and the coefficients that would make them so; ``None``: zero.

        Parameters
        ----------
        gap
            The conditions [m] under the coefficients ``a`` [N].
        descent
            D = −(∂gap/∂a)⁻¹ [N/m].
        window
            The step.
        """
        return None

    def solve(self, upper: Body, lower: Body, window: Window, guess: Force) -> Force:
        """Advance both bodies from their marks over ``window`` so that the conditions hold; return the force.

        ``guess`` is the contact force as far as known. Raises NotConverged (with the residual [m]) or StepRefused.
        """
        time, size, (start, _) = window
        conditions = self._conditions
        a = force.legendre(guess, size, self.degree)
        acting = force.derivatives(a, size)
        upper.rewind()
        upper_end = upper.advance(time, size, acting)
        r_upper: Sequence[float] = conditions(upper_end, size)
        lower.rewind()
        lower_end = lower.advance(time, size, acting)
        r_lower = conditions(lower_end, size)
        gap = list(map(sub, r_upper, r_lower))
        if self.no_contact(gap, a, window):
            return acting
        tried: Vector | None = a  # at the upper body in earnest; elsewhere its end is predicted
        known = self._sizes.get(size)
        if known is None:
            tried = None
            length = max(self._expected, abs(upper_end.displacement), size * abs(upper_end.velocity))
            known = (self._measure(upper, time, size, a, r_upper, length), {})
        self._remember(size, known)
        (B, descents), kind = known, type(lower).__name__
        remembered = descents.get(kind)
        descent, measured = remembered or (_descent(B, self._free_response(lower, size)), False)
        aim = self.aim(gap, a, descent, window)
        residual = gap if aim is None else list(map(sub, gap, aim[0]))
        norm = max(map(abs, residual))
        # Rounding at least. What is asked is known once the motion is; that under the guess may be far from it.
        enough = tolerance = _ROUNDING * max(self._reach, abs(start.displacement))
        noisy = False  # the iteration has met the bodies' own rounding
        fresh = False  # S was measured for this step
        for iteration in range(_MAX_ITERATIONS):
            if not norm < inf:
                raise NotConverged(norm, iteration)
            previous = norm
            if norm <= enough:
                if tried is a:
                    break
                upper.rewind()
                upper_end, tried = upper.advance(time, size, acting), a
                r_upper = conditions(upper_end, size)  # in place of the affine prediction
            else:
                self.iterations += 1
                if aim is None:
                    step = times(descent, residual)
                    a = list(map(add, a, step))
                else:
                    step, a = list(map(sub, aim[1], a)), aim[1]
                acting = force.derivatives(a, size)
                r_upper = list(map(add, r_upper, times(B, step)))
                lower.rewind()
                lower_end = lower.advance(time, size, acting)
                r_lower = conditions(lower_end, size)
                tolerance = self._absolute_tolerance(start, lower_end, size, times(B, a))
                enough = self._noise(tolerance) if noisy else tolerance
            gap = list(map(sub, r_upper, r_lower))
            residual = gap if aim is None else list(map(sub, gap, aim[0]))
            norm = max(map(abs, residual))
            if not norm > enough:
                continue
            if tried is not a:  # below, the difference is rounding and would spoil what is known
                descent = broyden(descent, step, residual)
            stagnates = norm > _STAGNATES * previous
            # S is measured once, when a size comes again: it then saves a step of the lower body in most.
            if (stagnates and not fresh) or not (remembered is None or measured):
                length = 1e-4 * max(abs(lower_end.displacement), size * abs(lower_end.velocity))
                S = self._measure(lower, time, size, a, r_lower, length)
                lower.rewind()
                lower.advance(time, size, acting)
                descent, measured, fresh = _descent(B, S), True, True
            elif stagnates and norm <= self._noise(tolerance):
                noisy, enough = True, self._noise(tolerance)
            if aim is not None:
                aim = self.aim(gap, a, descent, window)
                assert aim is not None
                residual = list(map(sub, gap, aim[0]))
                norm = max(map(abs, residual))
        else:
            raise NotConverged(norm, _MAX_ITERATIONS)
        self._last_size = size
        # Not of the forces tried on the way, which may have thrown the ends as far as they liked.
        self._reach = max(self._reach, abs(upper_end.displacement), abs(lower_end.displacement))
        descents[kind] = (descent, measured)
        return acting

    def _noise(self, tolerance: float) -> float:
        """Return up to which residual [m] an iteration that stagnates may have met the bodies' own rounding."""
        return max(_NOISE * tolerance, _ROUNDING * self._expected)

    def _remember(self, size: float, known: Response) -> None:
        """Keep ``known`` as what was used last, and forget the size that was used least recently."""
        if size != self._last_size:
            self._sizes.pop(size, None)
            self._sizes[size] = known
            if len(self._sizes) > SIZES_REMEMBERED:
                del self._sizes[next(iter(self._sizes))]

    def _free_response(self, lower: Body, size: float) -> Matrix:
        if lower.mass == inf:
            return [[0.0] * (self.degree + 1)] * (self.degree + 1)
        unit = force.free_mass_response(self.degree, size, lower.mass)
        return transposed([self._conditions(m, size) for m in unit])

    def _measure(self, body: Body, time: float, size: float, a: Vector, r: Sequence[float], length: float) -> Matrix:
        """Return columns ∂conditions/∂a_k by differences about ``a``, where they are ``r``.

        The difference would move a free mass by ``length`` [m]; it is exact where the body is linear, as the massless
        beam is.
        """
        if body.mass == inf:
            return [[0.0] * len(a)] * len(a)
        delta = 2.0 * body.mass * max(length, 1e-150) / (size * size) or 1.0
        columns = []
        for k in range(len(a)):
            changed = a.copy()
            changed[k] += delta
            body.rewind()
            r_changed = self._conditions(body.advance(time, size, force.derivatives(changed, size)), size)
            columns.append([(x - y) / delta for x, y in zip(r_changed, r, strict=True)])
        return transposed(columns)

    def _absolute_tolerance(self, start: Motion, end: Motion, size: float, by_force: Vector) -> float:
        """Return the tolerance [m]; ``start`` is the upper body's motion, ``end`` the lower one's."""
        (u, v, _, _), (y, z, _, _) = start, end
        change = max(size * max(abs(v), abs(z)), abs(y - u))
        # The end is a sum of modes as large as it has ever been, and of what the force does; both are rounded.
        rounding = _ROUNDING * max(self._reach, abs(u), abs(y), *map(abs, by_force))
        return max(self._tolerance * change, rounding)


def _descent(B: Matrix, S: Matrix) -> Matrix:
    """Return −(B − S)⁻¹, from residuals to Newton's steps. Raises NotConverged if there is none."""
    try:
        return inverse([list(map(sub, *rows)) for rows in zip(S, B, strict=True)])
    except np.linalg.LinAlgError:
        raise NotConverged(float("nan"), 0) from None
