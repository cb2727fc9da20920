"""The summary of a run: counts, residuals, warnings and results, as they go into ``summary.json``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..bodies.protocol import Body
from ..results.columns import not_shown
from ..results.contacts import contacts
from ..results.dense import inside
from ..results.recording import Recorder
from ..results.totals import totals
from .contradictions import PLACES, contradictions
from .master import Master
from .peaks import depends_on_mesh, force_window
from .stepping import Pair

#: How every warning of a run that is not resolved begins.
NOT_RESOLVED = "not resolved"
#: Largest error of an end between the rows, as a share of its motion (`springbeam.results.dense.inside`): where
#: waves turn by more than 2π in a step, up to half of the error.
BETWEEN_ROWS = 0.005
_SHORTER = "take a shorter macro step that is not a whole period of a body"


def summary(master: Master, recorder: Recorder, slowest: float = 0.0, fastest: float = 0.0) -> dict[str, Any]:
    """Return the summary of what ``recorder`` has of the run.

    ``resolved`` is ``False`` where the run shows alone that it is not, else ``None``: a companion run says it
    (`springbeam.run.companion.check`). ``slowest`` and ``fastest`` are those of `springbeam.run.peaks`.
    """
    scene = recorder.scene
    steps = recorder.steps()
    pair = master.pair
    known = int(steps["events"][-1]) if len(steps) else 0  # a full disk may have events without their records
    events = recorder.events()[:known]
    made = int(np.count_nonzero(np.diff(steps["time"])))
    energies, warnings, changed = master.balance.report(steps)
    places, between = inside(pair.law is None, steps, *PLACES) if len(steps) else ({}, 0.0)
    window = None if pair.law is not None else force_window(pair, steps, slowest)
    amounts = totals(scene, steps, events, window, places["u_tip"]) if len(steps) else {}
    warnings += [said for body in pair.bodies for said in body.warnings]
    doubts = [f"{what}: an event was missed; {_SHORTER}" for what in contradictions(
        pair.setup, steps, events, amounts.get("contact_duration_total", 0.0), places
    )]  # fmt: skip
    if between > BETWEEN_ROWS:
        doubts.append(
            f"between the rows an end may have an error of {100.0 * between:.2g} % of its motion, since it oscillates "
            "within a step; take a shorter one"
        )
    others = [not_shown(scene, steps), _coarse_force(pair)]
    if window is not None:
        others.append(depends_on_mesh(pair, window, fastest))
    if scene.coupled and scene.contact.damped and not scene.contact.lasting:
        closing = max((each.closing for each in contacts(scene, steps, events, None)), default=0.0)
        others.append(scene.contact.doubted(closing))
    warnings += filter(None, others)
    warnings += [f"{NOT_RESOLVED}: {doubt}" for doubt in doubts]
    return {
        "degree": pair.setup.degree,
        "time": float(steps["time"][-1]) if len(steps) else master.state.time,
        "macro_steps": made,
        "events": len(events),
        "halved_steps": master.state.halvings,
        "iterations": pair.joined.state.iterations,
        **energies,
        "resolved": False if doubts or changed else None,
        "warnings": warnings,
        **amounts,
    }


def _coarse_force(pair: Pair) -> str | None:
    """Return a warning that names a body of unknown acceleration or damping, so that C is that of the steps."""
    silent = _tables_of(pair, pair.without_acceleration)
    if not silent:
        return None
    return (
        f"the body in {silent} does not say its acceleration, or how damping changes it; the force "
        "between joined ends, and when they part, is only as exact as the force of a step: name its variable in "
        "acceleration, or take a smaller coupling.macro_step"
    )


def _tables_of(pair: Pair, bodies: Sequence[Body]) -> str:
    """Return the tables of ``bodies`` in words."""
    tables = zip(("[beam]", "[spring]"), pair.bodies, strict=True)
    return " and ".join(table for table, body in tables if body in bodies)
