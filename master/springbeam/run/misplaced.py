"""Distance of the ends from their positions under the contact law.

A soft law demands a force along the path of the ends; the step applies a polynomial of degree d. A tie demands no gap
along the path; the step leaves none at its end. Both bodies and the law, linearised about the run, give the
displacement of the ends by the difference (``docs/coupling.md``, "How far ends are misplaced"). The beam is the sum of
the modes of its mesh.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial
from itertools import product
from math import inf
from typing import Any, NamedTuple

import numpy as np

from ..bodies.protocol import Body, Modes
from ..contact.interface import Interface
from ..motion.events import Event, EventKind
from ..motion.paths import Path, derivative, value
from ..results.distance import HELD
from ..results.steps import force as applied
from ..results.steps import joined
from ..scene.laws import SoftLaw
from ..scene.loads import Load, TableLoad
from .loads import ON_BEAM, ON_SPRING
from .stepping import Pair

#: Points of a step at which a law is evaluated, and their weights: Gauss points.
_POINTS, _SHARES = np.polynomial.legendre.leggauss(4)
_INSIDE = 0.5 * (_POINTS + 1.0), 0.5 * _SHARES
#: Relative error of an end from which on nothing more can be learnt.
_LOST = 1e3
#: A gap inside a step, or what a load adds, that is this share of the motion of an end does not count.
_QUIET = 1e-8
#: Radians of a term, or lines of a table, per point of the quadrature of a load over a step; its points, at least and
#: at most.
_DENSE = 1.0
_OF_LOAD = (8, 96)
#: Slowest terms of a body that loads move, and steps of one array, which so needs little memory.
_MOVED = 40
_TOGETHER = 1024


def misplaced(pair: Pair, steps: np.ndarray, events: Sequence[Event]) -> float | None:
    """Return the distance of an end from its position under the law of ``pair``, over its largest one from its start.

    It is the largest of both ends and of all rows, with a tie also between rows. ``None`` where a body does not say how
    it answers a force.
    """
    upper = pair.upper
    lower = pair.lower
    modes = upper.modes()
    y = 0.5 * (steps["y"] + np.append(0.0, steps["y_after"][:-1]))
    stiff = lower.stiffness(y)
    damping = lower.damping
    if modes is None or stiff is None or damping is None:
        return None
    if not steps["size"].any():
        return 0.0
    held = HELD * upper.reach
    moved = (float(np.abs(steps[name] - steps[name][0]).max()) for name in ("u_tip_after", "y_after"))
    ways = [way if way > held else inf for way in moved]
    duration = float(np.ptp(steps["time"]))
    ends = _Errors(_Terms.of(modes, duration), lower.mass, damping)
    by_loads = _by_loads(pair, ends.terms, steps, _QUIET * min(ways))
    if by_loads is None and pair.law is None and upper.mass == inf:
        return 0.0
    stiffness = ends.per_mass * np.broadcast_to(stiff, len(steps)) if ends.per_mass > 0.0 else np.zeros(len(steps))
    run = _Run(ends, steps, stiffness, _after_events(pair.interface, steps, events), by_loads)
    if pair.law is not None:
        errors = _along_soft_law(run, pair.joined.degree, partial(_soft_force, pair.law), _penetration)
    elif upper.massless:
        together = joined(steps)[np.flatnonzero(steps["size"] > 0.0) - 1]
        errors = _along_soft_law(run, pair.joined.degree, partial(_tip_force, upper, together), _lower_path)
    else:
        errors = _along_tie(run, pair.joined.degree, pair.interface.alone, _QUIET * min(ways))
    found = 0.0
    for u, y in errors:
        found = max(found, abs(u) / ways[0], abs(y) / ways[1])
        if found > _LOST:
            break
    return found


class _Terms(NamedTuple):
    """The terms of the modes of a body, (n,) each.

    Each mode is c₊ exp(r₊ t) + c₋ exp(r₋ t), with r the roots of r² + 2 ζ ω r + ω² = 0; where these are conjugates one
    of the terms is kept and counts twice.
    """

    rates: np.ndarray  #: r [1/s]
    impulse: np.ndarray  #: what an impulse of 1 N·s at the end adds
    shown: np.ndarray  #: what the terms add to the displacement of the end
    stiffness: np.ndarray  #: ω² [1/s²]
    damping: np.ndarray  #: 2 ζ ω [1/s]
    mobility: float  #: of the end [1/kg]

    @classmethod
    def of(cls, modes: Modes, duration: float) -> _Terms:
        """Return those of ``modes``; a free mass is a mode so soft that it does not turn in ``duration`` [s]."""
        stiffness = np.maximum(modes[0], (1e-4 / duration) ** 2)
        decay = 0.5 * modes[1]
        tip = modes[2]
        root = np.sqrt(decay**2 - stiffness * (1.0 + 1e-12j))  # never 0
        creeps = decay**2 >= stiffness

        def both(first: np.ndarray, second: np.ndarray) -> np.ndarray:
            return np.concatenate([first, second[creeps]])

        impulse = 0.5 * tip / root
        return cls(
            both(root - decay, -(root + decay)),
            both(impulse, -impulse),
            both(np.where(creeps, 1.0, 2.0) * tip, tip),
            both(stiffness, stiffness),
            both(modes[1], modes[1]),
            float(tip @ tip),
        )


class _Run(NamedTuple):
    """A run, and how its ends answer forces."""

    ends: _Errors
    steps: np.ndarray
    stiffness: np.ndarray  #: of the lower body over its mass, of each step [1/s²]
    after: np.ndarray  #: `_after_events`
    by_loads: list[tuple[Any, ...]] | None  #: `_by_loads`


class _Errors:
    """Errors of the tip's ``u`` [m] and ``v`` [m/s], the sum of terms, and of the lower end's ``y`` and ``z``."""

    def __init__(self, terms: _Terms, mass: float, damping: float) -> None:
        self.terms = terms
        self._jump = terms.impulse * terms.rates  #: what a jump of the tip by 1 N·s² adds to the terms
        self._shown = np.array([terms.shown, terms.shown * terms.rates])  #: what the terms are of u and of v
        self._values = np.zeros(len(terms.rates), complex)
        self._pairs = self._values.view(float)
        self._moves = cache(self._move)
        self._added = np.zeros((3, len(self._pairs)))
        #: The force [N], the impulse [N·s] and the shift [N·s²] of this step that the terms do not have yet.
        self._due = [0.0, 0.0, 0.0]
        self.u = self.v = self.y = self.z = 0.0
        self.mobility = terms.mobility
        self._resisted = float((self._shown[1] @ self._jump).real)
        self.per_mass = 1.0 / mass if mass > 0.0 else 0.0
        self._resists = self.per_mass * damping

    def _move(self, H: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple[float, float], tuple[float, float]]:
        """Return what a step of ``H`` [s] makes of the terms, and of u and v in these.

        Further, in rows, what its end adds to the terms: of a constant force of 1 N, of an impulse of 1 N·s, and of
        1 N·s², which moves a free mass, of the modes that the step follows; and what force and shift add to u and v.
        """
        rates, impulse, _, stiffness, damping, _ = self.terms
        moved = np.exp(rates * H)
        pushed = impulse * np.expm1(rates * H) / rates
        follows = 1.0 / (1.0 + 0.5 * H * (damping + 0.5 * H * stiffness))
        shifted = moved * (self._jump + damping * impulse) * follows
        at_end = np.array([_reals(np.conj(row * moved)) for row in self._shown])
        added = np.array([_reals(terms) for terms in (pushed, impulse, shifted)])
        by_force, by_shift = ((self._shown @ terms).real.tolist() for terms in (pushed, shifted))
        return moved, at_end, added, by_force, by_shift

    def drift(self, H: float, stiffness: float, per_mass: float, shift: float = 0.0) -> tuple[float, float]:
        """Advance by ``H`` [s] without a force, the lower end by the midpoint rule.

        Return y − u at the end [m], and by how much `act` with 1 N reduces it. ``shift`` [N·s²] moves free masses
        besides. ``stiffness`` is the spring's over its mass [1/s²], ``per_mass`` that of the lower end [1/kg], 0 while
        the foundation holds it.
        """
        if any(self._due):
            self._pairs += np.array(self._due).dot(self._added)
        moved, at_end, self._added, self._by_force, by_shift = self._moves(H)
        self._due = [0.0, 0.0, shift]
        u, v = at_end.dot(self._pairs).tolist()
        self._values *= moved
        self.u = u + shift * by_shift[0]
        self.v = v + shift * by_shift[1]
        self.y -= shift * per_mass
        half = 0.5 * H
        slow = 1.0 / (1.0 + half * (self._resists + half * stiffness))
        mean = slow * (self.z - half * stiffness * self.y)
        self.y += H * mean
        self.z = 2.0 * mean - self.z
        faster = H * slow * per_mass
        self._lower = half * faster, faster
        return self.y - self.u, self._by_force[0] + half * faster

    def act(self, C: float) -> None:
        """Let the mean force ``C`` [N] act over the step of the last `drift`, too."""
        self._due[0] += C
        self.u += C * self._by_force[0]
        self.v += C * self._by_force[1]
        self.y -= C * self._lower[0]
        self.z -= C * self._lower[1]

    def take(self, terms: np.ndarray, u: float, v: float, y: float, z: float) -> None:
        """Add what a load does over the step of the last `drift`."""
        self._values += terms
        self.u += u
        self.v += v
        self.y += y
        self.z += z

    def strike(self, stays: float, turns: float, most: float) -> None:
        """Do to the lower end what `_after_events` says."""
        self.z = stays * self.z + max(-most, min(turns * self.y, most))
        self.y *= stays

    def strike_tip(self, stays: float, turns: float, most: float) -> None:
        """Do to the tip what `_after_events` says; the impulse that is earlier or later moves the beam besides."""
        jump = (stays - 1.0) * self.u / self.mobility
        change = (stays - 1.0) * self.v + max(-most, min(turns * self.u, most))
        self._values += jump * self._jump
        self.u *= stays
        self.v += jump * self._resisted
        self.push(change / self.mobility, 0.0)

    def meet(self, apart: float, per_mass: float) -> None:
        """Let v − z be ``apart`` [m/s] by an impulse; ``per_mass`` as of `advance`."""
        self.push((apart - self.v + self.z) / (self.mobility + per_mass), per_mass)

    def push(self, impulse: float, per_mass: float) -> None:
        """Let an ``impulse`` [N·s] lift the tip and press the lower end; ``per_mass`` as of `advance`."""
        self._due[1] += impulse
        self.v += impulse * self.mobility
        self.z -= impulse * per_mass


def _reals(values: np.ndarray) -> np.ndarray:
    """Return complex ``values`` as pairs of reals."""
    return np.ascontiguousarray(values).view(float)


#: Returns, of penetrations and their rates at one place in each step, the demanded force [N] and how it grows
#: with both [N/m], [N·s/m], (3, n).
_Asked = Callable[[np.ndarray, np.ndarray], np.ndarray]


def _along_soft_law(
    run: _Run, degree: int, asked_at: _Asked, path_of: Callable[..., Any]
) -> Iterator[tuple[float, float]]:
    """Yield the errors of both ends [m] along ``run``: the force of its steps is not the one that ``asked_at`` returns.

    ``path_of`` returns the path on which that depends.
    """
    ends, steps, stiffness, after, by_loads = run
    made = np.flatnonzero(steps["size"] > 0.0)
    step = steps[made]
    parts = 1 if degree == 0 else 2  # a force of a higher degree has the law's mean over a step
    defect = _defect(asked_at, path_of(steps[made - 1], step, step["size"]), step, parts)
    at_end = np.ones((3, len(step), parts)) * [[[1.0]], [[0.0]], [[0.0]]]
    at_end[..., -1] = np.multiply.reduceat(after[0], made), *np.add.reduceat(after[1:], made, axis=1)
    of_steps = [*np.repeat([step["size"] / parts, stiffness[made]], parts, axis=1), *at_end.reshape(3, -1), *defect]
    first = int(np.argmax(defect[0] != 0.0)) if by_loads is None else 0  # up to there nothing is wrong
    for number, (H, k, stays, turns, most, missed, early, stiffer, rate) in enumerate(
        zip(*(v[first:].tolist() for v in of_steps), strict=True), first + 1
    ):
        asked = missed + (0.5 * stiffer - rate / H) * (ends.y - ends.u)
        follows = 0.5 * stiffer + rate / H
        apart, gives = ends.drift(H, k, ends.per_mass, 0.5 * H * H * (early - missed))
        ends.act((asked + follows * apart) / (1.0 + follows * gives))
        if by_loads is not None and number % parts == 0:
            ends.take(*by_loads[made[number // parts - 1]])
        ends.strike(stays, turns, most)
        yield ends.u, ends.y


def _defect(asked_at: _Asked, path: Any, step: np.ndarray, parts: int) -> np.ndarray:
    """Return four means over equal parts of each step, (4, parts), one part after the other.

    They are the demanded force beyond that of the step, once evenly weighted and once by 2 (1 − s), s the
    share of the part [N], and how it grows with the penetration [N/m] and with its rate [N·s/m].
    """
    size = step["size"]
    found = np.zeros((4, len(step), parts))
    for part, (at, share) in product(range(parts), zip(*_INSIDE, strict=True)):
        s = (part + at) / parts
        force, *grows = asked_at(path.at(s), path.slope(s) / size)
        force = force - applied(step, s * size)
        found[..., part] += share * np.array([force, 2.0 * (1.0 - at) * force, *grows])
    return found.reshape(4, -1)


def _soft_force(law: SoftLaw, p: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Return `_Asked` of a soft ``law``."""
    found = np.zeros((3, len(p)))
    closed = np.flatnonzero((p > 0.0) | (not law.one_sided))
    for i, *both in zip(closed.tolist(), p[closed].tolist(), rate[closed].tolist(), strict=True):
        _, *slopes = law.resistance(*both) if law.damped else (0.0, 0.0, 0.0)
        found[:, i] = law.force(*both), law.slope(both[0]) + slopes[0], slopes[1]
    return found


