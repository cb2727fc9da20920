"""Where the importers are, and how they are called."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

CACHE = Path(
    os.environ.get("SPRINGBEAM_CACHE")
    or Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "springbeam"
)


def installed(name: str) -> Path:
    """The importer's folder; skips the test if it is not there."""
    folder = CACHE / name
    if not (folder / ".installed").is_file():
        pytest.skip(f"{name} is not in {CACHE}: ./build.sh interop installs it")
    return folder


def run(*command: str | Path, cwd: Path | None = None, env: dict[str, str] | None = None) -> str:
    """What the command printed; it must succeed."""
    done = subprocess.run(
        [str(c) for c in command],
        cwd=cwd,
        env={**os.environ, **(env or {})},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return done.stdout
