"""What a run shows of how well its macro steps follow the motion, for `springbeam.scene.resolution`."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import NamedTuple

import numpy as np

from ..contact.phases import Phase
from ..results.columns import MOST_SHOWN, normal_compliance
from ..results.steps import impulse, joined
from ..results.totals import shortest_contact
from ..results.trajectory import Event, EventKind
from ..scene import Scene
from ..scene.resolution import SHORT, SHORT_IMPULSE, not_resolved, slowest_frequency
from ..scene.statics import tip_inertia
from .misplaced import misplaced
from .stepping import Pair

#: Warning of a run in which a force was too large for its column.
NOT_SHOWN = (
    f"compliance_force is larger than {MOST_SHOWN:g} N at times and is written as that, tie_reaction with it; "
    "the motion does not depend on either. A smaller contact.stiffness or contact.exponent keeps them in range"
)
#: Steps before ends part whose forces tell how far these go up and down, and how many they must be.
_BEFORE, _LEAST = 8, 3


class Observed(NamedTuple):
    """What the records of a run tell; all 0 where there is nothing of it."""

    mismatch: float = 0.0  #: |v_tip − z| of ends that a rigid law joins [m/s]
    mismatch_at_events: float = 0.0  #: impulses μ |v_tip − z| where they part or strike, over the momentum
    alternation: float = 0.0  #: of the force before they part, at degree 0: impulse of a step over the momentum
    momentum: float = inf  #: the smaller one of both bodies at their largest [kg·m/s]
    misplaced: float = 0.0  #: how far an end is from where a soft law would have it, over its way
    hidden: bool = False  #: whether a compliance force was too large for its column


def observed(scene: Scene, pair: Pair, steps: np.ndarray, events: Sequence[Event]) -> Observed:
    """Return what all records and events of a run show."""
    if not len(steps):
        return Observed()
    momentum = min((momentum for momentum in _momenta(scene, pair, steps) if momentum > 0.0), default=inf)
    if pair.law is not None:
        return Observed(momentum=momentum, misplaced=misplaced(scene, pair, pair.law, steps, events))
    hidden = False
    if pair.joinable and not pair.lasting:
        hidden = bool((normal_compliance(scene, steps["u_tip_after"], steps[:1]) > MOST_SHOWN).any())
    mismatch = float(np.abs(steps["v_tip_after"] - steps["z_after"])[joined(steps)].max(initial=0.0))
    at_events, alternation = _at_events(scene, pair, steps, events)
    return Observed(mismatch, at_events, alternation, momentum, hidden=hidden)


def why_not_resolved(
    scene: Scene, H: float, seen: Observed, steps: np.ndarray, events: Sequence[Event], *, free_at_end: bool
) -> str | None:
    """Return in words why a run in steps of H [s] that shows ``seen`` is not resolved; ``None`` if it is."""
    least = SHORT_IMPULSE * seen.momentum
    return not_resolved(
        scene,
        seen.mismatch_at_events,
        alternation=seen.alternation,
        shortest_contact=shortest_contact(steps, events, SHORT * H, least, free_at_end=free_at_end),
        misplaced=seen.misplaced,
    )


def _at_events(scene: Scene, pair: Pair, steps: np.ndarray, events: Sequence[Event]) -> tuple[float, float]:
    """Return what is open where joined ends part or strike the foundation: the mismatch, the alternation of the force.

    The mismatch is the impulse μ |v_tip − z|, the root of the sum of all events' squares. Either end of the last step
    counts: the mismatch alternates, and where the step is cut it may be small by chance. Strikes less than a macro step
    after another one are left out: they may be as slow as one likes. At degree 0 the force decides when ends part, as
    far as some steps before tell how much it alternates (`_alternation`). Both are over the momentum of the body that
    they would change the most.
    """
    strikes = np.array([event.kind.strikes for event in events], bool)
    let_go = [event.kind.opens or event.kind is EventKind.UNSEATED for event in events]
    counted = np.flatnonzero(strikes | np.array(let_go, bool))
    free, held = pair.reduced_mass(Phase()), pair.reduced_mass(Phase(seated=True))
    if held == 0.0 or not counted.size:
        return 0.0, 0.0
    H = scene.coupling.macro_step or float(steps["size"].max())
    row = np.searchsorted(steps["events"], counted + 1.0)
    before = np.maximum(row - 1, 0)
    struck = strikes[counted]
    late = np.full(len(row), True)
    late[struck] = np.diff(steps["time"][row[struck]], prepend=-np.inf) > H
    kept = late & joined(steps)[before]
    row, before, struck = row[kept], before[kept], struck[kept]
    apart = np.abs([steps["v_tip"][row] - steps["z"][row], steps["v_tip_after"][before] - steps["z_after"][before]])
    seated = steps["phase"][before] >= 3.0
    tip, lower = (momentum or inf for momentum in _momenta(scene, pair, steps))
    momentum = np.where(seated, tip, min(tip, lower))
    mismatch = np.where(seated, held, free) * apart.max(axis=0, initial=0.0) / momentum
    alternation = np.full(len(row), np.nan)
    if scene.coupling.macro_step and pair.joined.degree == 0:
        alternation[~struck] = _alternation(steps, row[~struck], H, free, held) / momentum[~struck]
    unknown = np.isnan(alternation)
    return float(np.linalg.norm(mismatch[unknown])), float(alternation[~unknown].max(initial=0.0))


def _alternation(steps: np.ndarray, rows: np.ndarray, H: float, free: float, held: float) -> np.ndarray:
    """Return by how much the force that can only push alternates before each of ``rows``, as impulse of a step [N·s].

    It is the median over the last steps of a quarter of the force's second difference, without what turns a mismatch of
    velocities round; NaN where the ends were joined for too few steps. ``free`` is the reduced mass of the ends [kg],
    ``held`` that while the lower end is seated.
    """
    joined_before, seated = np.append(False, joined(steps)[:-1]), np.append(False, steps["phase"][:-1] >= 3.0)
    whole = (steps["size"] > 0.0) & joined_before
    size = np.where(whole, steps["size"], H)
    turned = np.append(0.0, (steps["v_tip_after"] - steps["z_after"])[:-1]) - (steps["v_tip"] - steps["z"])
    pushed = np.where(seated, impulse(steps, size, name="foundation_force"), impulse(steps, size))
    pushed = (pushed + np.where(seated, held, free) * turned) * H / size
    last_not = np.maximum.accumulate(np.where(whole, -1, np.arange(len(steps))))
    found = np.full(len(rows), np.nan)
    for i, row in enumerate(rows):
        end = row if whole[row] else row - 1
        since = max(last_not[end], end - _BEFORE) + 1
        if end + 1 - since >= _LEAST:
            found[i] = np.median(np.abs(np.diff(pushed[since : end + 1], 2))) / 4.0
    return found


def _momenta(scene: Scene, pair: Pair, steps: np.ndarray) -> tuple[float, float]:
    """Return the largest momenta of the upper and of the lower body [kg·m/s], without waves that a beam carries."""
    speeds = np.abs(steps["v_tip_after"]).max(), np.abs(steps["z_after"]).max()
    upper, lower = (body.mass * w if w else 0.0 for body, w in zip((pair.upper, pair.lower), speeds, strict=True))
    if scene.beam is not None:
        quarter = min(2.0 / slowest_frequency(scene.beam), scene.duration or inf)
        upper = max(upper, tip_inertia(scene.beam) * np.ptp(steps["u_tip"]) / quarter)
    return float(upper), float(lower)
