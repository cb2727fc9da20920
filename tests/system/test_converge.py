"""`springbeam converge`: observed orders and limits of sequences that are known, and of a beam whose order is known."""

from __future__ import annotations

import json

import pytest
from commands import command

from springbeam.studies.converge import settled

pytestmark = pytest.mark.usefixtures("fmu_folder")


@pytest.mark.parametrize("order", [0.7, 2.0, 4.0])
def test_a_sequence_of_one_order_gives_it_and_its_limit(order):
    found = settled([3.0 + 0.1 * 2.0 ** (-order * k) for k in range(4)])
    assert (found.order, found.limit) == pytest.approx((order, 3.0), rel=1e-9)
    assert found.error == pytest.approx(0.1 * 2.0 ** (-3 * order), rel=1e-6)


@pytest.mark.parametrize("values", [(1.0, 2.0, 1.5), (1.0, 1.1, 1.3), (1.0, 1.5, 1.9)])
def test_values_that_do_not_settle_have_no_limit(values):
    found = settled(values)
    assert (found.change, found.order, found.limit) == (values[-1] - values[-2], None, None)


def test_linear_elements_converge_by_order_two(tmp_path):
    settings = ["--set=time.t_end=0.01", "--set=beam.n_elements=20"]
    metrics = ["--metric", "first_separation", "--metric", "contact_duration"]
    made = command("converge", "steel-bumper", *settings, *metrics, "--out", tmp_path / "found", "--json")
    assert made.exit_code == 0, made.stderr
    found = json.loads(made.stdout)
    assert found["elements"]["settled"]["contact_duration"]["order"] == pytest.approx(2.0, abs=0.1)
    assert [level["n_elements"] for level in found["elements"]["levels"]] == [20, 40, 80, 160]
    assert [level["n_modes"] for level in found["modes"]["levels"]] == [1, 3, 6, 12]
    assert found["elements"]["settled"]["first_separation"]["limit"] is None  # there is none
    assert {file.name for file in (tmp_path / "found").iterdir()} == {"converge.csv", "converge.png"}


@pytest.mark.parametrize(("arguments", "words"), [
    (["duffing"], "[beam]: the scene has no mesh to refine"),
    (["soft", "--metric", "weight"], "weight: no such metric"),
])  # fmt: skip
def test_what_cannot_be_refined_is_one_error(tmp_path, arguments, words):
    made = command("converge", *arguments, "--out", tmp_path / "found")
    assert made.exit_code == 2
    assert words in made.stderr
    assert not (tmp_path / "found").exists()
