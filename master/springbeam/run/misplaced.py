"""How far the ends are from where the law of their contact would have them.

A soft law asks for a force along the path of the ends, the step applies a polynomial of degree d. A tie asks for no gap
along the path, the step leaves none at its end. Both bodies and the law, linearised about the run, tell how far the
difference moves the ends (``docs/coupling.md``, "How far ends are misplaced"). The beam is the sum of the modes of its
mesh.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial
from itertools import product
from math import inf
from typing import Any

import numpy as np

from ..bodies.protocol import Modes
from ..contact.interface import Interface
from ..motion.events import Event, EventKind
from ..motion.paths import Path
from ..results.distance import HELD
from ..results.steps import force as applied
from ..results.steps import joined
from ..scene.laws import SoftLaw
from .stepping import Pair

#: Places where a soft law is asked, and their shares: Gauss points.
_POINTS, _SHARES = np.polynomial.legendre.leggauss(4)
_INSIDE = 0.5 * (_POINTS + 1.0), 0.5 * _SHARES
#: Ways that an end is off from which on nothing more is to be learnt.
_LOST = 1e3


def misplaced(pair: Pair, steps: np.ndarray, events: Sequence[Event]) -> float | None:
    """Return how far an end is from where the law of ``pair`` would have it, over its largest distance from its start.

    It is that of the worse end at its worst, of a tie between the rows, too; 0 where a tie holds an end that nothing
    moves, or one without mass. ``None`` where a body does not say how it answers a force.
    """
    if not steps["size"].any() or (pair.law is None and not 0.0 < pair.upper.mass < inf):
        return 0.0
    held = HELD * pair.upper.reach
    moved = (float(np.abs(steps[name] - steps[name][0]).max()) for name in ("u_tip_after", "y_after"))
    ways = [way if way > held else inf for way in moved]
    modes = pair.upper.modes()
    y = 0.5 * (steps["y"] + np.append(0.0, steps["y_after"][:-1]))
    stiff = pair.lower.stiffness(y)
    damping = pair.lower.damping
    if modes is None or stiff is None or damping is None:
        return None
    ends = _Errors(modes, pair.lower.mass, damping)
    stiffness = ends.per_mass * np.broadcast_to(stiff, len(steps)) if ends.per_mass > 0.0 else np.zeros(len(steps))
    follow = _along_tie if pair.law is None else partial(_along_soft_law, pair.law)
    found = 0.0
    after = _after_events(pair.interface, steps, events)
    for u, y in follow(pair.joined.degree, ends, steps, stiffness, after):
        found = max(found, abs(u) / ways[0], abs(y) / ways[1])
        if found > _LOST:
            break
    return found


class _Errors:
    """Errors of the modes' displacements and velocities ``x``, (2, n), of the lower end's ``y`` [m] and ``z`` [m/s]."""

    def __init__(self, modes: Modes, mass: float, damping: float) -> None:
        self.tip, self._moves = modes[2], cache(partial(_moves, modes))
        self.x, self.y, self.z = np.zeros((2, len(self.tip))), 0.0, 0.0
        self.per_mass = 1.0 / mass if mass > 0.0 else 0.0
        self._resists = self.per_mass * damping

    @property
    def u(self) -> float:
        return float(self.tip @ self.x[0])

    def advance(
        self, H: float, stiffness: float, per_mass: float, force: Callable[[float, float], float], shift: float = 0.0
    ) -> None:
        """Advance by ``H`` [s] under a force that acts by its mean, the lower end by the midpoint rule.

        ``force`` [N] follows from how far the ends are apart without it, y − u [m], and from how far 1 N brings them
        together; ``shift`` [N·s²] moves free masses besides. ``stiffness`` is the spring's over its mass [1/s²],
        ``per_mass`` that of the lower end [1/kg], 0 while the foundation holds it.
        """
        free, pushed, flexible, shifted = self._moves(H)
        half = 0.5 * H
        slow = 1.0 / (1.0 + half * (self._resists + half * stiffness))
        self.x = free[:, 0] * self.x[0] + free[:, 1] * self.x[1]
        if shift != 0.0:
            self.x += shift * shifted
        self.y -= shift * per_mass
        mean = slow * (self.z - half * stiffness * self.y)
        C = force(self.y + H * mean - self.u, flexible + H * half * slow * per_mass)
        mean -= half * slow * per_mass * C
        self.x += C * pushed
        self.y, self.z = self.y + H * mean, 2.0 * mean - self.z

    def strike(self, stays: float, turns: float, most: float) -> None:
        """Do to the lower end what `_after_events` says."""
        self.y, self.z = stays * self.y, stays * self.z + max(-most, min(turns * self.y, most))

    def meet(self, apart: float, per_mass: float) -> None:
        """Let v − z be ``apart`` [m/s] by an impulse; ``per_mass`` as of `advance`."""
        v = float(self.tip @ self.x[1])
        self.push((apart - v + self.z) / (float(self.tip @ self.tip) + per_mass), per_mass)

    def push(self, impulse: float, per_mass: float) -> None:
        """Let an ``impulse`` [N·s] lift the tip and press the lower end; ``per_mass`` as of `advance`."""
        self.x[1] += impulse * self.tip
        self.z -= impulse * per_mass


def _along_soft_law(
    law: SoftLaw, degree: int, ends: _Errors, steps: np.ndarray, stiffness: np.ndarray, after: np.ndarray
) -> Iterator[tuple[float, float]]:
    """Yield the errors of both ends [m] along the run: its steps have not the force that ``law`` asks for."""
    made = np.flatnonzero(steps["size"] > 0.0)
    before, step = steps[made - 1], steps[made]
    parts = 1 if degree == 0 else 2  # a force of a higher degree has the law's mean over a step
    defect = _defect(law, before, step, parts)
    at_end = np.ones((3, len(step), parts)) * [[[1.0]], [[0.0]], [[0.0]]]
    at_end[..., -1] = np.multiply.reduceat(after[0], made), *np.add.reduceat(after[1:], made, axis=1)
    of_steps = [*np.repeat([step["size"] / parts, stiffness[made]], parts, axis=1), *at_end.reshape(3, -1), *defect]
    first = int(np.argmax(defect[0] != 0.0))  # up to there nothing is off
    for H, k, stays, turns, most, missed, early, stiffer, rate in zip(
        *(v[first:].tolist() for v in of_steps), strict=True
    ):
        follows, at_start = 0.5 * stiffer + rate / H, (0.5 * stiffer - rate / H) * (ends.y - ends.u)

        def force(apart: float, gives: float, asked: float = missed + at_start, follows: float = follows) -> float:
            return (asked + follows * apart) / (1.0 + follows * gives)

        ends.advance(H, k, ends.per_mass, force, 0.5 * H * H * (early - missed))
        ends.strike(stays, turns, most)
        yield ends.u, ends.y


def _defect(law: SoftLaw, before: np.ndarray, step: np.ndarray, parts: int) -> np.ndarray:
    """Return four means over equal parts of each step, (4, parts), one part after the other.

    They are what the law asks for beyond the force of the step, once evenly weighted and once by 2 (1 − s), s the share
    of the part [N], and how the law's force grows with the penetration [N/m] and with its rate [N·s/m].
    """
    size = step["size"]
    path = _penetration(before, step, size)
    found = np.zeros((4, len(step), parts))
    for part, (at, share) in product(range(parts), zip(*_INSIDE, strict=True)):
        s = (part + at) / parts
        p, rate = path.at(s), path.slope(s) / size
        closed = np.flatnonzero((p > 0.0) | (not law.one_sided))
        force, grows = -applied(step, s * size), np.zeros((2, len(step)))
        for i, *both in zip(closed.tolist(), p[closed].tolist(), rate[closed].tolist(), strict=True):
            _, *slopes = law.resistance(*both) if law.damped else (0.0, 0.0, 0.0)
            force[i] += law.force(*both)
            grows[:, i] = law.slope(both[0]) + slopes[0], slopes[1]
        found[..., part] += share * np.array([force, 2.0 * (1.0 - at) * force, *grows])
    return found.reshape(4, -1)


def _along_tie(
    degree: int, ends: _Errors, steps: np.ndarray, stiffness: np.ndarray, after: np.ndarray
) -> Iterator[tuple[float, float]]:
    """Yield the errors of both ends [m] along the run, inside steps, too: they leave a gap and different velocities."""
    parts = degree + 2  # one more than the step has forces
    size = np.where(steps["size"] > 0.0, steps["size"], 1.0)
    path = _penetration(np.roll(steps, 1), steps, size)
    shares = (np.arange(parts) + 1.0) / parts
    inside = np.array([[path.at(s), path.slope(s) / size] for s in shares]).transpose(2, 0, 1)
    tied, phase = joined(steps), steps["phase"]
    seated, pulls = phase >= 3.0, applied(steps, size) / np.where(steps["z"], steps["z"], inf)
    for i in range(1, len(steps)):
        H, k, stays, turns, most = map(float, (steps["size"][i], stiffness[i], *after[:, i]))
        per_mass = 0.0 if seated[i - 1] else ends.per_mass
        if H > 0.0 and not tied[i - 1]:
            ends.advance(H, k, per_mass, lambda apart, gives: 0.0)
        for deep, rate in inside[i].tolist() if H > 0.0 and tied[i - 1] else ():
            ends.advance(H / parts, k, per_mass, lambda apart, gives, deep=deep: (apart + deep) / gives)  # type: ignore[misc]
            ends.meet(rate, per_mass)
            yield ends.y, ends.y  # between rows the tip takes the path of the lower end
        ends.strike(stays, turns, most)
        if tied[i - 1 : i + 1].any() and (most > 0.0 or tied[i] != tied[i - 1]):
            per_mass = 0.0 if seated[i] or most > 0.0 else ends.per_mass  # the foundation strikes each end by itself
            # Below degree 2 the velocities of tied ends go up and down about those of a tie, and ends that part keep
            # them: taken for an error, they tell five times too much (`soft` in steps of 4 ms).
            kept = not tied[i] and degree < 2
            ends.meet(0.0 if kept else float(steps["z_after"][i] - steps["v_tip_after"][i]), per_mass)
        if phase[i - 1] == 1.0 and phase[i] == 0.0:  # y passes Ψ, sooner or later, where the force pulls
            ends.push(-pulls[i] * ends.y, per_mass)
        yield ends.u, ends.y


def _penetration(before: np.ndarray, step: np.ndarray, size: np.ndarray) -> Any:
    """Return the path of y − u inside each step of ``size`` [s], a `Path` of arrays."""
    start = before["y_after"] - before["u_tip_after"], before["z_after"] - before["v_tip_after"]
    end = step["y"] - step["u_tip"], step["z"] - step["v_tip"]
    moments = (step[f"y_{name}"] - step[f"u_tip_{name}"] for name in ("integral", "integral_2"))
    mean, twice = (moment / size**n for n, moment in enumerate(moments, 1))
    return Path.through(start, end, size, (mean, twice))  # type: ignore[arg-type]


def _after_events(interface: Interface, steps: np.ndarray, events: Sequence[Event]) -> np.ndarray:
    """Return what the events at each of ``steps`` leave of the lower end's error, (3, len(steps)).

    It is the share of displacement and velocity, none while the end is seated, and by how much each unit of
    displacement changes the velocity [1/s], at most by the jump of the stroke [m/s]: the end is struck earlier or
    later, under the acceleration before and after that.
    """
    shares, (turns, most) = np.where(steps["phase"] >= 3.0, 0.0, 1.0), np.zeros((2, len(steps)))
    struck = [n for n, event in enumerate(events, 1) if event.kind is EventKind.STOP_IMPACT]
    made = np.flatnonzero(steps["size"] > 0.0)
    if struck:
        rows = np.searchsorted(steps["events"], struck)
        e = interface.restitution
        np.multiply.at(shares, rows, -e)
        at = np.searchsorted(made, rows, side="right") - 1
        gained = (steps["z"][made] - steps["z_after"][made - 1]) / steps["size"][made]
        speed = steps["z"][made[at]]
        turns[rows] = (e * gained[at] + np.append(gained, 0.0)[at + 1]) / np.where(speed, speed, inf)
        most[rows] = (1.0 + e) * np.abs(speed)
    return np.array([shares, turns, most])


def _moves(modes: Modes, H: float) -> tuple[np.ndarray, np.ndarray, float, np.ndarray]:
    """Return what a step of ``H`` [s] makes of displacement and velocity of each mode, (2, 2, n).

    Further what a constant force of 1 N adds to them, (2, n), and how far that moves the tip [m/N]; and what the step
    makes of where 1 N·s², which moves a free mass, puts the modes that it follows, (2, n).
    """
    # A free mass is a mode so soft that it does not turn; 1 − cos would leave nothing of a softer one.
    stiffness, decay, tip = np.maximum(modes[0], 1e-8 / H**2), 0.5 * modes[1], modes[2]
    root = np.sqrt(decay**2 - stiffness * (1.0 + 1e-12j))  # never 0
    slower, faster = np.exp((root - decay) * H), np.exp(-(root + decay) * H)
    cosine, sine = (0.5 * (slower + faster)).real, (0.5 * (slower - faster) / root).real
    kept = cosine + decay * sine
    free = np.array([[kept, sine], [-stiffness * sine, cosine - decay * sine]])
    pushed = np.array([(1.0 - kept) / stiffness * tip, sine * tip])
    moved = tip / (1.0 + H * (decay + 0.25 * H * stiffness))
    return free, pushed, float(tip @ pushed[0]), free[:, 0] * moved
