"""All contacts of a run together are its results; exact ones are cases of tests/scenes.toml."""

import numpy as np
import pytest

from springbeam import load, load_scene, simulate, with_changes


@pytest.mark.parametrize("scene", ["soft", "vibro-impact", "beam-on-stop", "steel-bumper"])
def test_all_contacts_together_are_the_results_of_the_run(scene, tmp_path):
    run = simulate(scene)
    found = run.contacts
    summary = run.summary
    assert len(found) == summary["number_of_contacts"]
    assert sum(contact.impulse for contact in found) == pytest.approx(summary["contact_impulse"], rel=1e-12)
    assert sum(contact.duration for contact in found) == pytest.approx(summary["contact_duration_total"], rel=1e-12)
    assert max(contact.peak_force for contact in found) <= summary["contact_force_max"] * (1.0 + 1e-12)
    lost = {"soft": "loss_impact", "vibro-impact": "loss_contact", "steel-bumper": "loss_impact"}
    assert sum(contact.loss for contact in found) == pytest.approx(summary[lost.get(scene, "loss_stop")], rel=1e-12)
    # The file has them, and they follow from the others if it is lost.
    directory = run.save(tmp_path / "run")
    table = np.genfromtxt(directory / "contacts.csv", delimiter=",", names=True)
    np.testing.assert_array_equal(table["impulse"], [contact.impulse for contact in found])
    assert load(directory).contacts == found


@pytest.mark.parametrize("name", ["bar-impact", "beam-on-stop"])
def test_the_peak_has_no_part_of_what_turns_a_mismatch_round(name):
    """Degree 0 beside degree 2: the polynomials applied would have peaks that differ by 3e-3 and 1e-3."""
    scenes_of_degrees = (with_changes(load_scene(name), coupling={"degree": degree}) for degree in (0, 2))
    coarse, fine = (simulate(scene, check=False).summary["contact_force_max"] for scene in scenes_of_degrees)
    assert coarse == pytest.approx(fine, rel=1e-4)