def _tip_force(tip: Body, together: np.ndarray, y: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Return `_Asked` of a ``tip`` without mass that is joined to the lower end in the steps ``together``."""
    stiffness = np.full(len(y), tip.stiffness(0.0))
    damping = np.full(len(y), tip.damping)
    force = tip.holding_force(0.0, 0.0) + stiffness * y + damping * rate
    return np.asarray(together * [force, stiffness, damping])


def _along_tie(run: _Run, degree: int, alone: bool, quiet: float) -> Iterator[tuple[float, float]]:
    """Yield the errors of both ends [m] along ``run``, inside steps, too: they leave a gap and different velocities.

    ``alone`` says that the tip itself strikes the foundation. Steps whose gap stays below ``quiet`` [m] are whole.
    """
    ends, steps, stiffness, after, by_loads = run
    parts = degree + 2  # one more than the step has forces
    size = np.where(steps["size"] > 0.0, steps["size"], 1.0)
    path = _penetration(np.roll(steps, 1), steps, size)
    shares = (np.arange(parts) + 1.0) / parts
    inside = np.array([[path.at(s), path.slope(s) / size] for s in shares]).transpose(2, 0, 1)
    whole = (np.abs(inside[:, :, 0]).max(axis=1) <= quiet).tolist()
    tied = joined(steps)
    phase = steps["phase"]
    seated = phase >= 3.0
    releases = (phase == 1.0) & (np.append(phase[1:], 1.0) == 0.0)
    pulls = applied(steps, size) / np.where(steps["z"], steps["z"], inf)
    apart = steps["z_after"] - steps["v_tip_after"]
    strike = ends.strike_tip if alone else ends.strike
    held = seated.tolist()
    open_ = (~tied).tolist()
    rows = zip(steps["size"].tolist(), stiffness.tolist(), *after.tolist(), apart.tolist(), strict=True)
    next(rows)
    for i, (H, k, stays, turns, most, differ) in enumerate(rows, 1):
        per_mass = 0.0 if held[i - 1] else ends.per_mass
        if H > 0.0 and open_[i - 1]:
            ends.drift(H, k, per_mass)
        elif H > 0.0:
            places = inside[i, -1 if whole[i] else 0 :].tolist()
            for deep, rate in places:
                beyond, gives = ends.drift(H / len(places), k, per_mass)
                ends.act((beyond + deep) / gives)
                ends.meet(rate, per_mass)
                yield ends.y, ends.y  # between rows the tip takes the path of the lower end
        if by_loads is not None and H > 0.0:
            ends.take(*by_loads[i])
        if stays != 1.0:
            strike(stays, turns, most)
        if not (open_[i - 1] and open_[i]) and (most > 0.0 or open_[i - 1] != open_[i]):
            # The foundation strikes each end by itself.
            ends.meet(differ, 0.0 if held[i] or most > 0.0 else ends.per_mass)
        if releases[i - 1]:  # y passes Ψ, sooner or later, where the force pulls
            ends.push(-float(pulls[i]) * ends.y, per_mass)
        yield ends.u, ends.y


def _penetration(before: np.ndarray, step: np.ndarray, size: np.ndarray) -> Any:
    """Return the path of y − u inside each step of ``size`` [s], a `Path` of arrays."""
    start = before["y_after"] - before["u_tip_after"], before["z_after"] - before["v_tip_after"]
    end = step["y"] - step["u_tip"], step["z"] - step["v_tip"]
    moments = (step[f"y_{name}"] - step[f"u_tip_{name}"] for name in ("integral", "integral_2"))
    mean, twice = (moment / size**n for n, moment in enumerate(moments, 1))
    return Path.through(start, end, size, (mean, twice))  # type: ignore[arg-type]


def _lower_path(before: np.ndarray, step: np.ndarray, size: np.ndarray) -> Any:
    """Return the path of y inside each step of ``size`` [s], a `Path` of arrays."""
    start = before["y_after"], before["z_after"]
    means = step["y_integral"] / size, step["y_integral_2"] / size**2
    return Path.through(start, (step["y"], step["z"]), size, means)  # type: ignore[arg-type]


def _by_loads(pair: Pair, terms: _Terms, steps: np.ndarray, quiet: float) -> list[tuple[Any, ...]] | None:
    """Return what the parts of loads that the steps leave out add: to the terms of the tip, to u, v, y and z.

    Each step takes the projection of a load onto polynomials of degree 2 (`springbeam.run.loads`). What is left out
    hardly moves what is slow, but a mode that turns far in a step may be in resonance with it. ``None`` where they move
    no end by ``quiet`` [m].
    """
    loads = pair.setup.loads
    tip = [(load, pair.upper.moved_by(load)) for load in loads if load.on in ON_BEAM]
    low = [(load, pair.lower.moved_by(load)) for load in loads if load.on in ON_SPRING]
    of_lower = pair.lower.modes(steps["y_after"]) if low else None
    left_out = _left_out(tip, terms, steps, quiet)
    moved = np.zeros((2, len(steps)))
    if of_lower is not None:
        lower = _Terms.of(of_lower, float(np.ptp(steps["time"])))
        added = _left_out(low, lower, steps, quiet)
        if added is not None:
            moved = np.array([(added @ (lower.shown * lower.rates**n)).real for n in range(2)])
    if left_out is None and not moved.any():
        return None
    if left_out is None:
        left_out = np.zeros((len(steps), len(terms.rates)), complex)
    shown = [(left_out @ (terms.shown * terms.rates**n)).real.tolist() for n in range(2)]
    return list(zip(left_out, *shown, *moved.tolist(), strict=True))


def _left_out(loads: Sequence[tuple[Load, float]], terms: _Terms, steps: np.ndarray, quiet: float) -> np.ndarray | None:
    """Return what the part of ``loads`` that each step leaves out adds to the terms of a body, (len(steps), n).

    The loads come with the force that each unit of them is at the end [N].
    """
    size = steps["size"]
    slow = np.argsort(np.abs(terms.rates))[:_MOVED]
    loads = [(load, force) for load, force in loads if force > 0.0]
    if not loads:
        return None
    longest = float(size.max())
    turns = float(np.abs(terms.rates[slow]).max()) + max(_changes(load) for load, _ in loads)
    points = int(np.clip(_DENSE * turns * longest, *_OF_LOAD))
    nodes, shares = np.polynomial.legendre.leggauss(points)
    P = np.polynomial.legendre.legvander(nodes, 2)
    found = np.zeros((len(steps), len(terms.rates)), complex)
    moved = 0.0
    for first in range(0, len(steps), _TOGETHER):
        some = slice(first, first + _TOGETHER)
        half = 0.5 * size[some, None]
        left = half * (1.0 - nodes)
        signal = sum(force * load.value(steps["time"][some, None] - left) for load, force in loads)
        missing = (signal - (signal * shares) @ P * [0.5, 1.5, 2.5] @ P.T) * shares * half
        moved += float(np.abs(missing).sum())
        for k in slow.tolist():
            found[some, k] = terms.impulse[k] * (missing * np.exp(terms.rates[k] * left)).sum(axis=1)
    bound = moved * float(np.abs(terms.shown * terms.impulse)[slow].sum())
    return found if bound > quiet else None


def _changes(load: Load) -> float:
    """Return how many radians it turns, or lines of its table it has, in a second."""
    if isinstance(load, TableLoad):
        return len(load.record.x) / float(np.ptp(load.record.x))
    return load.rate


def _after_events(interface: Interface, steps: np.ndarray, events: Sequence[Event]) -> np.ndarray:
    """Return what the events at each of ``steps`` leave of the error of the end that is struck, (3, len(steps)).

    It is the share of displacement and velocity, none while the end is seated, and by how much each unit of
    displacement changes the velocity [1/s], at most by the jump of the stroke [m/s]: the end is struck earlier or
    later, under the acceleration before and after that.
    """
    shares = np.where(steps["phase"] >= 3.0, 0.0, 1.0)
    turns, most = np.zeros((2, len(steps)))
    struck = [n for n, event in enumerate(events, 1) if event.kind is EventKind.STOP_IMPACT]
    made = np.flatnonzero(steps["size"] > 0.0)
    if struck and len(made):
        rows = np.searchsorted(steps["events"], struck)
        e = interface.restitution
        np.multiply.at(shares, rows, -e)
        at = np.searchsorted(made, rows, side="right") - 1
        before = steps[made - 1]
        step = steps[made]
        speed = step["v_tip" if interface.alone else "z"][at]
        if interface.alone:  # no force acts on the tip before or after
            changed = (1.0 + e) * _last_acceleration(before[at], step[at])
        else:
            gained = (step["z"] - before["z_after"]) / step["size"]
            changed = e * gained[at] + np.append(gained, 0.0)[at + 1]
        turns[rows] = changed / np.where(speed, speed, inf)
        most[rows] = (1.0 + e) * np.abs(speed)
    return np.array([shares, turns, most])


def _last_acceleration(before: np.ndarray, step: np.ndarray) -> Any:
    """Return ü_tip at the end of each step [m/s²], of the path through both ends and the moments."""
    size = step["size"]
    start = (before["u_tip_after"], before["v_tip_after"])
    end = (step["u_tip"], step["v_tip"])
    means = step["u_tip_integral"] / size, step["u_tip_integral_2"] / size**2
    path = Path.through(start, end, size, means)  # type: ignore[arg-type]
    return value(derivative(derivative(path.powers)), 1.0) / size**2
