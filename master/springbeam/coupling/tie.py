"""Find the contact force that satisfies a scheme's conditions over one step.

Unknowns are the Legendre coefficients a of C; residuals are the conditions of the gap, in metres. The beam is linear:
its conditions are affine in a with a matrix that depends on H alone, which is measured once per H and remembered.
The spring's matrix starts as that of a free mass and follows by Broyden's rank-one updates, so a step usually costs two
beam steps and two or three spring steps.
"""

from __future__ import annotations

import numpy as np

from ..subsystem import Body, Force, Motion, StepRefused
from . import Conditions, force

_MAX_ITERATIONS = 20
_EPS = float(np.finfo(float).eps)
#: Where the iteration stops to converge within this factor of the tolerance it has met the bodies' own rounding.
_NOISE = 1e3
#: A guess fitted over a step is extrapolated over at most this many times its size; beyond, its end value is held.
_REACH_OF_GUESS = 4.0


class NotConverged(StepRefused):
    """The conditions could not be met."""

    def __init__(self, residual: float, iterations: int) -> None:
        super().__init__(f"contact force not found after {iterations} iterations, gap condition {residual:.3g} m")
        self.residual = residual


class Tie:
    """Solver for one scheme; keeps the response matrices between steps.

    Parameters
    ----------
    conditions
        The scheme's conditions, see `springbeam.coupling.conditions`.
    degree
        Degree of the contact force.
    tolerance
        Of the conditions, relative to the motion over the step, the larger of H·max(|u̇|, |ẏ|) and |Δu|.
    regular_size
        The macro step: only its response matrices are worth keeping.
    """

    def __init__(self, conditions: Conditions, degree: int, tolerance: float, regular_size: float) -> None:
        self._conditions = conditions
        self._degree = degree
        self._tolerance = tolerance
        self._regular_size = regular_size
        self._beam_matrix: dict[float, np.ndarray] = {}
        self._partner_matrix: dict[type, np.ndarray] = {}
        self._last_size = 0.0
        self._reach = 0.0  #: largest displacement of an end so far [m]
        self.iterations = 0  #: Newton updates since the start

    def solve(self, beam: Body, partner: Body, time: float, size: float, guess: Force, start: Motion) -> Force:
        """Advance both bodies from their marks by ``size`` [s] so that the conditions hold.

        ``guess`` is the contact force as far as known, ``start`` the beam's motion at the mark. Returns the contact
        force. Raises NotConverged (with the residual [m]) or StepRefused.
        """
        if size > _REACH_OF_GUESS * self._last_size:
            guess = (guess[0], 0.0, 0.0)
        a = force.legendre(guess, size, self._degree)
        r_beam = self._advance(beam, time, size, a)
        beam_end = beam.motion()
        B = self._beam_matrix.get(size)
        at_beam: np.ndarray | None = a
        if B is None:
            B, at_beam = self._measure(beam, time, size, a, r_beam, beam_end, 1.0), None
            if size == self._regular_size:
                self._beam_matrix[size] = B
        r_partner = self._advance(partner, time, size, a)
        S = self._partner_response(partner, size)
        tolerance = self._absolute_tolerance(start, beam_end, partner.motion(), size, B @ a)
        residual = r_beam - r_partner
        norm = float(np.abs(residual).max())
        measured = False
        noise = 1.0
        for iteration in range(_MAX_ITERATIONS):
            if not norm < float("inf"):
                raise NotConverged(norm, iteration)
            if norm <= noise * tolerance:
                if at_beam is a:
                    break
                r_beam, at_beam = self._advance(beam, time, size, a), a  # in place of the affine prediction
                # A bad guess moves the bodies far: what counts is the motion under the force found.
                tolerance = self._absolute_tolerance(start, beam.motion(), partner.motion(), size, B @ a)
            else:
                self.iterations += 1
                try:
                    step = np.linalg.solve(B - S, -residual)
                except np.linalg.LinAlgError:
                    raise NotConverged(norm, iteration) from None
                a = a + step
                r_beam = r_beam + B @ step
                r_new = self._advance(partner, time, size, a)
                S = S + np.outer(r_new - r_partner - S @ step, step) / (step @ step)
                r_partner = r_new
            residual = r_beam - r_partner
            previous, norm = norm, float(np.abs(residual).max())
            if norm > noise * tolerance and norm > 0.3 * previous:
                if not measured:
                    S = self._measure(partner, time, size, a, r_partner, partner.motion(), 1e-4)
                    self._advance(partner, time, size, a)
                    measured = True
                elif norm <= _NOISE * tolerance:  # the bodies' own rounding: nothing left to gain
                    noise = _NOISE
        else:
            raise NotConverged(norm, _MAX_ITERATIONS)
        self._last_size = size
        if size == self._regular_size:
            self._partner_matrix[type(partner)] = S
        return force.derivatives(a, size)

    def _advance(self, body: Body, time: float, size: float, a: np.ndarray) -> np.ndarray:
        body.rewind()
        body.advance(time, size, force.derivatives(a, size))
        return np.array(self._conditions(body.motion(), size))

    def _partner_response(self, partner: Body, size: float) -> np.ndarray:
        if size == self._regular_size and type(partner) in self._partner_matrix:
            return self._partner_matrix[type(partner)]
        if partner.mass == float("inf"):
            return np.zeros((self._degree + 1, self._degree + 1))
        unit = force.free_mass_response(self._degree, size, partner.mass)
        return np.column_stack([self._conditions(m, size) for m in unit])

    def _measure(
        self, body: Body, time: float, size: float, a: np.ndarray, r: np.ndarray, end: Motion, fraction: float
    ) -> np.ndarray:
        """Columns ∂conditions/∂a_k by differences about ``a``, where they are ``r`` and the motion ends at ``end``.

        The difference would move a free mass by ``fraction`` of the motion; it is exact where the body is linear.
        """
        length = max(abs(end.displacement), size * abs(end.velocity), 1e-150)
        delta = fraction * 2.0 * body.mass * length / (size * size)
        columns = []
        for k in range(len(a)):
            changed = a.copy()
            changed[k] += delta
            columns.append((self._advance(body, time, size, changed) - r) / delta)
        return np.column_stack(columns)

    def _absolute_tolerance(
        self, start: Motion, beam: Motion, partner: Motion, size: float, by_force: np.ndarray
    ) -> float:
        speed = max(abs(start.velocity), abs(beam.velocity), abs(partner.velocity))
        change = max(size * speed, abs(beam.displacement - start.displacement))
        self._reach = max(self._reach, abs(start.displacement), abs(beam.displacement), abs(partner.displacement))
        # The end is a sum of modes as large as it has ever been, and of what the force does; both are rounded.
        rounding = 16.0 * _EPS * max(self._reach, float(np.abs(by_force).max()))
        return max(self._tolerance * change, rounding)
