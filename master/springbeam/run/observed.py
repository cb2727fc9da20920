"""What a run shows of how well its macro steps follow the motion, for `springbeam.scene.resolution`."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, sqrt
from typing import Any, NamedTuple

import numpy as np

from ..contact.laws import SoftLaw
from ..contact.phases import Phase
from ..results.columns import MOST_SHOWN, normal_compliance
from ..results.paths import Path
from ..results.steps import impulse, joined
from ..results.totals import pace, shortest_contact
from ..results.trajectory import Event, EventKind
from ..scene import Scene
from ..scene.resolution import (
    SHORT_IMPULSE,
    VIBRATION,
    lateness,
    not_resolved,
    slowest_frequency,
)
from ..scene.statics import tip_inertia
from .stepping import Pair

#: Warning of a run in which a force was too large for its column.
NOT_SHOWN = (
    f"compliance_force is larger than {MOST_SHOWN:g} N at times and is written as that, tie_reaction with it; "
    "the motion does not depend on either. A smaller contact.stiffness or contact.exponent keeps them in range"
)
#: Steps before ends part whose forces tell how far these go up and down, and how many they must be.
_BEFORE, _LEAST = 8, 3
#: Places in a step where the law is asked, and their shares: Gauss points, so many because a law that opens has a kink.
_POINTS, _SHARES = np.polynomial.legendre.leggauss(16)
_INSIDE = 0.5 * (_POINTS + 1.0), 0.5 * _SHARES


class Observed(NamedTuple):
    """What the records of a run tell; all 0 where there is nothing of it."""

    speed: float = 0.0  #: the largest of an end [m/s]
    mismatch: float = 0.0  #: |v_tip − z| of ends that a rigid law joins [m/s]
    mismatch_at_events: float = 0.0  #: impulses μ |v_tip − z| where they part or strike, over the momentum
    alternation: float = 0.0  #: of the force before they part, at degree 0: impulse of a step over the momentum
    jitter: float = 0.0  #: of rows where the ends are joined, as far as the mismatch makes it, over the way of an end
    momentum: float = inf  #: the smaller one of both bodies at their largest [kg·m/s]
    contact_frequency: float = 0.0  #: √(k (1/m_tip + 1/m)) of a soft contact at its stiffest [rad/s]
    late: float = 0.0  #: by which the steps make a soft contact late, all together [s]
    missed: float = 0.0  #: impulse by which the force of the steps misses a soft law, over the momentum of a body
    misplaced: float = 0.0  #: distance by which that force misplaces the lower end, over the way of that
    contacts: float = 1.0  #: how many, and twice the strokes, each as far as it turns the lower end's momentum round
    hidden: bool = False  #: whether a compliance force was too large for its column


def observed(scene: Scene, pair: Pair, steps: np.ndarray, events: Sequence[Event]) -> Observed:
    """Return what all records and events of a run show."""
    if not len(steps):
        return Observed()
    v, z = steps["v_tip_after"], steps["z_after"]
    speed, apart = float(np.abs([v, z]).max()), np.abs(v - z)
    momenta = _momenta(scene, pair, steps)
    momentum = min((momentum for momentum in momenta if momentum > 0.0), default=inf)
    if pair.law is not None:
        # A link whose ends move as one does not swing, however stiff.
        swings = not pair.lasting or float(apart.max()) > VIBRATION * speed
        frequency, late, missed, misplaced = _of_soft_contact(scene, pair, pair.law, steps) if swings else (0.0,) * 4
        return Observed(
            speed,
            momentum=momentum,
            contact_frequency=frequency,
            late=late,
            missed=missed / momentum,
            misplaced=misplaced,
            contacts=_contacts(events, momenta[1]),
        )
    hidden = False
    if pair.joinable and not pair.lasting:
        hidden = bool((normal_compliance(scene, steps["u_tip_after"], steps[:1]) > MOST_SHOWN).any())
    mismatch = float(apart[joined(steps)].max(initial=0.0))
    at_events, alternation = _at_events(scene, pair, steps, events)
    jitter = _jitter(steps, scene.coupling.macro_step, mismatch) if scene.coupling.macro_step and mismatch else 0.0
    contacts = _contacts(events, momenta[1])
    return Observed(speed, mismatch, at_events, alternation, jitter, momentum, contacts=contacts, hidden=hidden)


def _contacts(events: Sequence[Event], momentum: float) -> float:
    """Return how many contacts amplify what is late; ``momentum`` is the largest of the lower end [kg·m/s].

    A stroke on the foundation reverses velocities and counts twice; one that dies out counts by its impulse.
    """
    impacts = sum(event.kind is EventKind.IMPACT for event in events)
    impulses = [abs(event.impulse_foundation) for event in events if event.kind.strikes]
    strokes = sum(min(passed / momentum, 1.0) if momentum > 0.0 else 1.0 for passed in impulses)
    return max(impacts + 2.0 * strokes, 1.0)


def why_not_resolved(
    scene: Scene, H: float, seen: Observed, steps: np.ndarray, events: Sequence[Event], *, free_at_end: bool
) -> str | None:
    """Return in words why a run in steps of H [s] that shows ``seen`` is not resolved; ``None`` if it is."""
    least = SHORT_IMPULSE * seen.momentum
    return not_resolved(
        scene,
        seen.mismatch_at_events,
        alternation=seen.alternation,
        jitter=seen.jitter,
        shortest_contact=shortest_contact(steps, events, H, least, free_at_end=free_at_end),
        contact_frequency=seen.contact_frequency,
        late=seen.late,
        missed=seen.missed,
        misplaced=seen.misplaced,
        contacts=seen.contacts,
        pace=pace(steps),
    )


def _jitter(steps: np.ndarray, H: float, mismatch: float) -> float:
    """Return by how much the rows of joined ends go up and down about a smooth curve, over the smaller way of an end.

    It is a sixteenth of the fourth difference of rows that are H [s] apart. A vibration that the steps follow may do
    the same; a ``mismatch`` of velocities [m/s], which parts the ends by mismatch H/4 inside a step, is then smaller.
    """
    whole = joined(steps) & (np.abs(steps["size"] - H) <= 1e-6 * H)
    five = joined(steps)[:-4] & whole[1:-3] & whole[2:-2] & whole[3:-1] & whole[4:]
    swing = np.abs(np.diff(steps["y"], 4))[five].max(initial=0.0) / 16.0
    way = min((way for way in (np.ptp(steps["u_tip"]), np.ptp(steps["y"])) if way > 0.0), default=inf)
    return float(min(swing, 0.25 * mismatch * H) / way)


def _at_events(scene: Scene, pair: Pair, steps: np.ndarray, events: Sequence[Event]) -> tuple[float, float]:
    """Return what is open where joined ends part or strike the foundation: the mismatch, the alternation of the force.

    The mismatch is the impulse μ |v_tip − z|, the root of the sum of all events' squares. Either end of the last step
    counts: the mismatch alternates, and where the step is cut it may be small by chance. Strikes less than a macro step
    after another one are left out, and what happens at the start of a phase: they may be as slow as one likes. At
    degree 0 the force decides when ends part, as far as some steps before tell how much it alternates (`_alternation`).
    Both are over the momentum of the body that they would change the most.
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
    made = np.cumsum(steps["size"] > 0.0)
    entered = np.diff(steps["phase"], prepend=steps["phase"][0]) != 0.0
    since = np.maximum.accumulate(np.where(entered, made, 0))
    kept = late & joined(steps)[before] & (made[row] > since[before])
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


