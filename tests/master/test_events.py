"""Where an event is: the cubic through both ends against numpy, and location to rounding."""

import math

import numpy as np
import pytest

from springbeam.contact.events import locate
from springbeam.motion.curves import Curve
from springbeam.run.macro_steps import MacroGrid


class Counted:
    """f = cos τ − level; falls through zero at acos(level). Its rate is told ``slope`` times as large."""

    def __init__(self, level, slope):
        self.level = level
        self.slope = slope
        self.sizes = []

    def __call__(self, size):
        self.sizes.append(size)
        return math.cos(size) - self.level, -self.slope * math.sin(size)


def located(f, size, tolerance, time):
    """`locate`, from where the cubic through both ends falls through zero."""
    guess = Curve.cubic(f(0.0), f(size), size).falls_through_zero() * size
    return locate(f, guess, size, tolerance, time)


@pytest.mark.parametrize(
    ("level", "slope", "tolerance", "time", "error", "most"),
    [
        # δτ = δf/|ḟ|. Newton: digits double.
        *((level, 1.0, 1e-14, 0.0, 2e-14 / math.sin(math.acos(level)), 8) for level in (0.999, -0.9)),
        # Without a usable rate it bisects: 52 halvings to rounding at most.
        (0.3, -1.0, 1e-15, 0.0, 1e-14, 55),
        # The rate of a motion that itself depends on h is df/dh but for a factor: secants find the root nevertheless,
        # where Newton's method with that factor converges linearly or not at all.
        *((0.3, share, 1e-15, 0.0, 3e-15, 25) for share in (0.25, 50.0)),
        # Steps that differ by 4 ulp of a time of 1e6 are one: no more than log2(3/4 ulp) = 31.6 for a tolerance of 0.
        (0.3, 1.0, 0.0, 1e6, 4.0 * np.finfo(float).eps * 1e6, 35),
    ],
)
def test_locate_finds_the_event_whatever_rate_it_is_told(level, slope, tolerance, time, error, most):
    f = Counted(level, slope)
    h = located(f, 3.0, tolerance, time)
    assert h == pytest.approx(math.acos(level), abs=error)
    assert f.sizes[-1] == h  # the bodies are left there
    assert len(f.sizes) - 2 <= most


def test_locate_does_not_take_a_zero_that_the_function_rises_from():
    """f = τ² cos τ rises from a rounding below zero; the cubic through (0, π) falls from there."""

    def f(size):
        return size**2 * math.cos(size) - 1e-15, 2.0 * size * math.cos(size) - size**2 * math.sin(size)

    assert Curve.cubic(f(0.0), f(math.pi), math.pi).falls_through_zero() < 1e-12
    # ḟ(π/2) = −(π/2)²
    assert located(f, math.pi, 1e-14, 0.0) == pytest.approx(0.5 * math.pi, abs=1e-14)


@pytest.mark.parametrize(
    ("time", "after_impact", "kink", "expected"),
    [
        (0.25, False, math.inf, (0.5, 0.25)),  # back to the grid
        (0.5, False, math.inf, (1.0, 0.5)),
        (0.4375, False, math.inf, (1.0, 0.5625)),  # a remainder below H/4 joins the next step
        (0.5, False, 0.75, (0.75, 0.25)),
        (0.25, True, math.inf, (0.3125, 0.0625)),  # H/8 after an impact
        (0.25, True, 0.4375, (0.3125, 0.0625)),
        (1.96875, True, math.inf, (2.0 + 1e-12, 0.03125 + 1e-12)),
        (1.5, False, math.inf, (2.0 + 1e-12, 0.5)),  # a remainder that would drown joins the step before it
    ],
)
def test_where_the_next_step_ends(time, after_impact, kink, expected):
    """In a run of 2 s in steps of 0.5 s, and one of 1 ps more."""
    grid = MacroGrid(0.0, 2.0 + 1e-12, 0.5)
    assert grid.next(time, kink, after_impact=after_impact) == pytest.approx(expected, rel=1e-15)
