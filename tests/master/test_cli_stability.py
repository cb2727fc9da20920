"""``springbeam predict`` as a user meets it."""

from __future__ import annotations

import json

import pytest
from commands import command

from springbeam.scene import load_scene, with_changes
from springbeam.studies.stability.predict import predict

COARSE = ["--set", "beam.n_elements=10"]


@pytest.mark.parametrize("scene", ["soft", "steel-bumper", "duffing"])
def test_prediction_fits_80_columns(scene):
    arguments = COARSE if scene == "soft" else []
    result = command("predict", scene, *arguments)
    assert result.exit_code == 0
    assert max(map(len, result.stdout.splitlines())) <= 80
    assert ("critical H" in result.stdout) == (scene != "duffing")


def test_json_is_the_prediction():
    result = command("predict", "soft", *COARSE, "--json")
    printed = json.loads(result.stdout)
    expected = predict(with_changes(load_scene("soft"), beam={"n_elements": 10}))
    assert printed["omega_max"] == expected.omega_max
    assert printed["schemes"][3]["critical_step"] == expected.schemes[3].critical_step
    assert printed["auto"][:2] == ["hermite", 2]
