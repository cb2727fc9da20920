"""The error of a run is at most what its companion says: attempts to make that false, and who is judged."""

from dataclasses import replace

import oscillator
import pytest
from scenes import group, named

import springbeam
from springbeam import PointMass, SpringDamper, load_scene, simulate, with_changes
from springbeam.monolithic.event_driven import integrate as reference
from springbeam.results.distance import distance
from springbeam.run import companion
from springbeam.run.companion import LIMITS, LONGER, check
from springbeam.scene import scene_from_dict
from springbeam.studies.metrics import metrics_of
from springbeam.studies.study import measured

#: Soft laws, ties, impacts on the foundation, creeping and fine beams, of `tests/scenes.toml`.
JUDGED = group("judged")


def apart(run, exact):
    return distance(run, exact, LONGER * run.scene.coupling.H)


@pytest.mark.parametrize("degree", [0, 2])
@pytest.mark.parametrize("share", [4.0, 1.0])
@pytest.mark.parametrize("name", JUDGED)
def test_ends_are_no_further_from_the_reference_than_is_said(name, share, degree):
    """In steps in which errors are from 1e-7 to 30 % of the motion; the reference is exact to 1e-9."""
    scene = JUDGED[name]
    run = simulate(with_changes(scene, coupling={"degree": degree, "macro_step": share * scene.coupling.H}))
    true = apart(run, reference(run.scene, sample_times=run.time)).motion
    if run.summary["resolved"]:
        assert true < LIMITS.motion / 2.0
    assert true <= max(run.summary["errors"]["motion"], 1e-9)


def test_a_check_changes_no_bit_of_the_run_and_may_come_later():
    scene = load_scene("soft", ["time.t_end=0.1", "beam.n_elements=6"])
    judged = simulate(scene)
    run = simulate(scene, check=False)
    assert run.steps.tobytes() == judged.steps.tobytes()
    assert (run.summary["resolved"], "errors" in run.summary) == (None, False)
    later = springbeam.check(run)
    assert {**later.as_summary()["errors"], "wall_time": 0.0} == {**judged.summary["errors"], "wall_time": 0.0}
    assert later.resolved
    assert run.summary["resolved"] is None


def test_the_error_of_any_function_of_a_run_is_that_of_both():
    """The clamp's moment at the end, of a position between rows, and of a count, beside a run in steps of H/16."""
    scene = load_scene("soft", ["time.t_end=0.1", "beam.n_elements=6", "coupling.macro_step=4e-3", "coupling.degree=0"])
    found = check(simulate(scene, check=False))
    fine = simulate(with_changes(scene, coupling={"macro_step": 2.5e-4}), check=False)
    for quantity in (
        lambda run: run.clamp_moment[-1],
        lambda run: run.at(0.0417).u_tip[0],
        lambda run: run.summary["number_of_contacts"],
    ):
        assert abs(quantity(found.run) - quantity(fine)) <= found.error_of(quantity)
    said = found.quantities()
    assert said["deepest_tip"] == found.error_of(lambda run: run.summary["deepest_tip"])
    assert abs(found.run.summary["bounce_time"] - fine.summary["bounce_time"]) <= said["bounce_time"]


FALLING = named("falling")


def test_bodies_of_the_caller_are_judged_if_they_can_return_to_their_start():
    upper = PointMass(2.0, displacement=0.1, velocity=-1.0)
    lower = SpringDamper(1.0, 300.0)
    run = simulate(FALLING, upper=upper, lower=lower)
    assert run.summary["resolved"]
    assert (upper.motion().displacement, lower.motion().displacement) == (run.u_tip[-1], run.y[-1])
    with_element = simulate(FALLING, lower=SpringDamper(1.0, 300.0))
    assert run.summary["errors"]["motion"] == with_element.summary["errors"]["motion"]


def on_a_grid(folder, number):
    """Scene of a mass linked to an FMU that moves in internal steps of 5 ms, in a ``number`` of macro steps of two."""
    fmu = oscillator.made(folder / "grid.fmu")
    parameters = {"m": 2.0, "k": 30.0, "c": 0.1, "lie": oscillator.LIES["grid"], "inner": 5e-3}
    return scene_from_dict(
        {
            "time": {"t_end": number * 0.01},
            "beam": {"element": "point_mass", "mass": 2.0, "velocity": -1.0},
            "spring": {**oscillator.ALL, "fmu": str(fmu), "force_sign": -1, "parameters": parameters},
            "contact": {"law": "link", "stiffness": 40.0},
            "coupling": {"macro_step": 0.01, "degree": 0},
        }
    )


