"""The spring FMU alone: periods of the Duffing oscillator, and where a softening spring escapes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing
from math import nan, pi, sqrt

from scipy.optimize import brentq

from ...bodies.fmu_bodies import FmuSpring
from ...bodies.protocol import NO_FORCE, FmuError, StepRefused
from ...scene import Spring
from ..exact import Duffing
from .check import Check, section

IDA = "IDA: BDF of order ≤ 5 takes some ε^(−1/6) internal steps a radian, each of error ε: ωT·ε^(5/6)"

_SPRINGS = ((3.0, -0.2, 0.5), (3.0, -0.2, 1.0), (150.0, 67.0, 0.5), (150.0, 67.0, 1.0))


@section("Spring: Duffing (k1, k2, A), from rest", *_SPRINGS)
def duffing(k1: float, k2: float, amplitude: float) -> Iterator[Check]:
    """Undamped Duffing spring, m = 1, from rest at A: its period, and where it is after one (`exact.Duffing`)."""
    period = Duffing(k1, k2, amplitude).period
    spring = Spring.with_ones(linear_stiffness=k1, cubic_stiffness=k2, equilibrium=amplitude)
    name = f"({k1:g}, {k2:g}, {amplitude:g})"
    relative = ida_error(2.0 * pi)
    with closing(FmuSpring(spring, 0.0)) as body:
        first, second = _falling_zeros(body, period / 18.5, 2)
    with closing(FmuSpring(spring, 0.0)) as body:
        for step in range(20):
            body.advance(step * period / 20.0, period / 20.0, NO_FORCE)
        back = body.motion()
    yield Check(f"{name}: period [s]", period, second - first, relative * period, IDA)
    yield Check(f"{name}: y(T) [m]", amplitude, back.displacement, relative * amplitude, IDA)
    yield Check(f"{name}: ẏ(T) [m/s]", 0.0, back.velocity, relative * amplitude * 2.0 * pi / period, IDA)


@section("Spring: escape of a softening spring")
def escape() -> Iterator[Check]:
    """A softening spring escapes past the hilltop √(k1/|k2|) of its potential; from y = 0 with z > k1/√(2 m |k2|).

    Inside it stays there, outside it leaves. Bisection finds where one turns into the other.
    """
    k1, k2 = 3.0, -0.2
    hilltop, speed = sqrt(k1 / -k2), k1 / sqrt(-2.0 * k2)
    seconds, width = 20, 1e-11
    relative = ida_error(sqrt(k1) * seconds)

    def stays(position: float, velocity: float) -> bool:
        start = {"equilibrium": position, "initial_velocity": velocity}
        spring = Spring.with_ones(linear_stiffness=k1, cubic_stiffness=k2, **start)
        try:
            with closing(FmuSpring(spring, 0.0)) as body:
                for second in range(seconds):
                    body.advance(float(second), 1.0, NO_FORCE)
                    if abs(body.motion().displacement) > hilltop * (1.0 + relative):
                        return False
        except (StepRefused, FmuError):
            return False
        return True

    reason = "width of the bisection; the start is compared with the formula"
    furthest = _threshold(lambda y: stays(y, 0.0), 0.9 * hilltop, 1.1 * hilltop, width)
    yield Check("start at rest, largest |y| [m]", hilltop, furthest, width * hilltop, reason)
    fastest = _threshold(lambda z: stays(0.0, z), 0.9 * speed, 1.1 * speed, width)
    yield Check("escape from y = 0, ẏ [m/s]", speed, fastest, relative * speed, f"{IDA}, T = 20 s")


def ida_error(radians: float) -> float:
    """Return the relative error that IDA's tolerance ε, the default of scenes, leaves over an angle ωT: `IDA`."""
    return float(radians * Spring.with_ones().relative_tolerance ** (5.0 / 6.0))


def _falling_zeros(body: FmuSpring, size: float, count: int) -> list[float]:
    """Return the first times [s] at which y falls through 0, found by repeating the step with other sizes."""
    time, zeros = 0.0, list[float]()
    while len(zeros) < count:
        body.mark()
        before, start = body.motion().displacement, time

        def displacement(tau: float, before: float = before, start: float = start) -> float:
            if tau == 0.0:
                return before
            body.rewind()
            body.advance(start, tau, NO_FORCE)
            return float(body.motion().displacement)

        after = displacement(size)
        if before > 0.0 >= after:
            zeros.append(time + float(brentq(displacement, 0.0, size, xtol=1e-16)))
            displacement(size)
        time += size
    return zeros


def _threshold(runs: Callable[[float], bool], low: float, high: float, width: float) -> float:
    """Return where ``runs`` ends, to ``width`` relative, by bisection; NaN unless low runs and high does not."""
    if not runs(low) or runs(high):
        return nan
    while high - low > width * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if runs(middle) else (low, middle)
    return 0.5 * (low + high)
