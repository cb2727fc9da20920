"""What Python programs call; ``springbeam.simulate`` and the others are these."""

from __future__ import annotations

from .results.files import load_trajectory as load
from .run.accuracy import simulate

__all__ = ["load", "simulate"]
