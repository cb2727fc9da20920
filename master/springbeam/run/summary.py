"""The summary of a run: counts, residuals, warnings and results, as they go into ``summary.json``."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..results.columns import not_shown
from ..results.dense import inside
from ..results.recording import Recorder
from ..results.totals import totals
from .contradictions import PLACES, contradictions
from .errors.peak import peak_beside_law
from .master import Master
from .misplaced import misplaced
from .observed import coarse_force, force_window, unknown
from .resolution import peak_force_doubt, why_not_resolved

_SHORTER = "take a shorter macro step that is not a whole period of a body"


def summary(master: Master, recorder: Recorder) -> dict[str, Any]:
    """Return the summary of what ``recorder`` has of the run."""
    scene = recorder.scene
    steps = recorder.steps()
    pair = master.pair
    known = int(steps["events"][-1]) if len(steps) else 0  # a full disk may have events without their records
    events = recorder.events()[:known]
    made = int(np.count_nonzero(np.diff(steps["time"])))
    energies, warnings, changed = master.balance.report(steps)
    displaced = misplaced(pair, steps, events)
    places, between = inside(pair.law is None, steps, *PLACES) if len(steps) else ({}, 0.0)
    unresolved = why_not_resolved(pair, steps, displaced or 0.0, between)
    window = force_window(pair, steps)
    amounts = totals(scene, steps, events, window, places["u_tip"]) if len(steps) else {}
    if pair.law is not None and amounts.get("contact_force_max"):
        of_window = (amounts[f"contact_force_{name}"] for name in ("max", "window", "max_time"))
        amounts["contact_force_max_error"] = peak_beside_law(pair.law, steps, *of_window)
    doubt = peak_force_doubt(pair, window, amounts.get("contact_force_max_error", 0.0))
    warnings += [said for body in pair.bodies for said in body.warnings]
    warnings += filter(None, [unresolved or doubt, not_shown(scene, steps), unknown(pair), coarse_force(pair)])
    ruled_out = contradictions(pair.setup, steps, events, amounts.get("contact_duration_total", 0.0), places)
    warnings += [f"not resolved: {what}: an event was missed; {_SHORTER}" for what in ruled_out]
    return {
        "degree": pair.setup.degree,
        "time": float(steps["time"][-1]) if len(steps) else master.state.time,
        "macro_steps": made,
        "events": len(events),
        "halved_steps": master.state.halvings,
        "iterations": pair.joined.state.iterations,
        **energies,
        "resolved": unresolved is None and not changed and not ruled_out,
        **({} if displaced is None else {"misplaced_ends": displaced}),
        "warnings": warnings,
        **amounts,
    }
