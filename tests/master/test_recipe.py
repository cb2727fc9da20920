"""The recipe of docs/contributing.md: a new contact law is one class in the master, one in the references."""

import re
from pathlib import Path

import numpy as np
import pytest

from springbeam import simulate
from springbeam.monolithic import event_driven
from springbeam.monolithic import laws as references
from springbeam.scene import Scene, laws, load_scene, with_changes
from springbeam.studies.linearised import contact_energy
from springbeam.studies.predict import predict

PAGE = Path(__file__).parents[2] / "docs" / "contributing.md"
BLOCKS = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.M | re.S)


@pytest.fixture
def stiffening(monkeypatch):
    """The law of the page, under its own name, as if it stood in the modules from the beginning."""
    for block, module, known in zip(BLOCKS, (laws, references), (laws.LAWS, references.REFERENCE_LAWS), strict=True):
        monkeypatch.setitem(known, "stiffening", None)  # taken out after the test
        exec(block, vars(module).copy())
    Scene.model_rebuild(force=True)
    yield
    monkeypatch.undo()
    Scene.model_rebuild(force=True)


def bumper():
    """A tip on the bumper, on a beam of 6 elements."""
    return with_changes(
        load_scene("soft"),
        time={"t_end": 0.1},
        beam={"n_elements": 6},
        stop=None,
        contact={"law": "stiffening", "stiffness": K},
        coupling={"degree": 2, "macro_step": 2.5e-4},
    )


#: k [N/m]; h = k/1e-4 m².
K = 300.0


@pytest.mark.usefixtures("stiffening")
def test_master_and_reference_agree_and_keep_the_energy():
    """Degree 2 on a beam of 6 elements: the reference's tolerance is 1e-11; p is past the knee √(k/h) = 1 cm."""
    scene = bumper()
    run = simulate(scene)
    exact = event_driven.integrate(scene)
    assert (run.y - run.u_tip).max() > 0.01
    assert [e.kind for e in run.events] == [e.kind for e in exact.events]
    _, mine, theirs = np.intersect1d(run.time.round(12), exact.time.round(12), return_indices=True)
    assert len(mine) > 350
    for column in ("u_tip", "y"):
        assert np.abs(run[column][mine] - exact[column][theirs]).max() < 1e-9
    assert run.summary["max_energy_residual"] < 1e-12


@pytest.mark.usefixtures("stiffening")
def test_its_frequency_is_its_own():
    """The energy at first contact goes into ½ k p² + ¼ h p⁴; there F′ = k + 3 h p²."""
    scene = bumper()
    h = K / 1e-4
    p2 = (np.sqrt(K * K + 4.0 * h * contact_energy(scene)) - K) / h  # p²
    found = predict(scene)
    assert found["contact_frequency"] == pytest.approx(
        np.sqrt((K + 3.0 * h * p2) * (1.0 / found["tip_mass"] + 1.0 / scene.spring.mass)), rel=1e-12
    )
