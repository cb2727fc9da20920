"""Algorithm 1: what the paper reports of it; the program through the FMUs beside the one as one system; its command."""

from functools import cache

import numpy as np
import pytest
from scenes import SOFT, kinds, soft

from springbeam import load_scene, simulate, with_changes
from springbeam.paper import co_simulation, monolithic
from springbeam.paper.algorithm import AlgorithmFailure

PROGRAMS = {"monolithic": monolithic, "co_simulation": co_simulation}


@cache
def found(program, number):
    return PROGRAMS[program].algorithm_1(load_scene(f"paper-fig{number}"))


@pytest.mark.parametrize(("number", "reported"), [(2, 1.990), (4, 2.000)])
def test_the_iterations_are_those_of_table_2_and_the_tip_flips(number, reported):
    """Section 6: "the beams move up and down almost the same speed at each time step" (ω₁h = 967).

    f_b = (0, …, 0, −6) of the next figure bends the tip by 6 h_x/3 × its compliance 4/(3κ) ≈ 7e-14 m: nothing to see.
    """
    run = found("monolithic", number)
    loaded = found("monolithic", number + 1)
    for program in PROGRAMS:
        assert found(program, number).summary["iterations_per_solve"] == pytest.approx(reported, abs=0.01)
    v = run.v_tip
    assert (run.time[0], len(run)) == (0.5, 876)
    np.testing.assert_allclose(v[:5], [-1.0, 1.0, -1.0, 1.0, -1.0], atol=2e-4)
    assert np.mean(v[1:] * v[:-1] < 0.0) > 0.99
    assert np.max(np.abs(run.u_tip)) < 4.4e-6
    assert 0.0 < np.max(np.abs(loaded.u_tip - run.u_tip)) < 2e-11
    # Nothing in the model does the work of the tip that is overwritten: 75 % of the initial energy, ½∫x² dx.
    assert run.e_total[0] == pytest.approx(1.0 / 6.0, rel=1e-12)
    if number == 2:
        assert np.max(run.energy_residual) == pytest.approx(0.1253, abs=2e-4)


# -- one program beside the other


def resolved(**tables):
    """A heavy spring on a stiff foundation under a beam that comes down on it, in steps that resolve both."""
    beam = {"young_modulus": 1e3, "shear_modulus": 1e3, "n_elements": 4, "approach": "elastic"}
    spring = {"mass": 100.0, "linear_stiffness": 7e3, "cubic_stiffness": 4e8, "damping": 100.0, "external_force": -9.0}
    given = {"contact": {"stiffness": 500.0}, "coupling": {"macro_step": 1e-3}}
    moving = {"initial_velocity_slope": -0.1, "alpha_b": 1e-3}
    return with_changes(with_changes(SOFT, beam={**beam, **moving}, spring=spring, **given), **tables)


@pytest.mark.parametrize(
    ("at_contact", "slope", "speed", "stop", "stiffness", "phases"),
    [
        ("tip", 0.0, -0.1, -0.015, 500.0, {"tied", "seated"}),
        ("tip", 0.0, -0.1, -1e-4, 1e5, {"tied", "seated", "free"}),
        ("rest", 0.0, 0.1, -0.015, 1e5, {"tied", "free"}),
        ("rest", 2e-4, -0.1, -0.015, 1e5, {"free", "tied"}),
    ],
)
def test_both_programs_decide_alike(at_contact, slope, speed, stop, stiffness, phases):
    """In all their columns, up to a last step of 0.3 h; a spring sinks before the tip has come and after it has left.

    The midpoint rule and the exact flow differ by (ωh)²/12 ≤ 9e-5 of a step's motion, over 6 steps; 3e-4 is allowed,
    and more of energies, which grow tenfold in a step. Of a step that ends on the foundation, where the exact motion
    turns round, a dashpot takes more than that of the mean velocity.
    """
    contact = {"exponent": 1.0, "stiffness": stiffness}
    beam = {"initial_deflection_slope": slope, "initial_velocity_slope": speed}
    spring = {"initial_velocity": -0.02 if slope else 0.0}
    scene = resolved(time={"t_end": 5.3e-3}, contact=contact, beam=beam, spring=spring, stop={"position": stop})
    run, reference = (program.algorithm_1(scene, at_contact=at_contact) for program in (co_simulation, monolithic))
    assert (list(run.phase), run.summary["macro_steps"]) == (list(reference.phase), 6)
    assert np.array_equal(run.time, reference.time)
    assert set(run.phase) == phases
    assert kinds(run) == kinds(reference)
    if "seated" not in phases:
        assert run.e_dissipated == pytest.approx(reference.e_dissipated, rel=1e-3, abs=1e-9)
    shares = dict.fromkeys(("u_tip", "v_tip", "y", "z", "contact_force", "compliance_force", "foundation_force"), 3e-4)
    for name, share in (shares | {"e_beam": 3e-4, "e_spring": 3e-4, "energy_residual": 1e-3}).items():
        largest = np.abs(reference[name]).max()
        assert run[name] == pytest.approx(reference[name], abs=share * largest, rel=0.0), name
    for body, share in {"beam": 3e-4, "spring": 2e-3}.items():
        injected = reference.summary[f"injected_into_{body}"]
        assert run.summary[f"injected_into_{body}"] == pytest.approx(injected, rel=share, abs=1e-9)


@pytest.mark.parametrize(("t_end", "steps"), [(0.5035, 1), (0.7, 50), (0.7013, 51), (0.7 + 1e-10, 50)])
def test_runs_end_at_t_end_where_it_is_off_the_grid(t_end, steps):
    """First contact is at 0.5 s, h_t = 4 ms. A remainder that would drown in rounding joins the step before it."""
    scene = with_changes(load_scene("paper-fig2"), beam={"n_elements": 50, "n_modes": 0}, time={"t_end": t_end})
    for program in PROGRAMS.values():
        run = program.algorithm_1(scene)
        assert (len(run) - 1, run.time[-1]) == (steps, pytest.approx(t_end, rel=1e-14))


# -- what fails


def test_a_solution_that_grows_beyond_all_bounds_keeps_what_came_before():
    """The tip is thrown about, until Newton's method finds no step, or the FMU no spring that high."""
    scene = soft(4, time={"t_end": 0.05})
    says = {monolithic: "Newton's method for the position of the spring", co_simulation: "the hilltop of its potential"}
    for program, why in says.items():
        with pytest.raises(AlgorithmFailure, match=rf"{why}.* at t = 0\.0") as failed:
            program.algorithm_1(scene)
        assert len(failed.value.trajectory) > 1
        assert np.isfinite(failed.value.trajectory.energy_residual).all()


def test_the_case_of_figure_4_runs_to_its_end_with_the_law_transmission():
    """Where waves are not followed, accelerations can part ends that positions bring together at the same instant.

    That was repeated 20,000 times, until the run stopped.
    """
    run = simulate(with_changes(load_scene("paper-fig4"), coupling={"degree": 0}))
    assert (run.time[-1], run.summary["resolved"]) == (4.0, False)
    assert len(run.events) < 300
    assert np.abs(run.energy_residual).max() < 1e-9
