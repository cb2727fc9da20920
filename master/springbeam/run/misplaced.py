"""Distance of the ends from their positions under the contact law and the loads.

A soft law demands a force along the path of the ends; the step applies a polynomial of degree d. A tie demands no gap
along the path; the step leaves none at its end. Both bodies and the law, linearised about the run, give the
displacement of the ends by the difference (``docs/coupling.md``, "How far ends are misplaced"). The causes are one file
each in `springbeam.run.errors`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise, repeat
from math import inf, sqrt
from typing import Any, NamedTuple

import numpy as np

from ..motion.events import Event
from .errors.ends import Ends, Terms
from .errors.loads import left_out
from .errors.records import StepRecords
from .errors.soft import defect_of_law, defect_of_tip
from .errors.strokes import Strokes, strokes
from .errors.tie import tie
from .loads import ON_BEAM, ON_SPRING
from .stepping import Pair

#: A tip that moves less than this share of the beam's largest deflection does not move: it is held, or loads balance.
HELD = 1e-9
#: Relative error of an end from which on nothing more can be learnt.
_LOST = 1e3
#: A contact that turns by more than √(2 × this) [rad] in a part of a step is not followed by a cubic.
_FOLLOWED = 1.0
#: A gap inside a step, or what a load adds, that is this share of the motion of an end does not count.
_QUIET = 1e-8
#: Most steps whose terms are moved at once, to bound the memory.
_TOGETHER = 256


class Known(NamedTuple):
    """What all causes need of a run: its steps, and how its ends answer."""

    steps: StepRecords
    ends: Ends
    stiffness: np.ndarray  #: of the lower body over its mass, in each step [1/s²]
    events: Sequence[Event]
    strokes: Strokes
    loads: list[tuple[Any, ...]] | None  #: `_by_loads`

    def rows(self, *columns: np.ndarray) -> list[tuple[Any, ...]]:
        """Return the load and the values of ``columns`` of each step."""
        return list(zip(self.loads or repeat(None), *(values.tolist() for values in columns), strict=False))

    def stretches(self, apart: np.ndarray) -> Iterator[tuple[slice, bool]]:
        """Yield stretches of steps, and whether nothing acts in them: ends are ``apart``, no stroke, no load."""
        nothing = apart & (self.strokes.share == 1.0) & (self.strokes.most == 0.0) & (self.loads is None)
        changes = (np.flatnonzero(np.diff(nothing)) + 1).tolist()
        for begin, end in pairwise(sorted({*changes, *range(0, len(apart), _TOGETHER), len(apart)})):
            yield slice(begin, end), bool(nothing[begin])


def misplaced(pair: Pair, records: np.ndarray, events: Sequence[Event]) -> float | None:
    """Return the distance of an end from its position under the law of ``pair``, over its largest one from its start.

    It is the largest of both ends and of all rows, with a tie also between rows. ``None`` where a body does not say how
    it answers a force.
    """
    upper = pair.upper
    lower = pair.lower
    modes = upper.modes()
    stiffness = lower.stiffness(0.5 * (records["y"] + np.append(0.0, records["y_after"][:-1])))
    if modes is None or stiffness is None or lower.damping is None:
        return None
    if not records["size"].any():
        return 0.0
    steps = StepRecords.of(records)
    duration = float(np.ptp(records["time"]))
    ends = Ends(modes, lower.mass, lower.damping, duration)
    ranges = [float(np.abs(records[name] - records[name][0]).max()) for name in ("u_tip_after", "y_after")]
    ranges = [moved if moved > HELD * upper.reach else inf for moved in ranges]
    quiet = _QUIET * min(ranges)
    by_loads = _by_loads(pair, ends.terms, steps, duration, quiet)
    if by_loads is None and pair.law is None and upper.mass == inf:
        return 0.0
    made = np.broadcast_to(stiffness, len(records))[records["size"] > 0.0]
    per_mass = made * ends.per_mass if ends.per_mass > 0.0 else np.zeros(len(made))  # of a wall ∞, and no mass
    run = Known(steps, ends, per_mass, events, strokes(pair.interface, steps, events), by_loads)
    degree = pair.joined.degree
    fastest = float(np.abs(ends.terms.rates.imag).max(initial=0.0))
    # A force of a higher degree has the law's mean over a step.
    parts = steps.parts(1 if degree == 0 else 2, fastest, _in_contact(pair, records, ends))
    if pair.law is not None:
        errors = _under_forces(run, defect_of_law(pair.law, steps, parts))
    elif upper.massless:
        errors = _under_forces(run, defect_of_tip(upper, steps, parts))
    else:
        errors = _under_ties(run, steps.parts(degree + 2, fastest), pair.alone, quiet)
    found = 0.0
    for u, y in errors:
        found = max(found, abs(u) / ranges[0], abs(y) / ranges[1])
        if found > _LOST:
            break
    return found


def _in_contact(pair: Pair, records: np.ndarray, ends: Ends) -> float:
    """Return the frequency of both ends where a soft contact is deepest [rad/s]; 0 without one."""
    if pair.law is None:
        return 0.0
    deepest = float((records["y_after"] - records["u_tip_after"]).max())
    return sqrt(pair.law.slope(deepest) * (ends.mobility + ends.per_mass))


def _under_forces(run: Known, defect: np.ndarray) -> Iterator[tuple[float, float]]:
    """Yield the errors of both ends [m] along ``run``, whose steps apply forces with a ``defect``."""
    ends = run.ends
    parts = defect.shape[1]
    rows = run.rows(run.steps.size / parts, run.stiffness, defect, *run.strokes)
    for some, nothing in run.stretches(np.logical_not(defect.any(axis=(1, 2)))):
        if nothing:
            yield ends.fly(run.steps.size[some], run.stiffness[some])
            continue
        for load, H, k, of_parts, *stroke in rows[some]:
            for part in of_parts:
                _over_a_part(ends, H, k, *part)
                yield ends.u, ends.y
            if load is not None:
                ends.add(*load)
            ends.rebound(*stroke)
            yield ends.u, ends.y


def _over_a_part(ends: Ends, H: float, k: float, *means: float) -> None:
    """Advance ``ends`` by ``H`` [s] under a demand with ``means`` as of `springbeam.run.errors.soft`.

    The misplacement is the cubic through both ends of the part, and the demand grows with it linearly in time: of the
    fourth order, and symmetric in time, so that a lasting contact neither amplifies nor damps it. Where the contact
    turns too far for that (`_FOLLOWED`), the misplacement grows linearly over the part.
    """
    missed, stiffness, damping, missed_early, stiffness_early, damping_early = means
    apart = ends.y - ends.u
    rate = ends.z - ends.v
    _, gives = ends.drift(H, k, ends.per_mass)
    half = 0.5 * H * H
    shift = half * (missed_early - missed)
    if stiffness * gives > _FOLLOWED:
        follows = 0.5 * stiffness + damping / H
        ends.follow((missed + (0.5 * stiffness - damping / H) * apart, follows, 0.0), (shift, 0.0, 0.0))
        return
    # ∫ x ds and ∫ (s − 1/2) x ds of the cubic, by the misplacement and its rate at its beginning; of its end the rate
    # has the other sign in the first, the misplacement in the second.
    mean = 0.5 * apart + H * rate / 12.0
    tilt = -apart / 10.0 - H * rate / 120.0
    stiffer = 6.0 * (stiffness - stiffness_early)
    damped = 6.0 * (damping - damping_early)
    ends.follow(
        (
            missed + stiffness * mean + stiffer * tilt - damping * apart / H - damped * rate / 12.0,
            0.5 * stiffness + stiffer / 10.0 + damping / H,
            -H * (stiffness / 12.0 + stiffer / 120.0) + damped / 12.0,
        ),
        (
            shift - half * (2.0 * stiffness * tilt + (stiffer * mean - damping * rate - damped * apart / H) / 6.0),
            -half * (stiffness / 5.0 + (0.5 * stiffer + damped / H) / 6.0),
            half * (H * stiffness / 60.0 + (H * stiffer / 12.0 - damping) / 6.0),
        ),
    )


def _under_ties(run: Known, parts: int, alone: bool, quiet: float) -> Iterator[tuple[float, float]]:
    """Yield the errors of both ends [m] along ``run``, inside steps, too: they leave a gap and different velocities.

    ``alone`` says that the tip itself strikes the foundation; ``quiet`` is as of `tie`.
    """
    ends = run.ends
    found = tie(run.steps, run.events, parts, quiet)
    places = found.places
    held, held_after = (records["phase"] >= 3.0 for records in (run.steps.before, run.steps.last))
    rebound = ends.rebound_of_tip if alone else ends.rebound
    rows = run.rows(run.steps.size, run.stiffness, *run.strokes, *found[1:], held, held_after)
    for some, nothing in run.stretches(~(found.tied | found.tied_after | (found.pull != 0.0) | (found.meet > 0.0))):
        if nothing:
            yield ends.fly(run.steps.size[some], run.stiffness[some])
            continue
        for inside, row in zip(places[some], rows[some], strict=True):
            load, H, k, share, turns, most, tied, tied_after, apart, pull, meet, part, seated, seated_after = row
            per_mass = 0.0 if seated else ends.per_mass
            if not tied:
                ends.drift(H, k, per_mass)
            for deep, rate in inside:
                beyond, gives = ends.drift(H / len(inside), k, per_mass)
                ends.act((beyond + deep) / gives)
                ends.kick_apart(rate, per_mass)
                yield ends.y, ends.y  # between rows the tip takes the path of the lower end
            if load is not None:
                ends.add(*load)
            if share != 1.0:
                rebound(share, turns, most)
            if (tied or tied_after) and (most > 0.0 or tied != tied_after):
                # The foundation strikes each end by itself.
                ends.kick_apart(-apart, 0.0 if seated_after or most > 0.0 else ends.per_mass)
            if meet > 0.0:
                ends.bounce(meet, part, 0.0 if seated_after else ends.per_mass)
            if pull != 0.0:  # y passes Ψ, sooner or later, where the force pulls
                ends.kick(-pull * ends.y, per_mass)
            yield ends.u, ends.y


def _by_loads(
    pair: Pair, terms: Terms, steps: StepRecords, duration: float, quiet: float
) -> list[tuple[Any, ...]] | None:
    """Return what the parts of loads that the steps leave out add: to the terms of the tip, to u, v, y and z.

    ``None`` where they move no end by ``quiet`` [m].
    """
    loads = pair.setup.loads
    modes = pair.lower.modes(steps.last["y_after"])
    if not loads or modes is None:
        return None
    lower = Terms.of(modes, duration)
    of_tip = left_out([load for load in loads if load.on in ON_BEAM], pair.upper, terms, steps, quiet)
    of_low = left_out([load for load in loads if load.on in ON_SPRING], pair.lower, lower, steps, quiet)
    if not of_tip.any() and not of_low.any():
        return None
    shown = (*(terms.shown @ of_tip.T).real, *(lower.shown @ of_low.T).real)
    return list(zip(of_tip, *(values.tolist() for values in shown), strict=True))
