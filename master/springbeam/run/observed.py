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
    CONTACT_STEPS,
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
#: A stroke on the foundation, which reverses the velocities, amplifies what is late as so many contacts.
_OF_STROKE = 2
#: Places in a step where the law is asked, and their shares: Gauss points, so many because a law that opens has a kink.
_POINTS, _SHARES = np.polynomial.legendre.leggauss(16)
_INSIDE = 0.5 * (_POINTS + 1.0), 0.5 * _SHARES


class Observed(NamedTuple):
    """What the records of a run tell; all 0 where there is nothing of it."""

    speed: float = 0.0  #: the largest of an end [m/s]
    mismatch: float = 0.0  #: |v_tip − z| of ends that a rigid law joins [m/s]
    mismatch_at_events: float = 0.0  #: impulse μ |v_tip − z| where they part or strike, over the momentum
    jitter: float = 0.0  #: of rows where the ends are joined, as far as the mismatch makes it, over the way of an end
    momentum: float = inf  #: the smaller one of both bodies at their largest [kg·m/s]
    contact_frequency: float = 0.0  #: √(k (1/m_tip + 1/m)) of a soft contact at its stiffest [rad/s]
    late: float = 0.0  #: by which the steps make a soft contact late, all together [s]
    missed: float = 0.0  #: impulse by which the force of the steps misses a soft law, over the momentum of a body
    contacts: int = 1  #: how many, with the strokes, `_OF_STROKE` times; those within a macro step are one
    hidden: bool = False  #: whether a compliance force was too large for its column


def observed(scene: Scene, pair: Pair, steps: np.ndarray, events: Sequence[Event]) -> Observed:
    """Return what all records and events of a run show."""
    if not len(steps):
        return Observed()
    v, z = steps["v_tip_after"], steps["z_after"]
    speed, apart = float(np.abs([v, z]).max()), np.abs(v - z)
    momentum = min((momentum for momentum in _momenta(scene, pair, steps) if momentum > 0.0), default=inf)
    met = [event for event in events if event.kind.strikes or event.kind is EventKind.IMPACT]
    apart_in_time = np.diff([event.time for event in met], prepend=-np.inf) > (scene.coupling.macro_step or 0.0)
    contacts = int(apart_in_time @ [_OF_STROKE if event.kind.strikes else 1 for event in met]) if met else 1
    if pair.law is not None:
        # A link whose ends move as one does not swing, however stiff.
        swings = not pair.lasting or float(apart.max()) > VIBRATION * speed
        frequency, late, missed = _of_soft_contact(scene, pair, pair.law, steps) if swings else (0.0, 0.0, 0.0)
        return Observed(
            speed,
            momentum=momentum,
            contact_frequency=frequency,
            late=late,
            missed=missed / momentum,
            contacts=contacts,
        )
    hidden = False
    if pair.joinable and not pair.lasting:
        hidden = bool((normal_compliance(scene, steps["u_tip_after"], steps[:1]) > MOST_SHOWN).any())
    mismatch, at_events = float(apart[joined(steps)].max(initial=0.0)), _mismatch_at_events(scene, pair, steps, events)
    jitter = _jitter(steps, scene.coupling.macro_step, mismatch) if scene.coupling.macro_step and mismatch else 0.0
    return Observed(speed, mismatch, at_events, jitter, momentum, contacts=contacts, hidden=hidden)


