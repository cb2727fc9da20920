"""The error that a step tells of itself, which chooses adaptive steps, and events that crowd."""

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
from bodies import DuffingBody, Upper

from springbeam import RunStopped, load_scene, with_changes
from springbeam.bodies.protocol import NO_FORCE, Motion
from springbeam.contact.phases import Joint, Phase
from springbeam.coupling.protocol import Step
from springbeam.run.macro_steps import AdaptiveSteps
from springbeam.run.setup import set_up
from springbeam.run.stepping import Pair, Present, State


@pytest.mark.parametrize("apart", [0.99, 1.01])
def test_events_that_crowd_stop_the_run(apart):
    """20,000 in a row, each within a macro step of the one before, are none too many."""
    H = 1e-3
    most = 20_000
    state = State(0.0, (Motion(0.0, 0.0, 0.0, 0.0),) * 2)
    for k in range(most):
        state.count_event(apart * k * H, H)
    with pytest.raises(RunStopped, match=r"20000 .*within a macro") if apart < 1.0 else nullcontext():
        state.count_event(apart * most * H, H)


REST = Motion(0.0, 0.0, 0.0, 0.0)


def adaptive(upper, lower, absolute=1e-30, t_end=9.0):
    """Steps of two masses from a relative tolerance of 1e-3 and an absolute one, and the state at their start."""
    scene = with_changes(load_scene("soft"), coupling={"relative_tolerance": 1e-3, "absolute_tolerance": absolute})
    pair = Pair(set_up(scene), upper, lower)
    return AdaptiveSteps(replace(pair.setup, end=t_end), pair), pair.initial_state(0.0)


@pytest.mark.parametrize(("share", "holds"), [(0.99, True), (1.01, False)])
@pytest.mark.parametrize("absolute", [1e-30, 5e-13])
def test_no_more_than_the_tolerances_and_rounding_is_forgiven(absolute, share, holds):
    """The tip at 1 m moves by 1 nm, and may be 1e-3 of that, the absolute tolerance and 64 ulp of 1 m, 1.4e-14 m,
    beside the cubic."""
    steps, state = adaptive(Upper(1.0, y=1.0), DuffingBody(1.0), absolute)
    way = 1e-9
    beside = share * (1e-3 * way + absolute + 64.0 * 2.0**-52)
    # In a step of 1 s from rest to rest: ∫ of the cubic is the mean of its ends, ∫∫ (7 f0 + 3 f1)/20.
    end = Motion(1.0 + way, 0.0, 1.0 + way / 2.0 + beside, 0.5 + 0.15 * way + beside / 2.0)
    step = Step(0.0, 1.0, NO_FORCE, NO_FORCE, (Motion(1.0, 0.0, 0.0, 0.0), REST), (end, REST))
    assert steps.holds(state, step, "") is holds


@pytest.mark.parametrize(("share", "holds"), [(0.9, True), (1.1, False)])
@pytest.mark.parametrize("degree", [0, 1, 2])
@pytest.mark.parametrize("turned", [0.0, 1.0])
def test_the_force_that_a_step_leaves_out_may_move_the_ends_by_the_tolerances(turned, degree, share, holds):
    """a P_(d+1) of the multiplier moves free masses of 10 kg, μ = 5 kg, by a H²/4μ times the largest ∬ P_(d+1).

    That may be 1e-3 of the way of 0.5 m, and 2 mm. Beside it the force may turn a mismatch round by 1 kN.
    """
    steps, state = adaptive(Upper(10.0, y=1.0), DuffingBody(10.0, y=1.0), 2e-3)
    P = np.polynomial.legendre.Legendre.basis(degree + 1)
    inside = P.integ(1, lbnd=-1).integ(1, lbnd=-1)
    inside -= np.polynomial.Polynomial([0.5, 0.5]).convert(kind=np.polynomial.Legendre) * inside(1.0)
    largest = np.abs(inside(np.linspace(-1.0, 1.0, 2001))).max()
    a = share * (1e-3 * 0.5 + 2e-3) * 4.0 * 5.0 / largest
    turning = 1e3 * turned
    sign = (-1.0) ** degree
    state.phase = Phase(Joint.TIED)
    state.present = Present(sign * (a - turning))
    steps._pair.present = lambda *_: Present(-a - turning)
    end = Motion(0.5, 0.0, 0.75, 8.5 / 20.0)
    step = Step(0.0, 1.0, NO_FORCE, NO_FORCE, (Motion(1.0, 0.0, 0.0, 0.0),) * 2, (end, end))
    steps._pair.joined.degree = degree
    assert steps.holds(state, step, "") is holds


def test_steps_grow_twofold_to_a_quarter_of_the_run_shrink_to_an_eighth_and_wait_after_that():
    steps, state = adaptive(Upper(1.0), DuffingBody(1.0), t_end=16.0)
    sizes = []
    for far_off in (*[False] * 13, True, False, False):
        end = Motion(1.0, 0.0, 9.0, 9.0) if far_off else REST
        step = Step(0.0, steps.size, NO_FORCE, NO_FORCE, (REST, REST), (end, REST))
        assert steps.holds(state, step, "") is not far_off
        sizes.append(steps.size)
    assert sizes == [*(16.0 * 2.0**-k for k in range(13, 2, -1)), 4.0, 4.0, 0.5, 0.5, 1.0]
