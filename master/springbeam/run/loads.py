"""The loads of a run: over each step a polynomial of degree 2 in time, the projection of the signal in L².

The projection errs by something orthogonal to all polynomials of degree 2, which a body's motion hardly sees: a load
costs displacements and velocities at the ends of steps an error of order 6 (``docs/coupling.md``, "Loads"). Where a
signal jumps or bends, a step ends. Nothing here is shared with the references, which sample the signal itself.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from math import cos, inf, pi, sin

import numpy as np

from ..bodies import force
from ..bodies.protocol import NO_FORCE, Body, Force
from ..scene import Load, Scene
from ..scene.loads import LINES_IN_STEP

#: Which loads act on which body.
ON_BEAM, ON_SPRING = ("beam", "tip", "base"), ("spring", "base")
#: Points of a quadrature, and one more for each radian that a signal without a closed form turns.
_POINTS = 8
#: A jump closer to an end of a step than this share of it is at that end.
_SAME = 1e-9
#: Gauss–Legendre nodes on [−1, 1], and (2k + 1)/2 P_k there times the weights: exact for a cubic times P_2.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)
_VALUES = np.polynomial.legendre.legvander(_NODES, 2)
_NORMS = np.array([0.5, 1.5, 2.5])


@lru_cache(maxsize=64)
def _quadrature(points: int) -> tuple[np.ndarray, np.ndarray]:
    """Return Gauss nodes in [−1, 1], and what takes values there to the three Legendre coefficients."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    return nodes, _NORMS[:, None] * np.polynomial.legendre.legvander(nodes, 2).T * weights


class Signal:
    """One load over the steps of a run."""

    def __init__(self, load: Load) -> None:
        self._load = load
        self._end = load.end
        #: When the load jumps or bends and a step ends [s].
        self.kinks = load.kinks
        #: Lines of a table [s], which is a polynomial between them.
        self._lines = load.start + load.record.x if load.signal == "table" else None

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
        if time >= self._end:
            return NO_FORCE
        if self._lines is not None:
            return force.derivatives(self._of_table(self._lines, time, size), size)
        same = _SAME * size
        cuts = [time, *(kink for kink in self.kinks if time + same < kink < time + size - same), time + size]
        if len(cuts) == 2:
            return force.derivatives(self._legendre(time, size), size)
        total = np.zeros(3)
        for a, b in pairwise(cuts):
            values = _VALUES @ self._legendre(a, b - a)
            s = (2.0 * a + (b - a) * (_NODES + 1.0) - 2.0 * time) / size - 1.0
            total += (b - a) / size * (_WEIGHTS * values) @ np.polynomial.legendre.legvander(s, 2)
        return force.derivatives((_NORMS * total).tolist(), size)

    def _legendre(self, start: float, size: float) -> Sequence[float]:
        """Return the three Legendre coefficients over a piece without a jump inside."""
        load, middle = self._load, start + 0.5 * size
        elapsed = middle - load.start
        if load.signal != "constant" and not load.start <= middle < self._end:
            return (0.0, 0.0, 0.0)
        if load.signal == "harmonic":
            return _wave(load.amplitude, load.rate, elapsed, load.phase, size)
        if load.signal == "half_sine":
            assert load.duration is not None
            return _wave(load.amplitude, pi / load.duration, elapsed, 0.0, size)
        if load.signal in ("constant", "step") or (load.signal == "ramp" and elapsed >= (load.duration or 0.0)):
            return (float(load.value(middle)), 0.0, 0.0)
        nodes, projection = _quadrature(_POINTS + int(load.rate * size))
        return list(projection @ load.value(middle + 0.5 * size * nodes))

    def _of_table(self, lines: np.ndarray, start: float, size: float) -> Sequence[float]:
        """Return the coefficients by the pieces between ``lines`` [s], each a polynomial of degree 3 at most."""
        first, last = np.searchsorted(lines, (start, start + size), side="right")
        edges = np.concatenate([[start], lines[first:last], [start + size]])
        half = 0.5 * np.diff(edges)[:, None]
        t = edges[:-1, None] + half * (_NODES + 1.0)
        weights = half * _WEIGHTS * self._load.value(t)
        polynomials = np.polynomial.legendre.legvander((2.0 * (t - start) / size - 1.0).ravel(), 2)
        return list(2.0 / size * _NORMS * (weights.ravel() @ polynomials))


def _wave(amplitude: float, omega: float, elapsed: float, phase: float, size: float) -> Sequence[float]:
    """Return the coefficients of a sine: ∫ P_k(s) e^{iθs} ds = 2 i^k j_k(θ) over [−1, 1], θ = ωH/2."""
    angle = omega * elapsed + phase
    j0, j1, j2 = _bessel(0.5 * omega * size)
    return (amplitude * j0 * sin(angle), 3.0 * amplitude * j1 * cos(angle), -5.0 * amplitude * j2 * sin(angle))


@lru_cache(maxsize=256)
def _bessel(theta: float) -> tuple[float, float, float]:
    from scipy.special import spherical_jn  # takes a tenth of a second to load: only for who has a sine

    return tuple(spherical_jn([0, 1, 2], theta).tolist())


class Loads:
    """The loads of a scene, handed to its bodies step by step.

    Parameters
    ----------
    scene
        Whose loads act.
    beam, spring
        The bodies; ``None`` where the scene has none.
    """

    def __init__(self, scene: Scene, beam: Body | None, spring: Body | None) -> None:
        self._signals = [Signal(load) for load in scene.loads]
        self._end = scene.time.t_end
        self._kinked = [signal for signal in self._signals if signal.kinks]
        self._bodies: list[tuple[Body, list[int]]] = []
        self._last = (-1.0, 0.0)
        for body, places in ((beam, ON_BEAM), (spring, ON_SPRING)):
            taken = [i for i, load in enumerate(scene.loads) if load.on in places]
            if body is not None and taken:
                body.expect_loads([scene.loads[i] for i in taken])
                self._bodies.append((body, taken))
        self.any = bool(self._bodies)

    def act(self, time: float, size: float) -> None:
        """Let the loads act on every step from ``time`` by ``size`` [s], until told otherwise."""
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
