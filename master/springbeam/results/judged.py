"""What the summary of a judged run says of its errors, in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import isfinite
from typing import Any

#: What each part of `Distance` is in words, and the unit of its size where that is not a share.
WORDS = {
    "motion": "the motion",
    "times": "contact times",
    "impulses": "the impulses",
    "force": "the peak force",
    "velocities": "the velocities",
    "energies": "the energies",
}


def in_words(errors: Mapping[str, float], duration: float) -> Iterator[str]:
    """Yield each of relative ``errors`` of a run of a ``duration`` [s] in words, times in seconds."""
    for name in (name for name in WORDS if errors.get(name, 0.0) > 0.0):
        share = f"{errors[name]:.1e} of" if isfinite(errors[name]) else "beyond all measure:"
        yield f"{errors[name] * duration:.1e} s of {WORDS[name]}" if name == "times" else f"{share} {WORDS[name]}"


def judged_in_words(summary: Mapping[str, Any], duration: float) -> str | None:
    """Return what a ``summary`` says of the errors of its run of a ``duration`` [s]; ``None`` if nothing."""
    if (errors := summary.get("errors")) is not None:
        return f"at most {', '.join(in_words(errors, duration)) or 'rounding'} (measured beside {errors['beside']})"
    reason: str | None = summary.get("not_judged")
    return reason
