"""The loads of a run: over each step a polynomial of degree 2 in time, the projection of the signal in L².

The projection errs by something orthogonal to all polynomials of degree 2, which a body's motion hardly sees: a load
costs displacements and velocities at the ends of steps an error of order 6 (``docs/coupling.md``, "Loads"). Where a
signal jumps or bends, a step ends. Nothing here is shared with the references, which sample the signal itself.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from functools import lru_cache
from math import cos, inf, sin

import numpy as np

from ..bodies import force
from ..bodies.protocol import NO_FORCE, Body, Force
from ..scene.loads import LINES_IN_STEP, ConstantLoad, Load, StepLoad, TableLoad
from .setup import SAME

#: Where loads act that move the upper body.
ON_BEAM = ("beam", "tip", "base")
#: Where loads act that move the lower body.
ON_SPRING = ("spring", "base")
#: Points of the quadrature of a table, whose pieces are cubic at most.
_OF_TABLE = 3
#: Points of the quadrature of another signal, which has one more for each radian that it turns.
_POINTS = 8
#: (2k + 1)/2, by which a moment against P_k on [−1, 1] becomes the coefficient of P_k.
_NORMS = np.array([0.5, 1.5, 2.5])


class Signal:
    """One load over the steps of a run."""

    def __init__(self, load: Load) -> None:
        self._load = load
        self._begins = load.begins
        self._end = load.end
        #: When the load jumps or bends and a step ends [s].
        self.kinks = load.kinks
        #: Times [s] between which it is smooth: of a table the polynomial between two lines.
        self._edges = load.edges

    def next_kink(self, time: float, size: float) -> float:
        """Return when it next jumps or bends after ``time`` [s] in a way that is worth the end of a step; ∞ if not.

        Lines of a table of which `LINES_IN_STEP` or more lie in a step of ``size`` [s] are data, and no kinks: the step
        has their projection. But where the table begins and ends the load jumps.
        """
        kinks = self.kinks
        index = bisect_right(kinks, time)
        if 0 < index < len(kinks) - LINES_IN_STEP and kinks[index + LINES_IN_STEP - 1] < time + size:
            return kinks[-1]
        return kinks[index] if index < len(kinks) else inf

    def over(self, time: float, size: float) -> Force:
        """Return the projection onto a step of ``size`` [s] from ``time`` [s] on."""
        load = self._load
        middle = time + 0.5 * size
        same = SAME * size
        if time >= self._end:
            return NO_FORCE
        cuts = self._edges[bisect_right(self._edges, time + same) : bisect_left(self._edges, time + size - same)]
        if load.wave is not None and not cuts:
            if not self._begins <= middle < self._end:
                return NO_FORCE
            omega, phase = load.wave
            return force.derivatives(_wave(load.amplitude, omega, middle - load.since, phase, size), size)
        if isinstance(load, ConstantLoad | StepLoad) and not cuts:
            return (float(load.value(middle)), 0.0, 0.0)
        points = _OF_TABLE if isinstance(load, TableLoad) else _POINTS + int(load.rate * size)
        s, weights = force.quadrature(time, size, cuts, points)
        weighted = weights * load.value(time + 0.5 * size * (s + 1.0))
        moments = weighted.ravel() @ np.polynomial.legendre.legvander(s.ravel(), 2)
        return force.derivatives((_NORMS * moments).tolist(), size)


def _wave(amplitude: float, omega: float, elapsed: float, phase: float, size: float) -> Sequence[float]:
    """Return the coefficients of a sine: ∫ P_k(s) e^{iθs} ds = 2 i^k j_k(θ) over [−1, 1], θ = ωH/2."""
    angle = omega * elapsed + phase
    j0, j1, j2 = _bessel(0.5 * omega * size)
    return (amplitude * j0 * sin(angle), 3.0 * amplitude * j1 * cos(angle), -5.0 * amplitude * j2 * sin(angle))


@lru_cache(maxsize=256)
def _bessel(theta: float) -> tuple[float, float, float]:
    from scipy.special import spherical_jn  # takes a tenth of a second to load: only for a sine

    return tuple(spherical_jn([0, 1, 2], theta).tolist())


class Loads:
    """The loads of a scene, set on its bodies for each step.

    Parameters
    ----------
    loads
        Those of the scene.
    end
        When the run ends [s].
    upper, lower
        The bodies.
    """

    def __init__(self, loads: Sequence[Load], end: float, upper: Body, lower: Body) -> None:
        self._signals = [Signal(load) for load in loads]
        self._end = end
        self._kinked = [signal for signal in self._signals if signal.kinks]
        self._bodies: list[tuple[Body, list[int]]] = []
        self._last = (-1.0, 0.0)
        for body, places in ((upper, ON_BEAM), (lower, ON_SPRING)):
            taken = [i for i, load in enumerate(loads) if load.on in places]
            if taken:
                body.expect_loads([loads[i] for i in taken])
                self._bodies.append((body, taken))
        self.any = bool(self._bodies)

    def act(self, time: float, size: float) -> None:
        """Let the loads act on every step from ``time`` by ``size`` [s], until others do."""
        if (time, size) != self._last:
            self._last = (time, size)
            forces = [signal.over(time, size) for signal in self._signals]
            for body, taken in self._bodies:
                body.set_loads([forces[i] for i in taken])

    def next_kink(self, time: float, size: float) -> float:
        """Return when a step of ``size`` [s] from ``time`` [s] on must end; ∞ if loads do not ask for it.

        A step ends where a load jumps or bends (`Signal.next_kink`) before the run does.
        """
        kink = min((signal.next_kink(time, size) for signal in self._kinked), default=inf)
        return kink if kink < self._end else inf
