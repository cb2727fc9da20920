"""The benchmarks run (`./build.sh bench` measures); how fast anything is is no test."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
PAGE = HERE.parents[1] / "docs" / "performance.md"


@pytest.mark.parametrize("group", ["beam", "spring", "master", "profile", "paper", "long", "accuracy", "sweep"])
def test_every_group_runs(group: str, fmu_folder: Path) -> None:
    if group in ("beam", "spring", "paper") and not (HERE.parents[1] / "build/tests/bench/beam_bench").exists():
        pytest.skip("the C++ benchmarks are not built: ./build.sh bench")
    before = PAGE.read_bytes()
    run = subprocess.run([sys.executable, str(HERE), "--quick", group], stdout=subprocess.PIPE, text=True, check=True)
    rows = [line for line in run.stdout.splitlines() if "measured" in line]
    assert rows
    assert not any("nan" in row or "inf " in row for row in rows)
    assert PAGE.read_bytes() == before
