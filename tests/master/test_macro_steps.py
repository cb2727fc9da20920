"""Where macro steps end, and the error that chooses their sizes."""

from itertools import pairwise

import numpy as np
import pytest
from bodies import DuffingBody, Upper

from springbeam import RunStopped
from springbeam.bodies import force
from springbeam.bodies.protocol import NO_FORCE, Motion
from springbeam.coupling.hermite import gap_inside
from springbeam.coupling.protocol import Step
from springbeam.run.adaptive import AdaptiveSteps
from springbeam.run.macro_steps import MacroGrid
from springbeam.run.stepping import Pair, State
from springbeam.scene import load_scene, with_changes

# -- where macro steps end, by themselves: the grid, the adaptive sizes, and what they are chosen by ------------------


LENGTH = 3.0


def adaptive():
    return AdaptiveSteps(load_scene("soft"), Pair(load_scene("soft"), Upper(1.0), DuffingBody(1.0)), 0.0, LENGTH)


def after(steps, *judgements):
    for error, order in judgements:
        assert steps.judge(steps.size, error, order) == (error <= 1.0)
    return steps.size


def test_the_step_after_an_impact_is_short_and_the_next_one_back_on_the_grid():
    H = 0.1
    grid = MacroGrid(1.0, 2.0, H)
    for struck, ends in [(1.0, (1.0125, 1.1)), (1.15, (1.1625, 1.2)), (1.28, (1.2925, 1.4)), (1.495, (1.5075, 1.6))]:
        grid.struck(struck)
        for start, end in pairwise((struck, *ends)):
            target, size = grid.next(start)
            assert target == pytest.approx(end, abs=1e-12)
            assert size == pytest.approx(end - start, abs=1e-12)
    grid.struck(1.99)
    assert grid.next(1.99) == (2.0, 2.0 - 1.99)


@pytest.mark.parametrize("end", [2.0, 1.97, 1.91, 1.03, 1.0 + 1.0 / 3.0])
def test_the_grid_ends_where_the_run_does(end):
    grid, times = MacroGrid(1.0, end, 0.1), [1.0]
    while times[-1] < end:
        target, size = grid.next(times[-1])
        assert size == pytest.approx(target - times[-1], abs=1e-12)
        times.append(target)
    assert times[-1] == end
    assert times[:-1] == pytest.approx(1.0 + 0.1 * np.arange(len(times) - 1), abs=1e-12)


@pytest.mark.parametrize("order", [2, 5])
def test_the_next_size_has_the_error_of_the_tolerance(order):
    """error = (size/s)^order with s = 0.9⁻¹ times a size there is: from either side the steps settle on that size."""
    steps = adaptive()
    fitting = LENGTH * 2.0 ** (-37 / 4)
    for _ in range(40):
        after(steps, ((0.9 * 1.001 * steps.size / fitting) ** order, order))
    low = steps.size
    assert 2.0**-0.25 <= low / fitting <= 1.0
    while steps.size < 8.0 * fitting:
        after(steps, (0.0, order))
    for _ in range(20):
        after(steps, ((0.9 * 1.001 * steps.size / fitting) ** order, order))
    assert steps.size == low


def test_a_step_after_a_rejected_one_does_not_grow():
    steps = adaptive()
    rejected = after(steps, (1.1, 4))
    assert rejected < LENGTH * 2.0**-14
    assert after(steps, (1e-9, 4)) == rejected
    assert after(steps, (1e-9, 4)) == 2.0 * rejected
    assert steps.state.rejections == 1


@pytest.mark.parametrize(("share", "error", "change"), [(0.5, 0.9, 1.0), (0.5, 1e-9, 2.0), (0.2, 1e-30, 1.0)])
def test_a_step_that_a_kink_has_cut_makes_the_next_one_longer_or_leaves_it(share, error, change):
    """A cut step that was much shorter than a whole one tells nothing of these."""
    steps = adaptive()
    size = steps.size
    assert steps.judge(share * size, error, 4, to_kink=True)
    assert steps.size == pytest.approx(change * size, rel=1e-9)


def test_the_last_step_ends_the_run():
    """A remainder of up to a quarter more is taken at once, and none is ever shorter than a quarter of the size."""
    steps = adaptive()
    size = steps.size
    assert steps.next(LENGTH - 1.2 * size) == (LENGTH, pytest.approx(1.2 * size, rel=1e-9))
    assert steps.next(LENGTH - 1.3 * size) == (pytest.approx(LENGTH - 0.3 * size), size)


# -- estimates ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("degree", [1, 2])
def test_the_moment_inside_and_the_work_on_it_are_those_of_the_gap(degree):
    """g = τ²(H − τ) (1 + τ): ∫g/H, and ∫(2τ/H − 1) g/H, and ∫C ġ, by Gauss points."""
    H, c = 0.2, (5.0, -7.0, 11.0)
    g = np.polynomial.Polynomial((0.0, 0.0, H, -1.0)) * np.polynomial.Polynomial((1.0, 1.0))
    x, weights = np.polynomial.legendre.leggauss(8)
    tau = 0.5 * H * (x + 1.0)
    expected = 0.5 * float(weights @ (g(tau) * x ** (degree - 1)))
    work = 0.5 * H * float(weights @ (force.value(c, tau) * g.deriv()(tau)))
    once, twice = g.integ(), g.integ().integ()
    end = Motion(g(H), g.deriv()(H), once(H), twice(H))
    assert gap_inside(end, H, degree) == pytest.approx(abs(expected), rel=1e-12)
    assert force.work(c, end, H) == pytest.approx(work, rel=1e-12)


@pytest.mark.parametrize(
    ("apart", "most", "words"),
    [(0.0, 500, "500 events at once"), (1.9e-9, 500, "500 events at once"), (2.1e-9, 20_000, "20000 .*within a macro")],
)
def test_events_that_crowd_stop_the_run(apart, most, words):
    """500 at once, which is within 1e-6 H, or 20,000 within a macro step, are none too many."""
    H = 1e-3
    state = State(0.0, (Motion(0.0, 0.0, 0.0, 0.0),) * 2)
    for k in range(most):
        state.count_cut(apart * k * H, apart * H, H)
    with pytest.raises(RunStopped, match=words):
        state.count_cut(apart * most * H, apart * H, H)


# -- the error that a step tells of itself, of two masses that are apart ----------------------------------------------


@pytest.mark.parametrize(("share", "holds"), [(0.99, True), (1.01, False)])
def test_no_more_than_rounding_is_forgiven(share, holds):
    """The tip at 1 m moves by 1 nm, and may be 1e-3 of that and 16 ulp of 1 m, 3.6e-15 m, beside the cubic."""
    scene = with_changes(load_scene("soft"), coupling={"relative_tolerance": 1e-3, "absolute_tolerance": 1e-30})
    way, rest, start = 1e-9, Motion(0.0, 0.0, 0.0, 0.0), Motion(1.0, 0.0, 0.0, 0.0)
    beside = share * (1e-3 * way + 16.0 * 2.0**-52)
    pair = Pair(scene, Upper(1.0, y=1.0), DuffingBody(1.0))
    # In a step of 1 s from rest to rest: ∫ of the cubic is the mean of its ends, ∫∫ (7 f0 + 3 f1)/20.
    end = Motion(1.0 + way, 0.0, 1.0 + way / 2.0 + beside, 0.5 + 0.15 * way + beside / 2.0)
    step = Step(0.0, 1.0, NO_FORCE, NO_FORCE, (start, rest), (end, rest))
    assert AdaptiveSteps(scene, pair, 0.0, 9.0).holds(pair.initial_state(0.0), step, "") is holds
