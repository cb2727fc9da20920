"""Find the contact force that satisfies a scheme's conditions over one step.

Unknowns are the Legendre coefficients a of C; residuals are the conditions of the gap, in metres. The beam is linear:
its conditions are affine in a with a matrix that depends on H alone, which is measured once per H and remembered.
The spring's matrix starts as that of a free mass, is measured when a size comes again, and follows by Broyden's
rank-one updates, so a step usually costs two beam steps and two spring steps.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import inf
from operator import add, mul, sub

import numpy as np

from ..bodies import force
from ..bodies.memory import Memory
from ..bodies.protocol import Body, Force, Motion, StepRefused
from . import Conditions

_MAX_ITERATIONS = 20
#: Of a sum of modes, relative to the largest it has been.
_ROUNDING = 16.0 * float(np.finfo(float).eps)
#: Where the iteration stops to converge within this factor of the tolerance it has met the bodies' own rounding.
_NOISE = 1e3

#: Step sizes whose responses are remembered: the macro step's, and some of steps cut by events.
SIZES_REMEMBERED = 64

Vector = list[float]
Matrix = list[list[float]]


class NotConverged(StepRefused):
    """The conditions could not be met."""

    def __init__(self, residual: float, iterations: int) -> None:
        super().__init__(f"contact force not found after {iterations} iterations, gap condition {residual:.3g} m")
        self.residual = residual


class Tie(Memory):
    """Solver for one scheme; keeps the response matrices between steps.

    Vectors and matrices of its 1 to 3 unknowns are lists of floats: numpy's overhead would be most of a step's time.

    Parameters
    ----------
    conditions
        The scheme's conditions, see `springbeam.coupling.conditions`.
    degree
        Degree of the contact force.
    tolerance
        Of the conditions, relative to the motion over the step, the larger of H·max(|u̇|, |ẏ|) and |Δu|.
    expected
        A displacement that is to be expected [m]: modes whose sum, the tip, is held at 0 are as large.
    """

    REMEMBERED = ("_responses", "_last_size", "_reach", "iterations")

    def __init__(self, conditions: Conditions, degree: int, tolerance: float, expected: float = 0.0) -> None:
        self._conditions = conditions
        self._degree = degree
        self._tolerance = tolerance
        #: By the size of the step: B, and by kind of partner −(B − S)⁻¹ and whether S was measured.
        self._responses: dict[float, tuple[Matrix, dict[str, tuple[Matrix, bool]]]] = {}
        self._last_size = 0.0
        self._reach = 0.0  #: largest displacement of an end under a force found [m]
        self._expected = expected
        self.iterations = 0  #: Newton updates since the start

    def solve(self, beam: Body, partner: Body, time: float, size: float, guess: Force, start: Motion) -> Force:
        """Advance both bodies from their marks by ``size`` [s] so that the conditions hold.

        ``guess`` is the contact force as far as known, ``start`` the beam's motion at the mark. Returns the contact
        force. Raises NotConverged (with the residual [m]) or StepRefused.
        """
        a = force.legendre(guess, size, self._degree)
        acting = force.derivatives(a, size)
        conditions = self._conditions
        beam.rewind()
        beam_end = beam.advance(time, size, acting)
        r_beam: Sequence[float] = conditions(beam_end, size)
        at_beam: Vector | None = a
        known = self._responses.get(size)
        if known is None:
            at_beam = None
            length = max(self._expected, abs(beam_end.displacement), size * abs(beam_end.velocity))
            known = self._measure(beam, time, size, a, r_beam, length), {}
        if size != self._last_size:
            self._responses.pop(size, None)
            self._responses[size] = known  # the last one used comes last
            if len(self._responses) > SIZES_REMEMBERED:
                del self._responses[next(iter(self._responses))]
        B, descents = known
        kind = type(partner).__name__
        first = kind not in descents
        descent, measured = descents.get(kind) or (_descent(B, self._free_response(partner, size)), False)
        partner.rewind()
        partner_end = partner.advance(time, size, acting)
        r_partner = conditions(partner_end, size)
        # Rounding at least. What is asked is known once the motion is; that under the guess may be far from it.
        tolerance = enough = _ROUNDING * max(self._reach, abs(start.displacement))
        residual = list(map(sub, r_beam, r_partner))
        norm = max(map(abs, residual))
        fresh = False
        noise, unseen = 1.0, 0.0
        for iteration in range(_MAX_ITERATIONS):
            if not norm < inf:
                raise NotConverged(norm, iteration)
            previous = norm
            if norm <= enough:
                if at_beam is a:
                    break
                beam.rewind()
                beam_end, at_beam = beam.advance(time, size, acting), a
                r_beam = conditions(beam_end, size)  # in place of the affine prediction
                residual = list(map(sub, r_beam, r_partner))
                norm = max(map(abs, residual))
            else:
                self.iterations += 1
                step = _times(descent, residual)
                a = list(map(add, a, step))
                acting = force.derivatives(a, size)
                r_beam = list(map(add, r_beam, _times(B, step)))
                partner.rewind()
                partner_end = partner.advance(time, size, acting)
                r_partner = conditions(partner_end, size)
                tolerance = self._absolute_tolerance(start, partner_end, size, _times(B, a))
                enough = max(noise * tolerance, unseen)
                residual = list(map(sub, r_beam, r_partner))
                norm = max(map(abs, residual))
                if norm > enough:  # below, the difference is rounding and would spoil what is known
                    descent = _broyden(descent, step, residual)
            if norm > enough:
                stagnates = norm > 0.3 * previous
                # Of a size that comes again S is measured once: it then saves a step of the partner in most.
                if (stagnates and not fresh) or not (first or measured):
                    length = 1e-4 * max(abs(partner_end.displacement), size * abs(partner_end.velocity))
                    S = self._measure(partner, time, size, a, r_partner, length)
                    partner.rewind()
                    partner.advance(time, size, acting)
                    descent, measured, fresh = _descent(B, S), True, True
                elif stagnates and norm <= max(_NOISE * tolerance, _ROUNDING * self._expected):
                    # The bodies' own rounding: nothing left to gain.
                    noise, unseen = _NOISE, _ROUNDING * self._expected
                    enough = max(noise * tolerance, unseen)
        else:
            raise NotConverged(norm, _MAX_ITERATIONS)
        self._last_size = size
        # Not of the forces tried on the way, which may have thrown the ends as far as they liked.
        self._reach = max(self._reach, abs(beam_end.displacement), abs(partner_end.displacement))
        descents[kind] = (descent, measured)
        return acting

    def _free_response(self, partner: Body, size: float) -> Matrix:
        if partner.mass == inf:
            return [[0.0] * (self._degree + 1)] * (self._degree + 1)
        unit = force.free_mass_response(self._degree, size, partner.mass)
        return _transposed([self._conditions(m, size) for m in unit])

    def _measure(self, body: Body, time: float, size: float, a: Vector, r: Sequence[float], length: float) -> Matrix:
        """Columns ∂conditions/∂a_k by differences about ``a``, where they are ``r``.

        The difference would move a free mass by ``length`` [m]; it is exact where the body is linear, as the massless
        beam is.
        """
        delta = 2.0 * body.mass * max(length, 1e-150) / (size * size) or 1.0
        columns = []
        for k in range(len(a)):
            changed = a.copy()
            changed[k] += delta
            body.rewind()
            r_changed = self._conditions(body.advance(time, size, force.derivatives(changed, size)), size)
            columns.append([(x - y) / delta for x, y in zip(r_changed, r, strict=True)])
        return _transposed(columns)

    def _absolute_tolerance(self, start: Motion, end: Motion, size: float, by_force: Vector) -> float:
        """Of the conditions [m]; ``start`` is the beam's motion, ``end`` the partner's, which the tip goes to."""
        (u, v, _, _), (y, z, _, _) = start, end
        change = max(size * max(abs(v), abs(z)), abs(y - u))
        # The end is a sum of modes as large as it has ever been, and of what the force does; both are rounded.
        rounding = _ROUNDING * max(self._reach, abs(u), abs(y), *map(abs, by_force))
        return max(self._tolerance * change, rounding)


def _times(A: Matrix, x: Vector) -> Vector:
    if len(x) == 1:
        return [A[0][0] * x[0]]
    return [sum(map(mul, row, x)) for row in A]


def _transposed(rows: Iterable[Iterable[float]]) -> Matrix:
    return [list(column) for column in zip(*rows, strict=True)]


def _descent(B: Matrix, S: Matrix) -> Matrix:
    """−(B − S)⁻¹, from residuals to Newton's steps. Raises NotConverged if there is none."""
    try:
        descent: Matrix = np.linalg.inv(np.subtract(S, B)).tolist()
    except np.linalg.LinAlgError:
        raise NotConverged(float("nan"), 0) from None
    return descent


def _broyden(descent: Matrix, step: Vector, residual: Vector) -> Matrix:
    """Broyden's rank-one update of D = −J⁻¹, J the Jacobian, after ``step``, which was to leave no residual.

    D + d (sᵀD) / (sᵀ(s − d)) with d = D r: Broyden (1965), in the form of Sherman and Morrison.
    """
    d = _times(descent, residual)
    denominator = sum(s * (s - x) for s, x in zip(step, d, strict=True))
    if denominator == 0.0:
        return descent
    row = [sum(map(mul, step, column)) / denominator for column in zip(*descent, strict=True)]
    return [[x + y * z for x, z in zip(line, row, strict=True)] for line, y in zip(descent, d, strict=True)]
