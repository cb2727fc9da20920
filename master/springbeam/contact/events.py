"""Event functions, and where inside a step one of them vanishes.

An event function f is positive while nothing happens and falls through zero at the event. A step knows f and ḟ at
both ends; the cubic through them tells where to look, also for a contact that opens and closes again inside the step.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..bodies.protocol import Motion
from ..scene import Beam, Scene, Spring
from ..scene.statics import tip_compliance, tip_load_deflection
from .laws import Law
from .phases import Joint, Phase, spring_force

_EPS = float(np.finfo(float).eps)
_MAX_EVALUATIONS = 60


#: f and ḟ at one time.
Sample = tuple[float, float]
#: f, ḟ of the ends (tip, lower end).
EventFunction = Callable[[tuple[Motion, Motion]], Sample]


def gap(ends: tuple[Motion, Motion]) -> Sample:
    """g = u_tip − y, or what lies below the tip instead of y."""
    tip, low = ends
    return tip.displacement - low.displacement, tip.velocity - low.velocity


def _above(end: int, level: float, share: float) -> EventFunction:
    """Height of an end; its rate is the tip's velocity by ``share``, the lower end's by the rest."""

    def height(ends: tuple[Motion, Motion]) -> Sample:
        tip, low = ends
        return ends[end].displacement - level, low.velocity + share * (tip.velocity - low.velocity)

    return height


def _below(end: int, level: float, share: float) -> EventFunction:
    above = _above(end, level, share)

    def depth(ends: tuple[Motion, Motion]) -> Sample:
        value, rate = above(ends)
        return -value, -rate

    return depth


def _holding(beam: Beam, spring: Spring) -> EventFunction:
    """C/k of a massless tip on the spring top, y − u_F + α_b z [m]: known from where they are, not from a step's force.

    ż of its rate is that of the spring with the tip on it, off the foundation.
    """
    rest, stiffness, alpha = tip_load_deflection(beam), 1.0 / tip_compliance(beam), beam.alpha_b

    def pressed(ends: tuple[Motion, Motion]) -> Sample:
        _, low = ends
        y, z = low.displacement, low.velocity
        value = y - rest + alpha * z
        acceleration = -(stiffness * value + spring.damping * z + spring_force(spring, y)) / spring.mass
        return value, z + alpha * acceleration

    return pressed


class EventFunctions:
    """Which event functions each phase of a scene has, by the kind of their event.

    ``tip_share`` is the tip's part in the velocity with which joined ends go on, `contact.common_velocity`: they differ
    from each other by what the energy schemes leave open, and one of them may even go the other way.
    """

    def __init__(self, scene: Scene, law: Law, tip_share: float) -> None:
        self._scene, self._tip_share = scene, tip_share
        pair = scene.beam is not None and scene.spring is not None
        self._ties, self._meets = pair and not law.soft, pair and not law.soft and not law.lasting
        self._phase: Phase | None = None
        self._functions: list[tuple[str, EventFunction]] = []
        #: The ends last asked for, and the samples there: a step starts where the one before has ended.
        self._ends: tuple[Motion, Motion] | None = None
        self._samples: list[Sample] = []

    def of(self, phase: Phase) -> list[tuple[str, EventFunction]]:
        if phase is not self._phase:
            self._phase, self._functions, self._ends = phase, self._built(phase), None
        return self._functions

    def samples(self, phase: Phase, ends: tuple[Motion, Motion]) -> list[Sample]:
        """f, ḟ of each function of ``phase``."""
        functions = self.of(phase)
        if ends != self._ends:
            self._ends, self._samples = ends, [function(ends) for _, function in functions]
        return self._samples

    def _built(self, phase: Phase) -> list[tuple[str, EventFunction]]:
        tip, low = 0, 1
        spring, stop = self._scene.spring, self._scene.stop
        functions: list[tuple[str, EventFunction]] = []
        share = self._tip_share if self._ties and phase.joint is not Joint.FREE else 0.0
        if self._meets:
            assert spring is not None
            if phase.joint is Joint.FREE:
                functions.append(("impact", gap))
            if phase.joint is Joint.TIED and not phase.seated:
                functions.append(("release", _below(low, spring.equilibrium, share)))
            if phase.joint is Joint.TOUCH:
                functions.append(("retie", _above(low, spring.equilibrium, share)))
                beam = self._scene.beam
                if beam is not None and beam.fidelity == "quasi_static" and not phase.seated:
                    functions.append(("separation", _holding(beam, spring)))
        if stop is not None and not phase.seated:
            end, share = (tip, 1.0) if spring is None else (low, share)
            functions.append(("stop_impact", _above(end, stop.position, share)))
        return functions


def position_tolerance(ends: tuple[Motion, Motion], level: float, macro_step: float) -> float:
    """What positions can be told apart to [m]: rounding of the displacements, and of the foundation's ``level``."""
    (u, v, _, _), (y, z, _, _) = ends
    return 8.0 * _EPS * max(abs(u), abs(y), abs(level)) + 1e-15 * max(abs(v), abs(z)) * macro_step


