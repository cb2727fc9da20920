"""Find the contact force of a step by Newton's method, with responses of the bodies that are remembered.

Unknowns are the Legendre coefficients a of C; the conditions on the gap over the step (`CONDITIONS`), in metres, should
be what the law wants them to be (`StepSolver.aim`: zero, where the ends are tied). With g = 0 at the step's start and
g(H) = 0, the work of C(τ) = Σ c_j τʲ on both bodies together is, by parts,

    ∫ C ġ dτ = [C g]₀ᴴ − Σ j c_j ∫ τ^{j−1} g dτ = 0    if    ∫ τ^{j−1} g dτ = 0,  j = 1 … d,

whatever the coefficients, the step and the bodies. The moments are taken against Legendre polynomials of s = 2τ/H − 1,
which spans the same space and keeps the system well conditioned: ∫ g dτ = I₁ and ∫ s g dτ = I₁ − 2 I₂/H, with
I₁ = ∫ g dτ and I₂ = ∫∫ g dτ dτ = ∫ (H − τ) g dτ.

Both bodies advance under the force of the last step, continued; what that leaves of the conditions corrects it by
D = −(B − S)⁻¹ (Newton's method), until they hold, so a step usually costs two steps of each body. B is the response of
the upper body's conditions to a, measured once for each size of step, S that of the lower body, measured when a size
comes again and before that a free mass's. Broyden's rank-one updates make D follow what both bodies do, and it is
remembered for each size.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, field
from itertools import count
from math import inf
from operator import add, sub

import numpy as np

from ..bodies import force
from ..bodies.protocol import NO_FORCE, SIZES_REMEMBERED, Body, Ends, Force, Motion, made_of
from ..motion.curves import EPS
from .protocol import Conditions, Counts, Coupling, NotConverged, Step
from .small import Matrix, Vector, broyden, inverse, less, times, transposed

_log = logging.getLogger(__name__)

_MAX_ITERATIONS = 20
#: Rounding of a sum of modes, relative to the largest it has been.
_ROUNDING = 16.0 * float(np.finfo(float).eps)
#: An iteration that takes so long has met the bodies' own rounding.
_LATE = 8
#: That rounding, over the tolerance.
_NOISE = 1e3
#: Displacement of a lower body, over its motion, by which its response is measured; and the least of any [m].
_LITTLE = 1e-4
_LEAST = 1e-150


def _end(m: Motion, size: float) -> tuple[float, ...]:
    return (m.displacement,)


def _end_and_mean(m: Motion, size: float) -> tuple[float, ...]:
    return (m.displacement, m.integral / size)


def _end_and_moments(m: Motion, size: float) -> tuple[float, ...]:
    return (m.displacement, m.integral / size, (m.integral - 2.0 * m.integral_2 / size) / size)


#: The conditions on the gap over a step, by degree.
CONDITIONS: tuple[Conditions, ...] = (_end, _end_and_mean, _end_and_moments)
#: Where a correction leads: the conditions there [m], the correction of the coefficients [N], and these there [N].
Aim = tuple[Vector, Vector, Vector]
#: What is remembered of a size of step: B [m/N], and D = −(B − S)⁻¹ [N/m] by the mass of the lower body, for which a
#: wall stands where the foundation holds it.
Response = tuple[Matrix, dict[float, Matrix]]


@dataclass
class Responses(Counts):
    """What a solver remembers."""

    of_size: dict[float, Response] = field(default_factory=dict)  #: by size [s], the last used at the end
    reach: float = 0.0  #: largest displacement of an end under a force found [m]


class StepSolver(Coupling):
    """The tie: both ends move together. Keeps the responses of the bodies between steps.

    Parameters
    ----------
    degree
        Degree of the contact force.
    tolerance
        Tolerance of the conditions, relative to the motion over the step: the larger of H·max(|u̇|, |ẏ|) and |Δu|, or
        what the force moves the upper end by, if that is less.
    expected
        A displacement that is to be expected [m]: modes whose sum, the tip, is held at 0 are as large.
    """

    state: Responses

    def __init__(self, degree: int, tolerance: float, expected: float = 0.0) -> None:
        self._conditions = CONDITIONS[degree]
        self.degree = degree
        self._tolerance = tolerance
        self._expected = expected
        self.state = Responses()

    def no_contact(self, gap: Vector, size: float, start: Ends) -> bool:
        """Return whether nothing should act where nothing acts between the bodies; parameters as of `aim`."""
        return False

    def aim(self, gap: Vector, a: Vector, descent: Matrix, size: float, start: Ends) -> Aim:
        """Return where force and conditions are to go.

        Parameters
        ----------
        gap
            The conditions [m] under the coefficients ``a`` [N].
        descent
            D = −(∂gap/∂a)⁻¹ [N/m].
        size, start
            Of the step, as of `solve`.
        """
        change = times(descent, gap)
        return [0.0] * len(gap), change, list(map(add, a, change))

    def solve(self, upper: Body, lower: Body, time: float, size: float, start: Ends, guess: Force) -> Step:
        """Advance both bodies so that the conditions hold, as `Coupling.solve` says."""
        a = force.legendre(guess, size, self.degree)
        step, gap = self._advanced(upper, lower, time, size, start, a)
        if not any(a) and self.no_contact(gap, size, start):
            return step
        tip, low = step.end
        remembered = self.state.of_size.pop(size, None)
        B, descents = remembered or (self._response(upper, step, tip, a, 1.0, self._expected or _LEAST), {})
        descent = known = descents.get(lower.mass)
        if descent is None:
            # A size that comes again may come often: to measure S then saves a step of each body in most.
            S = self._free_response(lower, size)
            if remembered:
                S = self._response(lower, step, low, a, _LITTLE, _LEAST)
            descent = _descent(B, S)
        goal, change, better = self.aim(gap, a, descent, size, start)
        # Rounding is always enough; the tolerance follows from the motion, and counts if rounding is not reached.
        rounding = _ROUNDING * max(self.state.reach, abs(start[0].displacement))
        for iteration in count():
            missed = list(map(sub, gap, goal))
            norm = max(map(abs, missed))
            if not norm < inf or iteration == _MAX_ITERATIONS:
                raise NotConverged(norm, iteration)
            if norm <= rounding and (iteration or (known and max(map(abs, change)) <= EPS * max(map(abs, a)))):
                break
            if iteration:
                if norm <= self._absolute_tolerance(step, times(B, a), late=iteration >= _LATE):
                    break
                descent = broyden(descent, change, missed)
                goal, change, better = self.aim(gap, a, descent, size, start)
            self.state.iterations += 1
            a = better
            step, gap = self._advanced(upper, lower, time, size, start, a)
        _log.debug("t = %.9g s, H = %.3g s: %d iterations, residual %.2g m", time, size, iteration, norm)
        state = self.state
        # Not of the forces tried on the way, which may have thrown the ends as far as they liked.
        tip, low = step.end
        state.reach = max(state.reach, abs(tip.displacement), abs(low.displacement))
        if remembered:
            descents[lower.mass] = descent
        state.of_size[size] = (B, descents)
        if len(state.of_size) > SIZES_REMEMBERED:  # the one that was used least recently is forgotten
            del state.of_size[next(iter(state.of_size))]
        return step

    def _advanced(
        self, upper: Body, lower: Body, time: float, size: float, start: Ends, a: Vector
    ) -> tuple[Step, Vector]:
        """Return the step from the marks under the coefficients ``a``, and the conditions [m] after it."""
        acting = force.derivatives(a, size)
        upper.rewind()
        tip = upper.advance(time, size, acting)
        lower.rewind()
        low = lower.advance(time, size, acting)
        gap = list(map(sub, self._conditions(tip, size), self._conditions(low, size)))
        return made_of(Step, (time, size, acting, NO_FORCE, start, (tip, low))), gap

    def _free_response(self, lower: Body, size: float) -> Matrix:
        unit = force.free_mass_response(self.degree, size, lower.mass)
        return transposed([self._conditions(m, size) for m in unit])

    def _response(self, body: Body, step: Step, end: Motion, a: Vector, share: float, least: float) -> Matrix:
        """Return columns ∂conditions/∂a_k by differences about ``a``, under which ``body`` made ``step`` to ``end``.

        The difference would move a free mass by a ``share`` of the motion, at least by ``least`` [m]; it is exact where
        the body is linear, as the massless beam is.
        """
        if body.mass == inf:
            return [[0.0] * len(a)] * len(a)
        time, size, *_ = step
        length = share * max(abs(end.displacement), size * abs(end.velocity))
        delta = 2.0 * body.mass * max(length, least) / (size * size) or 1.0
        columns = []
        for k in range(len(a)):
            changed = a.copy()
            changed[k] += delta
            body.rewind()
            moved = self._conditions(body.advance(time, size, force.derivatives(changed, size)), size)
            columns.append([(x - y) / delta for x, y in zip(moved, self._conditions(end, size), strict=True)])
        return transposed(columns)

    def _absolute_tolerance(self, step: Step, by_force: Vector, *, late: bool) -> float:
        """Return the tolerance of the conditions after ``step`` [m].

        ``by_force`` is what the force has moved the upper end by [m]; ``late`` says whether it allows for the rounding
        of bodies.
        """
        u, v, _, _ = step.start[0]
        y, z, _, _ = step.end[1]
        forced = max(map(abs, by_force))
        change = max(step.size * max(v, -v, z, -z), abs(y - u))
        # The end is a sum of modes as large as it has ever been, and of what the force does; both are rounded.
        rounding = _ROUNDING * max(self.state.reach, u, -u, y, -y, forced)
        if late:
            return max(_NOISE * max(self._tolerance * change, rounding), _ROUNDING * self._expected)
        # In a short step the force moves the ends less than their velocities do, and has to be as exact.
        return max(self._tolerance * (min(change, forced) if forced else change), rounding)


def _descent(B: Matrix, S: Matrix) -> Matrix:
    """Return −(B − S)⁻¹, from residuals to Newton's steps. Raises NotConverged if there is none."""
    try:
        return inverse(less(S, B))
    except np.linalg.LinAlgError:
        raise NotConverged(float("nan"), 0) from None