def why_not_resolved(
    scene: Scene, H: float, seen: Observed, steps: np.ndarray, events: Sequence[Event], *, free_at_end: bool
) -> str | None:
    """Return in words why a run in steps of H [s] that shows ``seen`` is not resolved; ``None`` if it is."""
    short, least = CONTACT_STEPS[scene.coupling.degree] * H, SHORT_IMPULSE * seen.momentum
    return not_resolved(
        scene,
        seen.mismatch_at_events,
        jitter=seen.jitter,
        shortest_contact=shortest_contact(steps, events, short, least, free_at_end=free_at_end),
        contact_frequency=seen.contact_frequency,
        late=seen.late,
        missed=seen.missed,
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


def _mismatch_at_events(scene: Scene, pair: Pair, steps: np.ndarray, events: Sequence[Event]) -> float:
    """Return the largest impulse μ |v_tip − z| by which joined ends disagree as they part or strike the foundation.

    It is over the momentum of the body that it would change the most. Either end of the last step counts: the mismatch
    alternates, and where the step is cut it may be small by chance. Strikes less than a macro step after another one
    are left out, and what happens at the start of a phase: they may be as slow as one likes.
    """
    strikes = np.array([event.kind.strikes for event in events], bool)
    let_go = [event.kind.opens or event.kind is EventKind.UNSEATED for event in events]
    counted = np.flatnonzero(strikes | np.array(let_go, bool))
    free, held = pair.reduced_mass(Phase()), pair.reduced_mass(Phase(seated=True))
    if held == 0.0 or not counted.size:
        return 0.0
    H = scene.coupling.macro_step or float(steps["size"].max())
    row = np.searchsorted(steps["events"], counted + 1.0)
    before = np.maximum(row - 1, 0)
    struck = strikes[counted]
    late = np.full(len(row), True)
    late[struck] = np.diff(steps["time"][row[struck]], prepend=-np.inf) > H
    made = np.cumsum(steps["size"] > 0.0)
    entered = np.diff(steps["phase"], prepend=steps["phase"][0]) != 0.0
    since = np.maximum.accumulate(np.where(entered, made, 0))
    row, before = (found[late & joined(steps)[before] & (made[row] > since[before])] for found in (row, before))
    apart = np.abs([steps["v_tip"][row] - steps["z"][row], steps["v_tip_after"][before] - steps["z_after"][before]])
    seated = steps["phase"][before] >= 3.0
    impulse = np.where(seated, held, free) * apart.max(axis=0, initial=0.0)
    of_tip, of_lower = (over.max(initial=0.0) for over in (impulse, impulse[~seated]))
    tip, lower = _momenta(scene, pair, steps)
    return max(float(of_tip / tip) if of_tip else 0.0, float(of_lower / lower) if of_lower else 0.0)


def _momenta(scene: Scene, pair: Pair, steps: np.ndarray) -> tuple[float, float]:
    """Return the largest momenta of the upper and of the lower body [kg·m/s], without waves that a beam carries."""
    speeds = np.abs(steps["v_tip_after"]).max(), np.abs(steps["z_after"]).max()
    upper, lower = (body.mass * w if w else 0.0 for body, w in zip((pair.upper, pair.lower), speeds, strict=True))
    if scene.beam is not None:
        quarter = min(2.0 / slowest_frequency(scene.beam), scene.duration or inf)
        upper = max(upper, tip_inertia(scene.beam) * np.ptp(steps["u_tip"]) / quarter)
    return float(upper), float(lower)


def _of_soft_contact(scene: Scene, pair: Pair, law: SoftLaw, steps: np.ndarray) -> tuple[float, float, float]:
    """Return the frequency at the deepest penetration, also inside steps, `Observed.late` and the impulse missed [N·s].

    A law that never opens is linear: how deep does not matter, and its impulse is that of the mean penetration.
    """
    made = np.flatnonzero(steps["size"] > 0.0)
    before, step, size = steps[made - 1], steps[made], steps["size"][made]
    start, end = before["y_after"] - before["u_tip_after"], step["y"] - step["u_tip"]
    means = (step["y_integral"] - step["u_tip_integral"]) / size
    twice = (step["y_integral_2"] - step["u_tip_integral_2"]) / size**2
    deepest, touching = np.maximum(start, end), slice(None)
    if law.one_sided:
        rates = before["z_after"] - before["v_tip_after"], step["z"] - step["v_tip"]
        path: Any = Path.through((start, rates[0]), (end, rates[1]), size, (means, twice))  # type: ignore[arg-type]
        asked = np.zeros(len(step))  # by the law, of each step [N·s]
        for s, share in zip(*_INSIDE, strict=True):
            p, rate = path.at(s), path.slope(s) / size
            closed = np.flatnonzero(p > 0.0)
            asked[closed] += share * size[closed] * [law.force(p[i], rate[i]) for i in closed]
            deepest = np.maximum(deepest, p)
        touching = deepest > 0.0
    else:
        asked = size * [law.force(*both) for both in zip(means, (end - start) / size, strict=True)]
    missed = float(np.linalg.norm(asked - impulse(step, size)))
    inverse_mass = sum(1.0 / body.mass for body in (pair.upper, pair.lower) if body.mass > 0.0)
    turns = np.sqrt([inverse_mass * law.slope(p) for p in deepest[touching]]) * size[touching]
    late = float((size[touching] * lateness(scene, turns)).sum())
    return sqrt(law.slope(float(deepest.max(initial=0.0))) * inverse_mass), late, missed
