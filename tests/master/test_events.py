"""Where an event is: the cubic through both ends against numpy, and location to rounding."""

import math
from contextlib import nullcontext

import numpy as np
import pytest
from bodies import DuffingBody, Upper, interface_of
from scenes import table

from springbeam.bodies.protocol import NO_FORCE, Motion, StepRefused
from springbeam.contact.events import Height, locate, no_dip, position_tolerance
from springbeam.contact.phases import Automaton, Joint, Phase
from springbeam.coupling.protocol import Step
from springbeam.motion.paths import Path
from springbeam.run.detection import Detector
from springbeam.run.macro_steps import MacroGrid
from springbeam.run.setup import set_up
from springbeam.run.stepping import Pair, Present
from springbeam.scene import load_scene, with_changes


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
    guess = Path.through(f(0.0), f(size), size).falls_through_zero() * size
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

    assert Path.through(f(0.0), f(math.pi), math.pi).falls_through_zero() < 1e-12
    # ḟ(π/2) = −(π/2)²
    assert located(f, math.pi, 1e-14, 0.0) == pytest.approx(0.5 * math.pi, abs=1e-14)


RISING = (Motion(0.3, 1.0, 0.0, 0.0), Motion(0.2, 0.5, 0.0, 0.0))
HAPPENS = table("master/cases.toml")["happens"]


@pytest.mark.parametrize("name", HAPPENS)
def test_what_may_happen_in_a_phase_is_as_far_away_as_it_is_and_comes_as_fast_as_the_ends(name):
    """Ψ is at 0.1 m, the stop at −15 mm; joined ends move with the velocity of their momentum."""
    changes = dict(HAPPENS[name])
    scene = load_scene(changes.pop("of"))
    expected = changes.pop("expected")
    phase = Phase(Joint(changes.pop("joint")), changes.pop("seated", False))
    automaton = Automaton(interface_of(with_changes(scene, **changes), equilibrium=0.1))
    samples = automaton.samples(phase, RISING)
    found = dict(zip((kind for kind, _ in automaton.guards(phase).functions), samples, strict=True))
    assert found == {kind: pytest.approx(tuple(sample), rel=1e-14) for kind, sample in expected.items()}


@pytest.mark.parametrize(("rate", "fastest", "stays"), [(0.0, 0.9, True), (0.0, 1.1, False), (5.0, 0.9, False)])
def test_a_motion_stays_above_0_at_sight_if_neither_the_fastest_so_far_nor_the_cubic_falls_there(rate, fastest, stays):
    """From 1 m to 1 m in 1 s, down and up again at ``rate``: the cubic of 5 m/s is at 1 − 5/4 m in the middle."""
    assert no_dip((1.0, -rate), (1.0, rate), 1.0, fastest) is stays


@pytest.mark.parametrize(("place", "speed", "roundings"), [(-2.0, 1.0, 16.0), (0.0, -1e3, 1e-15 / np.finfo(float).eps)])
def test_positions_are_told_apart_to_8_roundings_or_to_one_of_the_way_in_a_step(place, speed, roundings):
    """The macro step is 1 ms."""
    ends = (Motion(0.0, 0.0, 0.0, 0.0), Motion(place, speed, 0.0, 0.0))
    assert position_tolerance(ends, 1e-3) == pytest.approx(roundings * np.finfo(float).eps, rel=1e-3)


@pytest.mark.parametrize(("jump", "refused"), [(5e-10, True), (5e-11, False)])
def test_a_motion_that_jumps_with_the_size_of_the_step_has_no_event(jump, refused, monkeypatch):
    """The gap of ends 1 m high falls past 0 at once. Positions are known to 8 roundings, 1e5 of these are 1.8e-10."""
    pair = Pair(set_up(load_scene("soft")), Upper(2.0), DuffingBody(1.0))
    start = tuple(Motion(place, 0.0, 0.0, 0.0) for place in (1.0 + jump, 1.0))

    def attempt(state, size, start):
        tip = 1.0 + (jump if size < 0.3e-3 else -jump)
        ends = (Motion(tip, -1e-9, size, 0.5 * size**2), Motion(1.0, 0.0, size, 0.5 * size**2))
        return Step(0.0, size, NO_FORCE, NO_FORCE, start, ends)

    monkeypatch.setattr(pair, "attempt", attempt)
    detector = Detector(pair, MacroGrid(0.0, 1.0, 1e-3))
    state = pair.initial_state(0.0)
    state.fastest = 1.0
    step = attempt(None, 1e-3, start)
    with pytest.raises(StepRefused, match="the motion jumps by") if refused else nullcontext():
        found, kind = detector.first_event(state, step)
        assert (kind, found.size) == ("impact", pytest.approx(0.3e-3, rel=1e-12))


def pushing(monkeypatch, push, seated=False):
    """Return a detector of ends that touch, their state, and a step of H = 1 ms.

    After ``size`` [s] the force is ``push(size)`` [N]; its mean is that of the parabola through ends and middle.
    """
    scene = load_scene("soft")
    pair = Pair(set_up(scene), Upper(2.0), DuffingBody(1.0))
    state = pair.initial_state(0.0)
    state.enter(Phase(Joint.TIED if seated else Joint.TOUCH, seated))
    state.present = Present(push(0.0), push(0.0))

    def attempt(state, size, start):
        pair._last = Step(0.0, size, NO_FORCE, NO_FORCE, start, start)
        return pair._last

    monkeypatch.setattr(pair, "attempt", attempt)
    monkeypatch.setattr(pair, "present", lambda phase, step, H: Present(*[push(step.size)] * 2))
    monkeypatch.setattr(pair, "rewind", lambda: None)
    mean = lambda kind, phase, step: (push(0.0) + 4.0 * push(0.5 * step.size) + push(step.size)) / 6.0  # noqa: E731
    monkeypatch.setattr(pair, "mean_of", mean)
    return Detector(pair, MacroGrid(0.0, 1.0, 1e-3)), state, attempt(state, 1e-3, pair.ends())


@pytest.mark.parametrize(
    ("seated", "push", "zero"),
    [
        (True, lambda t: np.cos(2e3 * t), 0.25e-3 * np.pi),
        (False, lambda t: 1.0 - 1e3 * t + 30.0 * (1e3 * t) ** 3, None),  # dips, but not so far
        (False, lambda t: (1e3 * t - 0.3) * (1e3 * t - 0.6), 0.3e-3),  # pulls inside the step alone
        (False, lambda t: -1.0, 0.0),
    ],
)
def test_ends_part_and_a_seat_is_left_where_the_force_between_them_vanishes(monkeypatch, push, zero, seated):
    detector, state, step = pushing(monkeypatch, push, seated)
    found, kind = detector.first_event(state, step)
    expected = None if zero is None else "unseated" if seated else "separation"
    assert kind == expected
    assert found.size == pytest.approx(1e-3 if zero is None else zero, abs=1e-11)


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


def test_means_of_a_height_are_those_of_its_values():
    """2 m over 0.1 s, below a level of 0.5 m by −1.5 m: the mean, and ∫∫ over the square of the step."""
    there = Motion(2.0, 0.0, 0.2, 0.01)
    assert Height(0, 0.5, 1.0, -1.0).means((there, there), 0.1) == pytest.approx((-1.5, -0.75), rel=1e-14)
