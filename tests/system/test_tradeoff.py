"""The trade between error and cost, on the FMUs: what is swept, judged and named."""

import pytest
from scenes import kinds, soft

from springbeam.monolithic.event_driven import integrate as reference
from springbeam.studies import tradeoff
from springbeam.studies.metrics import costs
from springbeam.studies.tradeoff import Tradeoff, cheapest, pareto


def test_what_a_configuration_costs_and_where_it_errs_is_that_of_its_run():
    """The spring strikes its stop once."""
    scene = soft(time={"t_end": 0.12})
    run = tradeoff.run_in_memory(scene)
    exact = reference(scene)
    row = {**costs(run), **tradeoff.errors(run, exact)}
    summary = run.summary
    assert row["cost_do_steps"] == summary["beam_steps"] + summary["spring_steps"]
    assert row["cost_rollbacks"] == summary["beam_rollbacks"] + summary["spring_rollbacks"]
    assert row["error_energy"] == summary["max_energy_residual"]
    assert kinds(run) == kinds(exact) == ["impact", "stop_impact"]
    assert row["error_event_time"] == pytest.approx(abs(run.events[1].time - exact.events[1].time), rel=1e-9)
    assert 0.0 < row["error_impulse"] < 0.01


def test_front_and_choices_are_of_what_is_a_result():
    """One that nothing is quicker and better than is on the front; 0.1 is no result.

    A choice is the cheapest that keeps the error, as all finer ones of its family do.
    """

    def row(seconds, error, family="steady"):
        return {"family": family, "setting": "", "status": "done", "error_motion": error, "cost_wall_time": seconds}

    rough = row(1.0, 1e-3)
    better = row(2.0, 1e-5)
    lucky = row(0.7, 1e-6, "luck")
    wrong = row(0.1, 0.2, "luck")
    exact = row(1.5, 1e-7, "exact")
    found = [rough, better, lucky, wrong, exact]
    assert pareto(found) == [lucky, exact]
    assert cheapest(found) == [rough, exact, exact, None]


ENERGY = {"energy 0", "energy 1", "energy 2", "energy 2, IDA 1e-04"}


@pytest.mark.parametrize(
    ("law", "there", "absent"),
    [
        ("transmission", {"energy 2 adaptive"}, "jacobi 0"),
        ("compliance", {"jacobi 0", "jacobi 1", "gauss_seidel 0", "gauss_seidel 1"}, "energy 3"),
        ("tie", set(), "jacobi 0"),
        ("link", {"jacobi 1"}, "jacobi 2"),
    ],
)
def test_every_axis_is_swept_that_the_law_has(law, there, absent):
    study = Tradeoff(scene=soft(contact={"law": law}, time={"t_end": 0.05}))
    families = {case["family"] for case in study.cases().values()}
    assert ENERGY | {"energy 2 adaptive"} | there <= families
    assert absent not in families
