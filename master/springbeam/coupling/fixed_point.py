"""Displacement-driven exchange for the tie: the spring is moved to where the tip went, and returns the force it takes.

The tie's condition is that of `energy` at degree 0, g(H) = 0, with a force constant over the step. It is found by the
fixed-point iteration that partitioned fluid–structure codes use: C moves the beam, the beam's tip moves the spring,
the spring answers with the force C' that this takes. One round multiplies an error of C by −(gain),

    gain = (∂u/∂C) / |∂y/∂C| = (H/Z) / (H²/2m) = 2m/(ZH),

where H is shorter than the beam's waves take to come back, Z = √(KAG·ρA) the impedance of its tip; in the limit H → 0
it is m/m_tip. The shorter the step the worse: this is the added-mass instability (Causin, Gerbeau & Nobile 2005), and
the reason why `tie` does it otherwise. Aitken's relaxation (Küttler & Wall 2008) takes it out: of one unknown it is
the secant method.
"""

from __future__ import annotations

from ..memory import Memory
from ..subsystem import Body, Force, Motion, StepRefused
from .tie import NotConverged

_MAX_ITERATIONS = 200
_MAX_INNER = 30
#: Growth of the correction at which plain iteration is given up.
_HOPELESS = 1e6
_EPS = float(2.0**-52)


class Diverged(NotConverged):
    """The exchange does not converge, and would do worse with a shorter step."""

    def __init__(self, gap: float, iterations: int, gain: float) -> None:
        NotConverged.__init__(self, gap, iterations)
        how = "diverges" if abs(gain) > 1.0 else "does not converge"
        self.args = (
            f"the displacement-driven exchange {how}: after {iterations} iterations the gap is {gap:.3g} m, each round "
            f"multiplies the error of the contact force by {gain:.3g}, more where the step is shorter; use "
            'coupling.scheme = "energy"' + (', or "aitken"' if abs(gain) > 1.0 else ""),
        )


class FixedPoint(Memory):
    """Solver for the constant contact force of a step, with the same arguments and result as `Tie`.

    Parameters
    ----------
    aitken
        Whether the corrections are relaxed; if not, C' is taken as it comes.
    tolerance
        Of the gap, relative to the motion over the step, the larger of H·max(|u̇|, |ẏ|) and |Δu|.
    """

    REMEMBERED = ("iterations", "gain")

    def __init__(self, aitken: bool, tolerance: float) -> None:
        self._aitken, self._tolerance = aitken, tolerance
        self.iterations = 0  #: rounds since the start
        self.gain = 0.0  #: of the last two rounds: −dC'/dC

    def solve(self, beam: Body, partner: Body, time: float, size: float, guess: Force, start: Motion) -> Force:
        """Advance both bodies from their marks by ``size`` [s] so that they end together; see `Tie.solve`.

        Raises Diverged (with the gap [m]), NotConverged or StepRefused.
        """
        c = guess[0]
        response = 0.5 * size * size / partner.mass  # of −y to C, as of a free mass; the secant below corrects it
        relaxation, first = 1.0, 0.0
        previous: tuple[float, float] | None = None
        gap = 0.0
        for iteration in range(_MAX_ITERATIONS):
            try:
                u = _advanced(beam, time, size, c)
                y = _advanced(partner, time, size, c)
            except StepRefused as refused:
                if iteration < 2:
                    raise
                raise Diverged(abs(gap), iteration, self.gain) from refused  # thrown out of its reach
            gap = u.displacement - y.displacement
            change = max(size * max(abs(start.velocity), abs(u.velocity), abs(y.velocity)),
                         abs(u.displacement - start.displacement))  # fmt: skip
            rounding = 16.0 * _EPS * max(abs(start.displacement), abs(u.displacement), abs(y.displacement))
            tolerance = max(self._tolerance * change, rounding)
            if abs(gap) <= tolerance:
                return (c, 0.0, 0.0)
            self.iterations += 1
            answer, response = self._force_to(partner, time, size, c, y, u.displacement, response, tolerance)
            correction = answer - c
            if previous is not None and c != previous[0]:
                slope = (correction - previous[1]) / (c - previous[0])
                self.gain = -1.0 - slope
                if self._aitken and slope != 0.0:
                    relaxation = -1.0 / slope
            if not abs(correction) < _HOPELESS * (first or abs(correction)) or not abs(gap) < float("inf"):
                raise Diverged(abs(gap), iteration + 1, self.gain)
            first = first or abs(correction)
            previous = (c, correction)
            c += relaxation * correction
        raise Diverged(abs(gap), _MAX_ITERATIONS, self.gain)

    def _force_to(
        self,
        partner: Body,
        time: float,
        size: float,
        c: float,
        y: Motion,
        goal: float,
        response: float,
        tolerance: float,
    ) -> tuple[float, float]:
        """The constant force with which ``partner`` ends at ``goal`` [m], by secants from (c, y), and its response."""
        w = y.displacement
        for _ in range(_MAX_INNER):
            if abs(w - goal) <= 1e-2 * tolerance:
                return c, response
            new = c + (w - goal) / response
            if new == c:
                return c, response
            moved = _advanced(partner, time, size, new).displacement
            if moved != w:
                response = (w - moved) / (new - c)
            c, w = new, moved
        if abs(w - goal) <= tolerance:
            return c, response
        raise NotConverged(abs(w - goal), _MAX_INNER)


def _advanced(body: Body, time: float, size: float, c: float) -> Motion:
    body.rewind()
    return body.advance(time, size, (c, 0.0, 0.0))
