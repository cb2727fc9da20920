"""Event functions, and where inside a step one of them vanishes.

An event function f is positive while nothing happens and falls through zero at the event. A step has f and ḟ at both
ends and two integrals of f; from these `springbeam.motion.curves` finds where to look, also for a contact that closes
and opens again inside the step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ..bodies.protocol import Ends
from ..motion.curves import EPS, Sample

_MAX_EVALUATIONS = 60


#: f of the ends (tip, lower end), positive while nothing happens, after a step of a size [s].
EventFunction = Callable[[Ends, float], Sample]


def gap(ends: Ends, size: float) -> Sample:
    """g = u_tip − y, or what lies below the tip instead of y."""
    (u, v, u_1, u_2), (y, z, y_1, y_2) = ends
    return u - y, v - z, u_1 - y_1, u_2 - y_2


@dataclass(frozen=True)
class Height:
    """Height of an end above a level, or below it; ``share`` is the tip's part in its rate."""

    end: int  #: 0: the tip, 1: the lower end
    level: float  #: [m]
    share: float
    sign: float = 1.0  #: −1: below

    def __call__(self, ends: Ends, size: float) -> Sample:
        sign = self.sign
        (_, v, _, _), (_, z, _, _) = ends
        w, _, once, twice = ends[self.end]
        below = self.level * size
        rate = z + self.share * (v - z)
        return sign * (w - self.level), sign * rate, sign * (once - below), sign * (twice - 0.5 * below * size)


def position_tolerance(ends: Ends, macro_step: float) -> float:
    """Resolution of positions [m]: rounding of the displacements, and of what moves them."""
    (u, v, _, _), (y, z, _, _) = ends
    return 8.0 * EPS * max(u, -u, y, -y) + 1e-15 * max(v, -v, z, -z) * macro_step


def no_dip(start: Sample, end: Sample, size: float, fastest: float) -> bool:
    """Tell whether what both samples hold stays above 0 between them, at sight: it has no time to fall to 0 and rise.

    Not even if both ends move against each other as fast as the ``fastest`` so far [m/s], nor by the cubic.
    """
    f0, d0, _, _ = start
    f1, d1, _, _ = end
    low = f0 if f0 < f1 else f1
    return f0 + f1 > 2.0 * fastest * size and low > abs(f1 - f0) + size / 3.0 * (abs(d0) + abs(d1))


def locate(
    evaluate: Callable[[float], Sequence[float]], guess: float, size: float, tolerance: float, time: float
) -> float:
    """Step size at which f = 0 to ``tolerance``, by Newton's method inside a bracket, then by secants.

    ``evaluate(h)`` repeats the step with size h and returns f, ḟ, … at its end; the last size evaluated is the one
    returned, so the bodies are left there. ``guess`` is the first one. f(0) ≥ 0 > f(size); ``time`` is the step's start
    (its rounding bounds the resolution). A zero that f rises from, as it may at the start, is none of these. ḟ
    is only the first guess of df/dh: where both ends differ in velocity, the force of a step, and with it the motion,
    changes with h.
    """
    low = 0.0
    high = size
    h = max(guess, EPS * size)
    last: tuple[float, float] | None = None
    for _ in range(_MAX_EVALUATIONS):
        value, rate, *_ = evaluate(h)
        if abs(value) <= tolerance and rate < 0.0:
            return h
        if value > 0.0 or (value >= -tolerance and rate >= 0.0):
            low = h
        else:
            high = h
        if high - low <= 4.0 * EPS * max(abs(time), size):
            return h
        slope = rate
        if last is not None:
            slope = (value - last[1]) / (h - last[0])
            if abs(value) > 0.5 * abs(last[1]):
                slope = 0.0  # no progress: the bracket is halved
        last = (h, value)
        h = h - value / slope if slope < 0.0 else 0.5 * (low + high)
        if not low < h < high:
            h = 0.5 * (low + high)
    return h
