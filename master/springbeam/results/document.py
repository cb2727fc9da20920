"""JSON documents, as summaries and as what commands print."""

from __future__ import annotations

from typing import Any

from pydantic_core import to_json


def as_json(document: Any) -> bytes:
    """Return ``document`` as JSON; NaN and infinity become strings, because JSON has no such numbers."""
    return to_json(document, indent=2, inf_nan_mode="strings", fallback=lambda value: value.tolist())
