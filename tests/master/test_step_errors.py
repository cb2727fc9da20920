"""The error that a step tells of itself, which chooses adaptive steps, and events that crowd."""

from contextlib import nullcontext

import numpy as np
import pytest
from bodies import DuffingBody, Upper, solve

from springbeam import RunStopped, load_scene, with_changes
from springbeam.bodies import force
from springbeam.bodies.protocol import NO_FORCE, Motion
from springbeam.contact.laws import Compliance
from springbeam.contact.phases import Joint, Phase
from springbeam.coupling.protocol import Scales, Step
from springbeam.coupling.soft import SoftSolver
from springbeam.coupling.tie import Tie, gap_inside
from springbeam.run.macro_steps import AdaptiveSteps
from springbeam.run.stepping import Pair, State


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


@pytest.mark.parametrize(("scheme", "degree"), [
    *((scheme, degree) for scheme in ("energy", "soft") for degree in (0, 1, 2)), ("hermite", 1), ("hermite", 2),
])  # fmt: skip
def test_the_errors_of_a_step_fall_with_its_size_by_the_orders_that_they_tell(scheme, degree):
    """From a smooth start; the work on the gap of `hermite` 2, of which 6 is told, by 7."""
    found, soft = [], scheme == "soft"
    for size in (5e-3, 2.5e-3):
        upper = Upper(1.0, 100.0, 0.0, y=0.1, z=-0.5)
        lower = DuffingBody(2.0, 3.0, 40.0, y=0.1 + 0.02 * soft, z=-0.5 + 0.2 * soft)
        start = upper.motion(), lower.motion()
        coupling = SoftSolver(Compliance(1e3, 1.5), degree, 1e-13) if soft else Tie(scheme, degree, 1e-13)
        contact = solve(coupling, size, upper, lower)
        step = Step(0.0, size, contact, NO_FORCE, start, (upper.motion(), lower.motion()))
        found.append(np.array(coupling.local_errors(step, Scales(1.0, 0.5, 1.0, 2.0 / 3.0))))
    (errors, told), (halved, _) = (table.T for table in found)
    observed = np.log2(errors / halved)
    assert observed[0] == pytest.approx(told[0], abs=0.2)
    assert (abs(observed - told - 0.5) < 0.7).all()


def told(coupling, gap, contact=NO_FORCE):
    """Errors of a step of 20 ms whose gap at its end is told; beside 0.5 m, 4 m/s, 8 J and 0.25 kg.

    It starts with a penetration of 1 cm of a soft law, or a mismatch of 0.1 m/s of a tie.
    """
    rest = Motion(0.0, 0.0, 0.0, 0.0)
    before = Motion(-0.01, 0.0, 0.0, 0.0) if isinstance(coupling, SoftSolver) else Motion(0.0, 0.1, 0.0, 0.0)
    step = Step(0.0, 0.02, contact, NO_FORCE, (before, rest), (gap, rest))
    return coupling.local_errors(step, Scales(0.5, 4.0, 8.0, 0.25))


def test_errors_are_shares_of_the_length_the_energy_and_the_speed_of_a_motion():
    """Free masses keep the mismatch of 0.1 m/s at degree 1 and turn it round at the others; it is then 0.3 m/s.

    The rest is w: √(½ μ w²/E) and H w/6 of 0.5 m. By a force of 2 N a gap of 10 µm·s² inside does work.

    Of λ p with λ = 1 kN/m, p from 1 to 3 cm, of the mean 3 cm, degree 0 leaves P₁ with 10 N, degree 1 P₂ with −10 N.
    """
    mismatch = Motion(0.0, 0.3, 0.0, 0.0)
    for degree, w in enumerate((0.4, 0.2, 0.4)):
        of_energy, of_length = w * np.sqrt(0.5 * 0.25 / 8.0), 0.02 * w / (6.0 * 0.5)
        expected = [of_energy, of_length]
        assert [error for error, _ in told(Tie("energy", degree, 1e-13), mismatch)] == pytest.approx(
            expected, rel=1e-14
        )
    inside = Motion(0.0, 0.0, 1e-5, 0.0)  # C = 100 N/s τ does −100 N/s ∫ g on it
    errors = told(Tie("hermite", 1, 1e-13), inside, (0.0, 100.0, 0.0))
    assert [error for error, _ in errors] == pytest.approx([1e-5 / 0.02 / 0.5, 1e-3 / 8.0], rel=1e-14)
    deep = Motion(-0.03, 0.0, -0.03 * 0.02, 0.0)
    for degree in (0, 1):
        ((error, _),) = told(SoftSolver(Compliance(1e3, 1.0), degree, 1e-13), deep)
        assert error == pytest.approx(0.02 * 10.0 / (6.0 * 0.25 * 4.0), rel=1e-12)


