"""The recipe of docs/contributing.md: a new contact law is one class in the master, one in the references."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from bodies import simulate

from springbeam.contact import laws
from springbeam.monolithic import event_driven
from springbeam.monolithic import laws as references
from springbeam.scene import load_scene, with_changes

PAGE = Path(__file__).parents[2] / "docs" / "contributing.md"
BLOCKS = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.M | re.S)


@pytest.fixture
def stiffening(monkeypatch: pytest.MonkeyPatch) -> None:
    """The law of the page, in place of `compliance`: a scene names no other."""
    for block, module in zip(BLOCKS, (laws, references), strict=True):
        monkeypatch.setattr(module, "LAWS", dict(module.LAWS))
        exec(block, {**vars(module)})
        monkeypatch.setitem(module.LAWS, "compliance", module.LAWS["stiffening"])


def test_it_is_short() -> None:
    assert sum(len(block.splitlines()) for block in BLOCKS) < 60


@pytest.mark.usefixtures("stiffening")
def test_master_and_reference_agree_and_keep_the_energy() -> None:
    """Degree 2 on a beam of 6 elements: the reference's tolerance is 1e-11; p is past the knee √(k/h) = 1 cm."""
    scene = with_changes(
        load_scene("soft"),
        time={"t_end": 0.1},
        beam={"n_elements": 6},
        stop=None,
        contact={"law": "compliance", "stiffness": 300.0},
        coupling={"degree": 2, "macro_step": 2.5e-4},
    )
    run, exact = simulate(scene), event_driven.simulate(scene)
    assert (run.y - run.u_tip).max() > 0.01
    assert [e.kind for e in run.events] == [e.kind for e in exact.events]
    _, mine, theirs = np.intersect1d(run.time.round(12), exact.time.round(12), return_indices=True)
    assert len(mine) > 350
    for column in ("u_tip", "y"):
        assert np.abs(run[column][mine] - exact[column][theirs]).max() < 1e-9
    assert run.summary["max_energy_residual"] < 1e-12
