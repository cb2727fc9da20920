"""Lets the tests of this folder import their helper module by name; the pair and each FMU alone."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from importers import SIZE, System


@pytest.fixture
def system(
    request,
    fmu_folder,
    tmp_path,
    reference,
    master_run,
):
    """That of the parameter, or the pair."""
    name = getattr(request, "param", "pair")
    return System(name, fmu_folder, tmp_path / "extracted", reference, master_run[SIZE])
