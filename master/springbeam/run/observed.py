"""What a run shows of how well its macro steps follow the motion, for `springbeam.scene.resolution`."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import NamedTuple

import numpy as np

from ..results.columns import MOST_SHOWN, normal_compliance
from ..results.dense import between_rows
from ..results.steps import joined
from ..results.totals import shortest_contact
from ..results.trajectory import Event
from ..scene import Scene
from ..scene.resolution import SHORT, SHORT_IMPULSE, not_resolved, slowest_frequency
from ..scene.statics import tip_inertia
from .averaged import left_out
from .misplaced import misplaced
from .stepping import Pair

#: Warning of a run in which a force was too large for its column.
NOT_SHOWN = (
    f"compliance_force is larger than {MOST_SHOWN:g} N at times and is written as that, tie_reaction with it; "
    "the motion does not depend on either. A smaller contact.stiffness or contact.exponent keeps them in range"
)


class Observed(NamedTuple):
    """What the records of a run tell; all 0 where there is nothing of it."""

    mismatch: float = 0.0  #: |v_tip − z| of ends that a rigid law joins [m/s]
    momentum: float = inf  #: the smaller one of both bodies at their largest [kg·m/s]
    misplaced: float = 0.0  #: how far an end is from where the law of the contact would have it, over its way
    hidden: bool = False  #: whether a compliance force was too large for its column


def observed(scene: Scene, pair: Pair, steps: np.ndarray, events: Sequence[Event]) -> Observed:
    """Return what all records and events of a run show."""
    if not len(steps):
        return Observed()
    momentum = min((momentum for momentum in _momenta(scene, pair, steps) if momentum > 0.0), default=inf)
    far = misplaced(scene, pair, steps, events)
    if pair.law is not None:
        return Observed(momentum=momentum, misplaced=far)
    hidden = False
    if scene.coupled and not pair.lasting:
        hidden = bool((normal_compliance(scene, steps["u_tip_after"], steps[:1]) > MOST_SHOWN).any())
    mismatch = float(np.abs(steps["v_tip_after"] - steps["z_after"])[joined(steps)].max(initial=0.0))
    return Observed(mismatch, momentum, far, hidden)


def why_not_resolved(
    scene: Scene, H: float, seen: Observed, steps: np.ndarray, events: Sequence[Event], *, free_at_end: bool
) -> str | None:
    """Return in words why a run in steps of H [s] that shows ``seen`` is not resolved; ``None`` if it is."""
    least = SHORT_IMPULSE * seen.momentum
    lasted = shortest_contact(steps, events, SHORT * H, least, free_at_end=free_at_end)
    sizes = steps["size"][steps["size"] > 0.0]
    late = float(np.sqrt(np.mean(sizes**3) / np.mean(sizes))) if scene.coupling.adaptive and len(sizes) else None
    return not_resolved(
        scene,
        seen.misplaced,
        shortest_contact=lasted,
        left_out=left_out(scene, steps),
        between_rows=between_rows(scene, steps),
        H=late,
    )


def _momenta(scene: Scene, pair: Pair, steps: np.ndarray) -> tuple[float, float]:
    """Return the largest momenta of the upper and of the lower body [kg·m/s], without waves that a beam carries."""
    speeds = np.abs(steps["v_tip_after"]).max(), np.abs(steps["z_after"]).max()
    upper, lower = (body.mass * w if w else 0.0 for body, w in zip((pair.upper, pair.lower), speeds, strict=True))
    if scene.beam is not None:
        quarter = min(2.0 / slowest_frequency(scene.beam), scene.duration or inf)
        upper = max(upper, tip_inertia(scene.beam) * np.ptp(steps["u_tip"]) / quarter)
    return float(upper), float(lower)
