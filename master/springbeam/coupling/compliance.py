"""Normal compliance by a discrete gradient: energy-exact at any step.

C = λ p₊^q with the penetration p = y − u_tip is the derivative of Φ(p) = λ p₊^{q+1}/(q+1). Held over a step at

    C = [Φ(p⁺) − Φ(p)] / (p⁺ − p),

its work on both bodies together, −C (p⁺ − p), is exactly −ΔΦ. (Ahn & Tate, (5), with the moving obstacle y.)
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from ..bodies.memory import Memory
from ..bodies.protocol import Body, Force, Motion
from .tie import SIZES_REMEMBERED, NotConverged

_MAX_ITERATIONS = 30
_EPS = float(np.finfo(float).eps)
_NODES, _WEIGHTS = (np.polynomial.legendre.leggauss(6)[0] + 1) / 2, np.polynomial.legendre.leggauss(6)[1] / 2


def compliance_force(p: float, stiffness: float, exponent: float) -> float:
    """λ p₊^q [N] for a penetration ``p`` [m]. Raises OverflowError where no double holds it."""
    return stiffness * p**exponent if p > 0.0 else 0.0


def compliance_energy(p: float, stiffness: float, exponent: float) -> float:
    """Φ(p) = λ p₊^{q+1}/(q+1) [J]. Raises OverflowError where no double holds it."""
    return stiffness * p ** (exponent + 1.0) / (exponent + 1.0) if p > 0.0 else 0.0


def discrete_gradient(p0: float, p1: float, stiffness: float, exponent: float) -> float:
    """[Φ(p1) − Φ(p0)]/(p1 − p0) [N], without cancellation as p1 → p0."""
    change, size = p1 - p0, max(abs(p0), abs(p1))
    if abs(change) > 0.1 * size:
        return (compliance_energy(p1, stiffness, exponent) - compliance_energy(p0, stiffness, exponent)) / change
    # One sign throughout: the quotient is the mean of λ p^q over the straight path.
    if size == 0.0 or p0 <= 0.0:
        return 0.0
    return stiffness * float(_WEIGHTS @ (p0 + change * _NODES) ** exponent)


def force_change(start: tuple[Motion, Motion], end: tuple[Motion, Motion], stiffness: float, exponent: float) -> float:
    """By how much the law's force differs between the ends of a step (tip, lower end) [N]; it was held on the step."""
    before, after = (
        compliance_force(low.displacement - tip.displacement, stiffness, exponent) for tip, low in (start, end)
    )
    return abs(after - before)


class Compliance(Memory):
    """Solver for the step's force; the response of p⁺ to C is remembered between steps.

    Parameters
    ----------
    stiffness, exponent
        λ_nc [N/m^q] and q ≥ 1.
    tolerance
        Relative tolerance of the force.
    """

    REMEMBERED = ("_responses", "iterations", "_scale")

    def __init__(self, stiffness: float, exponent: float, tolerance: float) -> None:
        self._law = (stiffness, exponent)
        self._tolerance = tolerance
        self._responses: dict[float, float] = {}  #: of p⁺ to C [m/N], by the size of the step
        self.iterations = 0
        self._scale = 0.0

    def solve(self, beam: Body, partner: Body, time: float, size: float, guess: Force, start: float) -> Force:
        """Advance both bodies from their marks by ``size`` [s] under the force of the law.

        ``start`` is the penetration p [m] at the mark. Returns the force, constant over the step.
        Raises NotConverged (residual in metres of penetration) or StepRefused.
        """
        c = guess[0]
        p = self._penetration(beam, partner, time, size, c)
        response = self._responses.pop(size, None)
        if response is None:
            # Response of two free masses; the secant below corrects it.
            response = 0.5 * size * size * (1.0 / beam.mass + 1.0 / partner.mass)
        residual = float("inf")
        for _ in range(_MAX_ITERATIONS):
            target = discrete_gradient(start, p, *self._law)
            error = abs(target - c)
            # The same mismatch as a displacement: what p can be told apart to bounds it from below.
            residual = error / (1.0 / response + self._tangent(start, p))
            if error <= self._tolerance * abs(target) or residual <= 16.0 * _EPS * self._scale:
                break
            self.iterations += 1
            new = self._model_root(start, p, c, response)
            if new == c:  # the model cannot tell C any better
                break
            p_new = self._penetration(beam, partner, time, size, new)
            measured = (p - p_new) / (new - c)
            if measured > 0.0 and abs(p - p_new) > 1e3 * _EPS * self._scale:
                response = measured
            c, p = new, p_new
        else:
            raise NotConverged(residual, _MAX_ITERATIONS)
        self._responses[size] = response  # the last one used comes last
        if len(self._responses) > SIZES_REMEMBERED:
            del self._responses[next(iter(self._responses))]
        return (c, 0.0, 0.0)

    def _penetration(self, beam: Body, partner: Body, time: float, size: float, c: float) -> float:
        ends: list[Motion] = []
        for body in (beam, partner):
            body.rewind()
            ends.append(body.advance(time, size, (c, 0.0, 0.0)))
        self._scale = max(abs(ends[0].displacement), abs(ends[1].displacement))
        return ends[1].displacement - ends[0].displacement

    def _tangent(self, start: float, p: float) -> float:
        """∂DG/∂p⁺ [N/m] by a difference."""
        delta = 1e-6 * max(abs(p), abs(start), self._scale * _EPS)
        return abs(discrete_gradient(start, p + delta, *self._law) - discrete_gradient(start, p, *self._law)) / delta

    def _model_root(self, start: float, p: float, c: float, response: float) -> float:
        """The C with C = DG(start, p − response·(C − c)): monotone, so bracketed by 0 and the force at C = 0."""

        def mismatch(force: float) -> float:
            return force - discrete_gradient(start, p - response * (force - c), *self._law)

        high = discrete_gradient(start, p + response * c, *self._law)
        if high <= 0.0:
            return 0.0
        # A force that moves the penetration by less than its rounding need not be told from zero.
        unseen = max(1e-3 * _EPS * self._scale / response, 1e-300)
        return float(brentq(mismatch, 0.0, high, xtol=unseen, rtol=4.0 * _EPS, maxiter=1000))
