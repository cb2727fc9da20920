"""Where in a segment the first event lies: zeros of the functions that a phase is watched by, located to rounding."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from .exponential import Segment
from .hybrid_system import HybridSystem
from .laws import Phase, Watch


class EventLocator:
    """Watches one phase from its start on.

    A function that starts at zero, as after its own event, is watched from where it first exceeds rounding.
    """

    def __init__(self, system: HybridSystem, phase: Phase, watched: Iterable[Watch]) -> None:
        self._system, self._phase, self._watched = system, phase, list(watched)
        self._armed: set[str] = set()  #: names of the functions that have exceeded rounding

    def first(self, segment: Segment) -> tuple[Watch, float] | None:
        """Return the earliest event in a segment and when, after its start [s]; ``None`` if there is none."""
        motion = self._system.motion(self._phase, segment.states)
        first: tuple[Watch, float] | None = None
        for watch in self._watched:
            tau = self._crossing(segment, watch, watch.function(motion))
            if tau is not None and (first is None or tau < first[1]):
                first = (watch, tau)
        return first

    def _crossing(self, segment: Segment, watch: Watch, values: np.ndarray) -> float | None:
        noise = self._system.noise(watch.unit, segment.states[0])

        def g(tau: float) -> float:
            return float(watch.function(self._system.motion(self._phase, segment.state(tau))))

        for k in range(len(values)):
            if watch.name not in self._armed:
                if values[k] > noise:
                    self._armed.add(watch.name)
                elif values[k] < -noise and k > 0:
                    return _early_crossing(g, segment.nodes[k], noise)
            elif values[k] < 0.0:
                low, high = segment.nodes[k - 1], segment.nodes[k]
                if k == 0 or g(low) <= 0.0:
                    return float(low if k > 0 else 0.0)
                if k == len(values) - 1 and values[k] >= -noise:
                    return float(high)
                return _root(g, low, high)
            elif 0 < k < len(values) - 1:
                bottom = _dip(g, segment.nodes[k - 1 : k + 2], values[k - 1 : k + 2], noise)
                if bottom is not None:
                    return _root(g, segment.nodes[k - 1], bottom)
        return None


def _dip(g: Callable[[float], float], nodes: np.ndarray, values: np.ndarray, noise: float) -> float | None:
    """Return where ``g`` is lowest if it dips below zero between three nodes at which it is not; else ``None``.

    The parabola through them tells whether to look: it misses a smooth minimum by less than it varies.
    """
    (x0, x1, x2), (g0, g1, g2) = nodes.tolist(), values.tolist()
    left, right = (g1 - g0) / (x1 - x0), (g2 - g1) / (x2 - x1)
    curvature = (right - left) / (x2 - x0)
    if min(g0, g1, g2) < 0.0 or curvature <= 0.0:
        return None
    turn = 0.5 * (x0 + x1 - left / curvature)
    bottom = g0 + (turn - x0) * (left + (turn - x1) * curvature)
    if not x0 < turn < x2 or bottom > max(g0, g1, g2) - min(g0, g1, g2):
        return None
    found = minimize_scalar(g, bounds=(x0, x2), method="bounded", options={"xatol": 1e-9 * (x2 - x0)})
    return float(found.x) if found.fun < -noise else None


def _root(g: Callable[[float], float], low: float, high: float) -> float:
    if g(high) >= 0.0:  # the dense output and the exact state differ by less than either's error
        return float(high)
    # A root at a segment's very start needs no more than the rounding of the segment.
    return float(brentq(g, low, high, xtol=1e-16 * high, rtol=8.9e-16, maxiter=200))


def _early_crossing(g: Callable[[float], float], first: float, noise: float) -> float:
    """Return where a function falls to zero that starts there, is positive, and is negative at the first node."""
    high = first
    for _ in range(60):
        low = 0.5 * high
        value = g(low)
        if value > noise:
            return _root(g, low, high)
        if abs(value) <= noise:
            return 0.0
        high = low
    return 0.0
