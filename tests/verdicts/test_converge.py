"""`springbeam converge`: sequences and beams whose order and limit are known."""

import json

import pytest
from commands import printed

from springbeam.scene import load_scene, with_changes
from springbeam.studies.converge import extrapolated, judged, meshes


@pytest.mark.parametrize(("order", "sizes"), [(0.7, (1, 2, 5, 10)), (2.0, (1, 2, 4, 8)), (4.0, (3, 4, 7, 30))])
def test_a_sequence_of_one_order_gives_it_and_its_limit(order, sizes):
    """Sizes need not be halvings: 10, 5, 2 and 1 modes were taken for these."""
    found = extrapolated([3.0 + 0.1 * n**-order for n in sizes], sizes)
    assert (found.order, found.limit) == pytest.approx((order, 3.0), rel=1e-9)
    assert found.error == pytest.approx(0.1 * sizes[-1] ** -order, rel=1e-6)


@pytest.mark.parametrize(
    ("values", "order"),
    [
        ([1.0, 0.25, 0.0625], None),  # three values have one order, which nothing confirms
        ([5.0, 1.0, 0.25, 0.0625], 2.0),  # 2.41 before
        ([9.0, 1.0, 0.25, 0.0625], None),  # 3.4 before
        ([1.1, 1.0, 0.25, 0.0625], None),  # a plateau before
    ],
)
def test_ratios_that_are_not_steady_have_no_limit(values, order):
    """Modes converge unevenly: a limit of 1.30 was given where 2.31 is right, and one ten times worse than a run."""
    found = extrapolated(values, (1, 2, 4, 8)[-len(values) :])
    assert found.order == (order and pytest.approx(order))
    assert (found.limit is None) == (order is None)


def test_errors_are_from_the_limit_and_as_given_is_the_mesh_of_the_scene():
    """1 m + (20/n)² m by 20, 40, 80 and 160 elements; all numbers of modes leave 7 m."""
    scene = with_changes(load_scene("soft"), beam={"n_elements": 20})
    ends = {"elements": lambda row: 1.0 + (20.0 / row["beam.n_elements"]) ** 2, "modes": lambda row: 7.0}
    rows = [
        {**mesh, "u_tip_end": ends[mesh["refined"]](mesh), "cost_wall_time": 1.0} for mesh in meshes(scene, 4).values()
    ]
    found = judged(scene, rows, ("u_tip_end",))
    errors = [row["error_u_tip_end"] for row in found.tables["converge"]]
    assert errors[:4] == pytest.approx([1.0, 0.25, 0.0625, 0.015625], rel=1e-9)


def test_linear_elements_converge_by_order_two(tmp_path):
    settings = ["--set=time.t_end=0.01", "--set=beam.n_elements=20"]
    metrics = ["--metric", "first_separation", "--metric", "contact_duration"]
    found = json.loads(printed("converge", "steel-bumper", *settings, *metrics, "--out", tmp_path / "found", "--json"))
    assert found["elements"]["settled"]["contact_duration"]["order"] == pytest.approx(2.0, abs=0.1)
    assert [level["beam.n_elements"] for level in found["elements"]["levels"]] == [20, 40, 80, 160]
    assert [level["unknowns"] for level in found["modes"]["levels"]] == [1, 3, 6, 12]
    assert found["elements"]["settled"]["first_separation"]["limit"] is None  # there is none
    written = {file.name for file in (tmp_path / "found").iterdir()}
    assert written == {"converge.csv", "converge.parquet", "converge.png"}
