"""Lets the tests of this folder import their helper module by name; the pair and each FMU alone."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from importers import SIZE, System


@pytest.fixture
def system(
    request: pytest.FixtureRequest,
    fmu_folder: Path,
    tmp_path: Path,
    reference: np.ndarray,
    master_run: dict[float, np.ndarray],
) -> System:
    """That of the parameter, or the pair."""
    name = getattr(request, "param", "pair")
    return System(name, fmu_folder, tmp_path / "extracted", reference, master_run[SIZE])