def _of_soft_contact(scene: Scene, pair: Pair, law: SoftLaw, steps: np.ndarray) -> tuple[float, float, float, float]:
    """Return the frequency at the deepest penetration, also inside steps, the time late [s], and what the steps miss.

    That is the impulse [N·s], and how far the lower end is misplaced because the force of a step has the impulse of the
    law, but not its course: the steps' shares add up until the force falls again. A law that never opens is linear: how
    deep does not matter, and its mean over a step is that of the mean penetration, however weighted.
    """
    made = np.flatnonzero(steps["size"] > 0.0)
    before, step, size = steps[made - 1], steps[made], steps["size"][made]
    start, end = before["y_after"] - before["u_tip_after"], step["y"] - step["u_tip"]
    mean = (step["y_integral"] - step["u_tip_integral"]) / size
    early = 2.0 * (step["y_integral_2"] - step["u_tip_integral_2"]) / size**2  # its mean with the weight 2 (1 − τ/H)
    deepest, touching = np.maximum(start, end), slice(None)
    if law.one_sided:
        rates = before["z_after"] - before["v_tip_after"], step["z"] - step["v_tip"]
        path: Any = Path.through((start, rates[0]), (end, rates[1]), size, (mean, 0.5 * early))  # type: ignore[arg-type]
        # Means of the law's force in each step [N], the second with the weight.
        asked, asked_early = np.zeros((2, len(step)))
        for s, share in zip(*_INSIDE, strict=True):
            p, rate = path.at(s), path.slope(s) / size
            closed = np.flatnonzero(p > 0.0)
            forces = [law.force(p[i], rate[i]) for i in closed]
            asked[closed] += np.multiply(share, forces)
            asked_early[closed] += np.multiply(2.0 * (1.0 - s) * share, forces)
            deepest = np.maximum(deepest, p)
        touching = deepest > 0.0
    else:
        asked = np.array([law.force(*both) for both in zip(mean, (end - start) / size, strict=True)])
        asked_early = np.array([law.force(*both) for both in zip(early, 2.0 * (mean - start) / size, strict=True)])
    missed = float(np.linalg.norm(size * asked - impulse(step, size)))
    rate, bend = step["contact_force_rate"], step["contact_force_rate_2"]
    applied_early = step["contact_force"] + size * (rate / 3.0 + size * bend / 12.0)
    way = float(np.ptp(steps["y_after"]))
    too_far = np.abs(np.cumsum(0.5 * size**2 * (applied_early - asked_early))).max(initial=0.0)
    misplaced = float(too_far / (way * pair.lower.mass)) if way > 0.0 else 0.0
    inverse_mass = sum(1.0 / body.mass for body in (pair.upper, pair.lower) if body.mass > 0.0)
    turns = np.sqrt([inverse_mass * law.slope(p) for p in deepest[touching]]) * size[touching]
    late = float((size[touching] * lateness(scene, turns)).sum())
    return sqrt(law.slope(float(deepest.max(initial=0.0))) * inverse_mass), late, missed, misplaced
