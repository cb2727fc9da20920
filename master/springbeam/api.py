"""What Python programs call; ``springbeam.simulate`` and the others are these."""

from __future__ import annotations

from .studies.accuracy import simulate

__all__ = ["simulate"]
