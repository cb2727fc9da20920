"""Find the contact force of a step: predict, correct, verify, with responses of the bodies that are remembered.

Unknowns are the Legendre coefficients a of C; the conditions on the gap over the step (`CONDITIONS`), in metres, should
be what the law wants them to be (`StepSolver.aim`: zero, where the ends are tied). With g = 0 at the step's start and
g(H) = 0, the work of C(τ) = Σ c_j τʲ on both bodies together is, by parts,

    ∫ C ġ dτ = [C g]₀ᴴ − Σ j c_j ∫ τ^{j−1} g dτ = 0    if    ∫ τ^{j−1} g dτ = 0,  j = 1 … d,

whatever the coefficients, the step and the bodies. The moments are taken against Legendre polynomials of s = 2τ/H − 1,
which spans the same space and keeps the system well conditioned: ∫ g dτ = I₁ and ∫ s g dτ = I₁ − 2 I₂/H, with
I₁ = ∫ g dτ and I₂ = ∫∫ g dτ dτ = ∫ (H − τ) g dτ.

Both bodies advance under the force of the last step, continued. Corrections follow from responses: B of the upper
body's conditions to a is measured once for each size of step and remembered, for the beam is linear. S of the lower
body's starts as that of a free mass, and Broyden's rank-one updates make it follow. Under a corrected force the lower
body advances and the end of the upper one is predicted by B. Once the conditions hold so, the upper body advances to
verify it, so a step usually costs two steps of each body. An upper body that is not linear is found out there, and B
follows as S does.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, field
from math import inf
from operator import add, sub

import numpy as np

from ..bodies import force
from ..bodies.protocol import NO_FORCE, SIZES_REMEMBERED, Body, Ends, Force, Motion, made_of
from ..motion.paths import EPS
from .protocol import Conditions, Counts, Coupling, NotConverged, Step
from .small import Matrix, Vector, broyden, inverse, less, secant, times, transposed

_log = logging.getLogger(__name__)

_MAX_ITERATIONS = 20
#: Rounding of a sum of modes, relative to the largest it has been.
_ROUNDING = 16.0 * float(np.finfo(float).eps)
#: An iteration that takes so long has met the bodies' own rounding.
_LATE = 8
#: That rounding, over the tolerance.
_NOISE = 1e3


def _end(m: Motion, size: float) -> tuple[float, ...]:
    return (m.displacement,)


def _end_and_mean(m: Motion, size: float) -> tuple[float, ...]:
    return (m.displacement, m.integral / size)


def _end_and_moments(m: Motion, size: float) -> tuple[float, ...]:
    return (m.displacement, m.integral / size, (m.integral - 2.0 * m.integral_2 / size) / size)


#: The conditions on the gap over a step, by degree.
CONDITIONS: tuple[Conditions, ...] = (_end, _end_and_mean, _end_and_moments)
#: Where a correction leads: the conditions there [m], ``None`` if zero; the correction of the coefficients [N], and the
#: coefficients there [N].
Aim = tuple[Vector | None, Vector, Vector]
#: What is remembered of a size of step: B [m/N]; D = −(B − S)⁻¹ [N/m], unless the lower body was a wall; and whether S
#: was measured. If not, it is that of a free mass, followed by Broyden's updates.
Response = tuple[Matrix, Matrix | None, bool]
_UNKNOWN: tuple[None, None, bool] = (None, None, False)


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
        step = times(descent, gap)
        return None, step, list(map(add, a, step))

    def solve(self, upper: Body, lower: Body, time: float, size: float, start: Ends, guess: Force) -> Step:
        """Advance both bodies so that the conditions hold, as `Coupling.solve` says."""
        conditions = self._conditions
        derivatives = force.derivatives
        a = known = force.legendre(guess, size, self.degree)  # known: where the upper body has been
        acting = derivatives(a, size)
        upper.rewind()
        upper_end = upper.advance(time, size, acting)
        r_upper: Sequence[float] = conditions(upper_end, size)
        lower.rewind()
        lower_end = lower.advance(time, size, acting)
        r_lower = conditions(lower_end, size)
        gap = list(map(sub, r_upper, r_lower))
        if not any(a) and self.no_contact(gap, size, start):
            return made_of(Step, (time, size, acting, NO_FORCE, start, (upper_end, lower_end)))
        B, descent, measured = remembered = self.state.of_size.get(size, _UNKNOWN)
        predicted = B is None  # whether the upper body is elsewhere than at its end under ``a``
        if B is None:
            length = max(self._expected, abs(upper_end.displacement), size * abs(upper_end.velocity))
            B = self._measure(upper, time, size, a, r_upper, length)
        if descent is None or lower.mass == inf:
            descent = _descent(B, self._free_response(lower, size))
        goal, step, better = self.aim(gap, a, descent, size, start)
        residual = gap if goal is None else list(map(sub, gap, goal))
        norm = max(map(abs, residual))
        # Rounding is always enough; the tolerance follows from the motion, and counts if rounding is not reached.
        enough = rounding = _ROUNDING * max(self.state.reach, abs(start[0].displacement))
        # S is measured once, when a size comes again: it then saves a step of the lower body in most.
        due = not measured and remembered[1] is not None and lower.mass < inf
        for iteration in range(_MAX_ITERATIONS):
            if not norm < inf:
                raise NotConverged(norm, iteration)
            if norm <= enough and (iteration or max(map(abs, step)) <= EPS * max(map(abs, a))):
                if not predicted:
                    break
                upper.rewind()
                upper_end = upper.advance(time, size, acting)
                r_upper = conditions(upper_end, size)
                predicted = False
            else:
                self.state.iterations += 1
                a = better
                acting = derivatives(a, size)
                r_upper = list(map(add, r_upper, times(B, step)))
                predicted = True
                lower.rewind()
                lower_end = lower.advance(time, size, acting)
                r_lower = conditions(lower_end, size)
                enough = rounding
            before = gap
            gap = list(map(sub, r_upper, r_lower))
            residual = gap if goal is None else list(map(sub, gap, goal))
            norm = max(map(abs, residual))
            if not norm > enough:
                continue
            late = iteration >= _LATE
            enough = self._absolute_tolerance(start[0], lower_end, size, times(B, a), late=late)
            if norm <= enough:
                continue
            if not predicted:
                # The upper body is not linear: what it missed of the prediction corrects both responses.
                taken = list(map(sub, a, known))
                missed = list(map(sub, gap, before))
                B = secant(B, taken, missed)
                descent = broyden(descent, taken, missed)
                known = a
            elif due:
                length = 1e-4 * max(abs(lower_end.displacement), size * abs(lower_end.velocity))
                S = self._measure(lower, time, size, a, r_lower, length)
                lower.rewind()
                lower_end = lower.advance(time, size, acting)
                descent = _descent(B, S)
                measured = True
                due = False
            else:
                descent = broyden(descent, step, residual)
            goal, step, better = self.aim(gap, a, descent, size, start)
            residual = gap if goal is None else list(map(sub, gap, goal))
            norm = max(map(abs, residual))
        else:
            raise NotConverged(norm, _MAX_ITERATIONS)
        if _log.isEnabledFor(logging.DEBUG):
            said = "t = %.9g s, H = %.3g s: contact force found in %d iterations, residual %.2g m, %.2g m allowed"
            _log.debug(said, time, size, iteration, norm, enough)
        # Not of the forces tried on the way, which may have thrown the ends as far as they liked.
        u = upper_end[0]
        y = lower_end[0]
        state = self.state
        state.reach = max(state.reach, u, -u, y, -y)
        if lower.mass == inf:
            descent, measured = remembered[1:]
        state.of_size.pop(size, None)
        state.of_size[size] = (B, descent, measured)
        if len(state.of_size) > SIZES_REMEMBERED:  # the one that was used least recently is forgotten
            del state.of_size[next(iter(state.of_size))]
        return made_of(Step, (time, size, acting, NO_FORCE, start, (upper_end, lower_end)))

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

    def _absolute_tolerance(self, start: Motion, end: Motion, size: float, by_force: Vector, *, late: bool) -> float:
        """Return the tolerance [m].

        ``start`` is the upper body's motion, ``end`` the lower one's; ``late`` says whether it allows for the rounding
        of bodies.
        """
        u, v, _, _ = start
        y, z, _, _ = end
        forced = max(map(abs, by_force))
        change = max(size * max(v, -v, z, -z), abs(y - u))
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
