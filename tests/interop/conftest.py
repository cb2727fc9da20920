"""Lets the tests of this folder import their helper module by name; the pair in our own hands, and its judge."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from importers import SIZE, by_hand


@pytest.fixture(scope="session")
def ours(fmu_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    """y at every step of the pair up to 0.4 s, exchanged by hand."""
    fmus = {name: fmu_folder / f"{name}.fmu" for name in ("beam", "spring")}
    return by_hand(fmus, tmp_path_factory.mktemp("pair"))


@pytest.fixture(scope="session")
def judge(reference: np.ndarray, master_run: dict[float, np.ndarray]) -> Callable[[np.ndarray], None]:
    """y at 1 … 400 ms is as near to the event-driven solution as `springbeam run` with H = 1 ms, and near to that."""
    of_master = master_run[SIZE]

    def check(y: np.ndarray) -> None:
        n = len(y)
        assert n >= 399
        error, difference = np.abs(y - reference[:n]).max(), np.abs(y - of_master[:n]).max()
        print(f"error {error:.3e} m, from springbeam run {difference:.3e} m")
        assert error < 1.1 * np.abs(of_master - reference).max()
        assert difference < 4e-5  # the first step, whose tip is foreseen by its mean velocity over two

    return check