@pytest.mark.parametrize(("number", "ratio"), [(60, 3), (64, 4), (50, 5), (49, 7)])
def test_a_body_with_steps_of_one_size_is_judged_by_whole_multiples_of_them(number, ratio, tmp_path):
    """The shortest from 3 H on that end where the run does; the error is that beside our own spring in steps of H/16.

    Errors of order 2 are what is said over ratio² − 1; higher orders change that by less than a fifth.
    """
    scene = on_a_grid(tmp_path, number)
    run = simulate(scene)
    errors = run.summary["errors"]
    assert (errors["ratio"], errors["beside"]) == (ratio, f"steps {ratio} times as long")
    own = {"mass": 2.0, "linear_stiffness": 30.0, "damping": 0.1}
    tables = {**scene.model_dump(exclude_unset=True, exclude_none=True), "spring": own}
    fine = simulate(with_changes(scene_from_dict(tables), coupling={"macro_step": 0.01 / 16.0}), check=False)
    true = distance(run, fine, 0.01).motion
    assert 0.8 < (ratio**2 - 1.0) * true / errors["motion"] < 1.2


def test_a_body_with_steps_of_one_size_in_a_prime_number_of_them_has_no_companion(tmp_path):
    run = simulate(on_a_grid(tmp_path, 47))
    assert (run.summary["resolved"], "errors" in run.summary) == (None, False)
    assert "use a multiple of [coupling] macro_step = 0.03" in run.summary["not_judged"]


def test_a_run_without_a_companion_says_why(monkeypatch):
    run = simulate(FALLING, check=False)
    monkeypatch.setattr(companion, "run_in_memory", lambda *_, **__: (_ for _ in ()).throw(springbeam.SceneError("no")))
    found = check(run)
    assert (found.resolved, found.judged) == (None, False)
    assert found.judged_run().summary["not_judged"] == "not judged: the companion is refused: no"
    with pytest.raises(ValueError, match="there is no companion run"):
        found.error_of(len)


def test_a_companion_that_stops_early_leaves_the_run_unresolved(monkeypatch):
    """An exchange that is unstable at 2.3 times its steps: the energy grows beyond what stops a run."""
    contact = {"law": "compliance", "stiffness": 1e6, "exponent": 1.0}
    scene = with_changes(FALLING, contact=contact, coupling={"scheme": "jacobi", "macro_step": 3e-5})
    found = check(simulate(scene, check=False))
    assert found.resolved is False
    assert found.why_not.startswith("not resolved: ")


@pytest.mark.parametrize("steps", [1, 4, 8])
def test_a_run_of_few_steps_has_a_companion_in_shorter_ones(steps):
    """A mass on a spring alone, whose error at degree 2 is rounding, and a contact, whose error is not."""
    scene = with_changes(FALLING, coupling={"macro_step": 1.0 / steps})
    found = check(simulate(scene, check=False))
    assert found.ratio == 1.0 / LONGER
    fine = simulate(with_changes(scene, coupling={"macro_step": 1e-3}), check=False)
    assert distance(found.run, fine, 1.0 / steps).motion <= max(found.errors["motion"], 1e-9)


def test_an_adaptive_run_has_a_companion_with_larger_tolerances():
    scene = load_scene("soft", ["time.t_end=0.1", "beam.n_elements=6", "coupling.relative_tolerance=1e-5"])
    run = simulate(scene)
    true = distance(run, reference(scene, sample_times=run.time), 1e-3).motion
    assert true <= run.summary["errors"]["motion"]
    assert run.summary["errors"]["do_steps"] < run.do_steps


def test_an_unfinished_run_is_not_checked():
    run = simulate(FALLING, check=False)
    with pytest.raises(ValueError, match="has not come to its end"):
        check(replace(run, summary={**run.summary, "status": "stopped"}))


def test_a_case_of_a_study_has_the_error_of_each_metric():
    found = measured(lambda: FALLING, metrics_of(["y_min", "number_of_contacts", "max_z"]))
    run = check(simulate(FALLING, check=False))
    assert found["error_y_min"] == run.error_of(metrics_of(["y_min"])["y_min"])
    assert found["error_number_of_contacts"] == 0.0
    unjudged = measured(lambda: FALLING, metrics_of(["y_min"]), judge=False)
    assert "error_y_min" not in unjudged
    assert found["y_min"] == unjudged["y_min"]