def stays_above(start: Sample, end: Sample, size: float, level: float) -> bool:
    """Whether the cubic is bound to stay above ``level``: its Bézier points do, and it lies in their hull."""
    (f0, d0), (f1, d1), third = start, end, size / 3.0
    return f0 >= level and f1 >= level and f0 + third * d0 >= level and f1 - third * d1 >= level


def lowest_inside(start: Sample, end: Sample, size: float) -> float | None:
    """τ in (0, size) where the cubic through both samples has its minimum, if it has one inside."""
    d0, d1 = start[1] * size, end[1] * size
    rise = end[0] - start[0]
    # f(x) = f0 + d0 x + b x² + a x³ on [0, 1]
    a, b = d0 + d1 - 2.0 * rise, 3.0 * rise - 2.0 * d0 - d1
    discriminant = b * b - 3.0 * a * d0
    if discriminant <= 0.0:
        return None
    # The root of f' with f'' > 0, in the form that does not cancel.
    root = discriminant**0.5
    denominator = b + root if b > 0.0 else 3.0 * a
    if denominator == 0.0:
        return None
    x = (-d0 if b > 0.0 else root - b) / denominator
    return x * size if 0.0 < x < 1.0 else None


def cubic_value(start: Sample, end: Sample, size: float, tau: float) -> float:
    """The cubic's value at τ."""
    x = tau / size
    d0, d1 = start[1] * size, end[1] * size
    rise = end[0] - start[0]
    return start[0] + x * (d0 + x * (3.0 * rise - 2.0 * d0 - d1 + x * (d0 + d1 - 2.0 * rise)))


def interpolated(start: Motion, end: Motion, size: float, tau: float) -> Sample:
    """Displacement and velocity at τ of the cubic through both ends of a step."""
    v, w = start.velocity, end.velocity
    x, rise = tau / size, (end.displacement - start.displacement) / size
    rate = v + x * (2.0 * (3.0 * rise - 2.0 * v - w) + 3.0 * x * (v + w - 2.0 * rise))
    return cubic_value((start.displacement, v), (end.displacement, w), size, tau), rate


def cubic_crossing(start: Sample, end: Sample, size: float) -> float:
    """τ where the cubic falls through zero, by bisection; f(size) < 0."""
    d0, d1, rise = start[1] * size, end[1] * size, end[0] - start[0]
    f0, b, a = start[0], 3.0 * rise - 2.0 * d0 - d1, d0 + d1 - 2.0 * rise
    low, high = 0.0, size
    for _ in range(60):
        middle = 0.5 * (low + high)
        x = middle / size
        value = f0 + x * (d0 + x * (b + x * a))
        # Starting on zero and rising is still "before": only the side that ends below counts.
        if value > 0.0 or (value == 0.0 and middle < 0.5 * size):
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def locate(
    evaluate: Callable[[float], Sample], start: Sample, end: Sample, size: float, tolerance: float, time: float
) -> float:
    """Step size at which f = 0 to ``tolerance``, by Newton's method inside a bracket, then by secants.

    ``evaluate(h)`` repeats the step with size h and returns f, ḟ at its end; the last size evaluated is the one
    returned, so the bodies are left there. f(0) ≥ 0 > f(size); ``time`` is the step's start (its rounding bounds what
    can be told apart). A zero that f rises from, as it may at the start, is none of these. ḟ is only the first guess of
    df/dh: where both ends differ in velocity, the force of a step, and with it the motion, changes with h.
    """
    low, high = 0.0, size
    h = cubic_crossing(start, end, size)
    last: tuple[float, float] | None = None
    for _ in range(_MAX_EVALUATIONS):
        value, rate = evaluate(h)
        if abs(value) <= tolerance and rate < 0.0:
            return h
        if value > 0.0 or (value >= -tolerance and rate >= 0.0):
            low = h
        else:
            high = h
        if high - low <= 4.0 * _EPS * max(abs(time), size):
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
