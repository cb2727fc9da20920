"""The benchmarks run (`./build.sh bench` measures); how fast anything is is no test."""

import importlib
import runpy
import sys
from pathlib import Path

import pytest

from springbeam import load_scene, with_changes
from springbeam.paper import monolithic

HERE = Path(__file__).parent
PAGE = HERE.parents[1] / "docs" / "performance.md"


@pytest.mark.parametrize("group", ["beam", "spring", "master", "profile", "paper", "accuracy", "sweep"])
def test_every_group_runs(group, fmu_folder, monkeypatch, capsys):
    if group in ("beam", "spring", "paper") and not (HERE.parents[1] / "build/tests/bench/beam_bench").exists():
        pytest.skip("the C++ benchmarks are not built: ./build.sh bench")
    before = PAGE.read_bytes()
    monkeypatch.setattr(sys, "argv", ["bench", "--quick", group])
    monkeypatch.syspath_prepend(HERE)
    runpy.run_path(str(HERE / "__main__.py"), run_name="__main__")
    rows = [line for line in capsys.readouterr().out.splitlines() if "measured" in line]
    assert rows
    assert not any("nan" in row or "inf " in row for row in rows)
    assert PAGE.read_bytes() == before


def test_algorithm_1_as_printed_has_the_same_numbers(monkeypatch):
    monkeypatch.syspath_prepend(HERE)
    printed = importlib.import_module("printed")
    scene = with_changes(load_scene("paper-fig2"), beam={"n_elements": 40}, time={"t_end": 0.7})
    ours, theirs = monolithic.simulate(scene), printed.simulate(scene)
    for name in ("u_tip", "v_tip", "y", "contact_force"):
        scale = abs(ours[name]).max()
        assert abs(ours[name] - theirs[name]).max() <= 1e-10 * scale, name
    assert ours.summary["newton"]["solves"] == theirs.summary["newton"]["solves"]
