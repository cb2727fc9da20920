"""Fixtures for all tests."""

from __future__ import annotations

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def fmu_folder() -> Path:
    """The folder with the built FMUs."""
    folder = ROOT / "fmus"
    missing = [name for name in ("beam.fmu", "spring.fmu") if not (folder / name).is_file()]
    if missing:
        pytest.fail(f"{', '.join(missing)} not in {folder}: run ./build.sh fmus")
    return folder
