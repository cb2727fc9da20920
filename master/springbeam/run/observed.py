"""What a run shows of how well its macro steps follow the motion, for `springbeam.scene.resolution`."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

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
_NOT_SHOWN = (
    f"compliance_force is larger than {MOST_SHOWN:g} N at times and is written as that, tie_reaction with it; "
    "the motion does not depend on either. A smaller contact.stiffness or contact.exponent keeps them in range"
)


def mismatch(pair: Pair, steps: np.ndarray) -> float:
    """Return the largest |v_tip − z| [m/s] of ends that a rigid law joins."""
    if pair.law is not None:
        return 0.0
    return float(np.abs(steps["v_tip_after"] - steps["z_after"])[joined(steps)].max(initial=0.0))


def not_shown(scene: Scene, pair: Pair, steps: np.ndarray) -> str | None:
    """Return a warning if a compliance force beside a rigid law was too large for its column."""
    if pair.law is not None or pair.lasting or not scene.coupled:
        return None
    too_large = (normal_compliance(scene, steps["u_tip_after"], steps[:1]) > MOST_SHOWN).any()
    return _NOT_SHOWN if too_large else None


def why_not_resolved(scene: Scene, pair: Pair, H: float, steps: np.ndarray, events: Sequence[Event]) -> str | None:
    """Return in words why a run in steps of H [s] is not resolved; ``None`` if it is."""
    least = SHORT_IMPULSE * least_momentum(scene, pair, steps)
    lasted = shortest_contact(steps, events, SHORT * H, least)
    sizes = steps["size"][steps["size"] > 0.0]
    late = float(np.sqrt(np.mean(sizes**3) / np.mean(sizes))) if scene.coupling.adaptive and len(sizes) else None
    return not_resolved(
        scene,
        misplaced(scene, pair, steps, events),
        shortest_contact=lasted,
        left_out=left_out(scene, steps),
        between_rows=between_rows(scene, steps),
        H=late,
    )


def least_momentum(scene: Scene, pair: Pair, steps: np.ndarray) -> float:
    """Return the smaller one of both bodies' largest momenta [kg·m/s], without waves that a beam carries.

    That of a body that does not move does not count; ∞ if there is none.
    """
    if not len(steps):
        return inf
    speeds = np.abs(steps["v_tip_after"]).max(), np.abs(steps["z_after"]).max()
    upper, lower = (body.mass * w if w else 0.0 for body, w in zip((pair.upper, pair.lower), speeds, strict=True))
    if scene.beam is not None:
        quarter = min(2.0 / slowest_frequency(scene.beam), scene.duration or inf)
        upper = max(upper, tip_inertia(scene.beam) * np.ptp(steps["u_tip"]) / quarter)
    return min((float(momentum) for momentum in (upper, lower) if momentum > 0.0), default=inf)
