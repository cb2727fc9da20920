"""The results of a run in words, for a terminal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..results.totals import LOSS_NAMES, TOTALS


def totals_in_words(summary: Mapping[str, Any]) -> list[str]:
    """Return what the run amounts to (`springbeam.results.totals`), a line per subject."""
    lines = []
    if "contact_impulse" in summary:
        found = {name: f"{summary[name]:.4g} {unit}" for name, (_, unit) in TOTALS.items() if name in summary}
        parts = [
            f"impulse {found['contact_impulse']}",
            f"peak force {found['contact_force_max']} (mean over {found['contact_force_window']}; docs/contact.md)",
        ]
        lines.append(f"contact   {', '.join(parts)}")
        parts = []
        if summary.get("contact_duration_total"):
            parts.append(f"longest {found['contact_duration']}, in all {found['contact_duration_total']}")
        if "rebound_velocity" in summary:
            parts.append(f"the tip leaves at {found['rebound_velocity']}")
        if parts:
            lines.append(f"          {'; '.join(parts)}")
    if "deepest_tip" in summary:
        lines.append(f"tip       deepest at {summary['deepest_tip']:.4g} m, t = {summary['deepest_tip_time']:.4g} s")
    if "stop_strokes" in summary:
        strokes = "1 stroke" if summary["stop_strokes"] == 1 else f"{summary['stop_strokes']} strokes"
        lines.append(f"stop      {strokes}, impulse {summary['foundation_impulse']:.4g} N·s")
    lost = [f"{summary[name]:.4g} J by {words}" for name, words in LOSS_NAMES.items() if summary.get(name)]
    if lost:
        lines.append(f"lost      {', '.join(lost)}")
    return lines
