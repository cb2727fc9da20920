"""Critical macro steps: measured by the FMUs as predicted by the spectral radius."""

from __future__ import annotations

from dataclasses import asdict
from itertools import islice

import pytest
from commands import printed

from springbeam import with_changes
from springbeam.monolithic.semi_discrete import modal_beam
from springbeam.studies.stability.critical import Comparison, Critical, comparison, growth, linear_scene
from springbeam.studies.stability.linear import spectral_radius
from springbeam.studies.stability.predict import THRESHOLD, linear_pair


def compared(law: str, stiffness: float, scheme: str, degree: int, n: int = 4) -> Comparison:
    return comparison(linear_scene(law, stiffness, scheme, degree, n))


@pytest.mark.parametrize(
    ("law", "stiffness", "scheme", "degree"),
    [
        ("compliance", 1e8, "jacobi", 0),
        ("compliance", 1e8, "gauss_seidel", 0),
        ("compliance", 1e4, "jacobi", 1),
        ("compliance", 1e4, "gauss_seidel", 1),
        ("link", 1e4, "jacobi", 1),
        ("transmission", 1.0, "hermite", 1),
        ("transmission", 1.0, "hermite", 2),
    ],
)
def test_measured_as_predicted(law, stiffness, scheme, degree):
    """5 % are asked; growth over 4000 steps at the threshold is e⁴, told to some percent: 1 % of H."""
    c = compared(law, stiffness, scheme, degree, 2)
    assert c.measured == pytest.approx(c.predicted, rel=0.01)
    if scheme != "hermite":
        assert c.radius > 1.0 + THRESHOLD
        assert c.growth > 1.0 + THRESHOLD


@pytest.mark.parametrize(
    ("law", "stiffness", "degree"),
    [("compliance", 1e8, 0), ("compliance", 1e4, 1), ("compliance", 1e4, 2), ("transmission", 1.0, 0)],
)
def test_energy_is_stable_where_ordinary_exchanges_are_not(law, stiffness, degree):
    """λ = 1e8 N/m, H = 0.004 s, 4000 times the critical H of `jacobi`; rounding of the preload is 1e-6 per step."""
    c = compared(law, stiffness, "energy", degree)
    assert c.predicted is None
    assert c.radius == pytest.approx(1.0, abs=1e-12)
    assert c.growth == pytest.approx(1.0, abs=1e-6)


def test_growth_is_the_spectral_radius():
    """Above the threshold, where a power of ten is reached in some 400 steps."""
    c = compared("compliance", 1e4, "jacobi", 0)
    soft = linear_scene("compliance", 1e4, "jacobi", 0, 4)
    soft = with_changes(soft, coupling={"macro_step": 3.0 * c.predicted})
    pair = linear_pair(soft, modal_beam(soft.beam))
    radius = spectral_radius(pair, "jacobi", 0, soft.coupling.H)
    assert radius > 1.005
    assert growth(soft) - 1.0 == pytest.approx(radius - 1.0, rel=0.02)


def test_a_coupling_that_is_not_as_predicted_is_told():
    """Within 5 % of the predicted step they agree."""
    study = Critical()
    good = Comparison("transmission", "hermite", 1, 0.0, 1e-3, 1.01e-3, 1.0, 1.0)
    for other in (
        Comparison("compliance", "jacobi", 0, 1e4, 1e-4, 1.1e-4, 1.5, 1.5),
        Comparison("compliance", "jacobi", 0, 1e4, 1e-4, None, 1.5, 1.5),
        Comparison("compliance", "jacobi", 0, 1e4, 1e-4, 1e-4, 1.5, 1.0),
        Comparison("compliance", "energy", 0, 1e4, None, None, 1.0, 1.5),
    ):
        assert study.findings({"0": asdict(good)}).passed
        assert not study.findings({"0": asdict(good), "1": asdict(other)}).passed


def test_command(tmp_path, monkeypatch):
    some = dict(islice(Critical().cases().items(), 1))
    monkeypatch.setattr(Critical, "cases", lambda self: some)
    monkeypatch.setattr(Critical, "parallel", False)
    shown = printed("stability", "--critical", "--quick", "--out", tmp_path / "out")
    assert max(map(len, shown.splitlines()[:-1])) <= 80
    assert (tmp_path / "out" / "critical.csv").read_text().count("\n") == 2