@pytest.mark.parametrize("apart", [0.0, 0.99, 1.01])
def test_events_that_crowd_stop_the_run(apart):
    """20,000 in a row, each within a macro step of the one before, are none too many."""
    H, most = 1e-3, 20_000
    state = State(0.0, (Motion(0.0, 0.0, 0.0, 0.0),) * 2)
    for k in range(most):
        state.count_event(apart * k * H, H)
    with pytest.raises(RunStopped, match=r"20000 .*within a macro") if apart < 1.0 else nullcontext():
        state.count_event(apart * most * H, H)


REST = Motion(0.0, 0.0, 0.0, 0.0)


def adaptive(upper, lower, absolute=1e-30, t_end=9.0):
    """Steps of two masses from a relative tolerance of 1e-3 and an absolute one, and the state at their start."""
    scene = with_changes(load_scene("soft"), coupling={"relative_tolerance": 1e-3, "absolute_tolerance": absolute})
    pair = Pair(scene, upper, lower)
    return AdaptiveSteps(scene, pair, 0.0, t_end), pair.initial_state(0.0)


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


def test_what_moves_little_is_judged_beside_how_far_it_has_come():
    """After a way of 1 m 1e-3 of that is allowed beside the cubic, for a step of 1 nm as well."""
    steps, state = adaptive(Upper(1.0, y=1.0), DuffingBody(1.0))

    def to(start, way, beside):
        end = Motion(way, 0.0, 0.5 * (start + way) + beside, 0.05 * (7.0 * start + 3.0 * way) + 0.5 * beside)
        return Step(0.0, 1.0, NO_FORCE, NO_FORCE, (Motion(start, 0.0, 0.0, 0.0), REST), (end, REST))

    assert not steps.holds(state, to(1.0, 1.0 + 1e-9, 0.9e-3), "")
    steps.accept(to(1.0, 0.0, 0.0))
    assert steps.holds(state, to(1.0, 1.0 + 1e-9, 0.9e-3), "")
    assert not steps.holds(state, to(1.0, 1.0 + 1e-9, 1.1e-3), "")


@pytest.mark.parametrize(("share", "holds"), [(0.99, True), (1.01, False)])
def test_a_mismatch_that_a_step_creates_may_move_the_ends_by_the_tolerances(share, holds):
    """H w/6 may be 1e-3 of the way of 0.5 m, and 2 mm."""
    steps, state = adaptive(Upper(1.0, y=1.0), DuffingBody(1.0, y=1.0), 2e-3)
    w = share * 6.0 * (1e-3 * 0.5 + 2e-3)

    def end(v):
        """From rest at 1 m to 0.5 m in 1 s, with the moments of the cubic."""
        return Motion(0.5, v, 0.75 - v / 12.0, 8.5 / 20.0 - v / 30.0)

    start = (Motion(1.0, 0.0, 0.0, 0.0),) * 2
    state.phase = Phase(Joint.TIED)
    step = Step(0.0, 1.0, NO_FORCE, NO_FORCE, start, (end(w), end(0.0)))
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
