"""How the errors of both ends go on from step to step: by the modes of the beam, and the linearised lower body."""

from __future__ import annotations

from functools import cache, partial
from typing import NamedTuple

import numpy as np

from ...bodies.protocol import Modes

#: From there on a difference of exponentials is not rounded away.
_SMALL = 1e-2


class Terms(NamedTuple):
    """The terms of the modes of a body, (n,) each.

    Each mode is c₊ exp(r₊ t) + c₋ exp(r₋ t), with r the roots of r² + 2 ζ ω r + ω² = 0; where these are conjugates one
    of the terms is kept and counts twice.
    """

    rates: np.ndarray  #: r [1/s]
    impulse: np.ndarray  #: what an impulse of 1 N·s at the end adds
    shown: np.ndarray  #: what the terms add to the displacement of the end, and to its velocity, (2, n)

    @classmethod
    def of(cls, modes: Modes, duration: float) -> Terms:
        """Return those of ``modes``; a free mass is a mode so soft that it does not turn in ``duration`` [s]."""
        stiffness = np.maximum(modes[0], (1e-4 / duration) ** 2)
        decay = 0.5 * modes[1]
        tip = modes[2]
        root = np.sqrt(decay**2 - stiffness * (1.0 + 1e-12j))  # never 0
        creeps = decay**2 >= stiffness

        def both(first: np.ndarray, second: np.ndarray) -> np.ndarray:
            return np.concatenate([first, second[creeps]])

        impulse = 0.5 * tip / root
        rates = both(root - decay, -(root + decay))
        displaced = both(np.where(creeps, 1.0, 2.0) * tip, tip)
        return cls(
            rates,
            both(impulse, -impulse),
            np.array([displaced, displaced * rates]),
        )


class Ends:
    """Errors of the tip's ``u`` [m] and ``v`` [m/s], the sums of terms, and of the lower end's ``y`` and ``z``.

    Parameters
    ----------
    modes
        Of the upper body.
    mass, damping
        Of the lower body [kg, N·s/m]; a mass of 0 is one that no force moves.
    duration
        Of the run [s].
    """

    def __init__(self, modes: Modes, mass: float, damping: float, duration: float) -> None:
        self.terms = Terms.of(modes, duration)
        self.u = self.v = self.y = self.z = 0.0
        #: Of both ends [1/kg].
        self.mobility = float(modes[2] @ modes[2])
        self.per_mass = 1.0 / mass if mass > 0.0 else 0.0
        self._resists = self.per_mass * damping
        #: What a jump of the tip by 1 N·s² adds to the terms, and to v.
        self._jump = self.terms.impulse * self.terms.rates
        self._resisted = float((self.terms.shown[1] @ self._jump).real)
        self._values = np.zeros(len(self._jump), complex)
        self._pairs = self._values.view(float)
        self._moves = cache(partial(_move, self.terms))
        #: The force [N], the impulse [N·s] and the shift [N·s²] of this step that the terms do not have yet.
        self._due = [0.0, 0.0, 0.0]
        self._added = np.zeros((3, len(self._pairs)))

    def drift(self, H: float, stiffness: float, per_mass: float) -> tuple[float, float]:
        """Advance by ``H`` [s] without a force, the lower end by the midpoint rule.

        Return y − u at the end [m], and by how much `act` with 1 N reduces it. ``stiffness`` is the spring's over its
        mass [1/s²], ``per_mass`` that of the lower end [1/kg], 0 while the foundation holds it.
        """
        self._settle()
        moved, at_end, self._added, self._by_force, by_shift = self._moves(H)
        self._due = [0.0, 0.0, 0.0]
        self.u, self.v = at_end.dot(self._pairs).tolist()
        self._values *= moved
        self._by_shift = *by_shift, per_mass
        half = 0.5 * H
        faster = H * self._swing(H, stiffness) * per_mass
        self._lower = half * faster, faster
        return self.y - self.u, self._by_force[0] + half * faster

    def _settle(self) -> None:
        """Give the terms what acts over the step of the last `drift`."""
        if any(self._due):
            self._pairs += np.array(self._due).dot(self._added)

    def _swing(self, H: float, stiffness: float) -> float:
        """Advance the lower end as of `drift`, and return which share of an impulse is left of it."""
        half = 0.5 * H
        slow = 1.0 / (1.0 + half * (self._resists + half * stiffness))
        mean = slow * (self.z - half * stiffness * self.y)
        self.y += H * mean
        self.z = 2.0 * mean - self.z
        return slow

    def fly(self, sizes: np.ndarray, stiffness: np.ndarray) -> tuple[float, float]:
        """Advance by steps of these ``sizes`` [s] without a force, all terms at once.

        Return the largest ``|u|`` and ``|y|`` at their ends [m]. ``stiffness`` is as of `drift`, in each step.
        """
        self._settle()
        self._due = [0.0, 0.0, 0.0]
        steps = list(zip(sizes.tolist(), stiffness.tolist(), strict=True))
        moved = np.multiply.accumulate([self._moves(H)[0] for H, _ in steps]) * self._values
        self._values[:] = moved[-1]
        self.u, self.v = (self.terms.shown @ moved[-1]).real.tolist()
        heights = []
        for H, k in steps:
            self._swing(H, k)
            heights.append(abs(self.y))
        return float(np.abs((moved @ self.terms.shown[0]).real).max()), max(heights)

    def act(self, C: float, shift: float = 0.0) -> None:
        """Let the mean force ``C`` [N] act over the step of the last `drift`, too.

        A ``shift`` [N·s²] moves free masses besides, as a force does that acts early.
        """
        self._due[0] += C
        self._due[2] += shift
        u, v, y = self._by_shift
        self.u += C * self._by_force[0] + shift * u
        self.v += C * self._by_force[1] + shift * v
        self.y -= C * self._lower[0] + shift * y
        self.z -= C * self._lower[1]

    def follow(self, force: tuple[float, float, float], shift: tuple[float, float, float]) -> None:
        """Let a mean ``force`` [N] and a ``shift`` [N·s²] act as by `act`, which depend on what they lead to.

        Each is given by what it is without y − u and z − v at the end of the step, and by how it grows with these.
        """
        by_force = self._by_force[0] + self._lower[0], self._by_force[1] + self._lower[1]
        by_shift = self._by_shift[0] + self._by_shift[2], self._by_shift[1]
        apart = self.y - self.u
        rate = self.z - self.v
        C, by_apart, by_rate = force
        jump, jump_by_apart, jump_by_rate = shift
        C += by_apart * apart + by_rate * rate
        jump += jump_by_apart * apart + jump_by_rate * rate
        # Both reduce what they depend on: two linear equations.
        a = 1.0 + by_apart * by_force[0] + by_rate * by_force[1]
        b = by_apart * by_shift[0] + by_rate * by_shift[1]
        c = jump_by_apart * by_force[0] + jump_by_rate * by_force[1]
        d = 1.0 + jump_by_apart * by_shift[0] + jump_by_rate * by_shift[1]
        self.act((d * C - b * jump) / (a * d - b * c), (a * jump - c * C) / (a * d - b * c))

    def add(self, terms: np.ndarray, u: float, v: float, y: float, z: float) -> None:
        """Add what something else does over the step of the last `drift`."""
        self._values += terms
        self.u += u
        self.v += v
        self.y += y
        self.z += z

    def kick(self, impulse: float, per_mass: float) -> None:
        """Let an ``impulse`` [N·s] lift the tip and press the lower end; ``per_mass`` as of `drift`."""
        self._due[1] += impulse
        self.v += impulse * self.mobility
        self.z -= impulse * per_mass

    def kick_apart(self, apart: float, per_mass: float) -> None:
        """Let v − z be ``apart`` [m/s] by an impulse; ``per_mass`` as of `drift`."""
        self.kick((apart - self.v + self.z) / (self.mobility + per_mass), per_mass)

    def bounce(self, meet: float, part: float, per_mass: float) -> None:
        """Let ends meet at a speed ``meet`` [m/s] and part with an acceleration ``part`` [m/s²], late if apart."""
        apart = self.u - self.y
        self._shift(-apart / (self.mobility + per_mass), per_mass)
        self.kick_apart(max(-meet, min(-part * apart / meet, meet)), per_mass)

    def _shift(self, jump: float, per_mass: float) -> None:
        """Let a ``jump`` [N·s²] lift the tip and press the lower end; ``per_mass`` as of `drift`."""
        self._values += jump * self._jump
        self.u += jump * self.mobility
        self.v += jump * self._resisted
        self.y -= jump * per_mass

    def rebound(self, share: float, turns: float, most: float) -> None:
        """Change the errors of the lower end by a `springbeam.run.errors.strokes.Strokes` of the foundation."""
        self.z = share * self.z + max(-most, min(turns * self.y, most))
        self.y *= share

    def rebound_of_tip(self, share: float, turns: float, most: float) -> None:
        """Change those of the tip; the impulse that is earlier or later moves the beam besides."""
        change = (share - 1.0) * self.v + max(-most, min(turns * self.u, most))
        self._shift((share - 1.0) * self.u / self.mobility, 0.0)
        self.kick(change / self.mobility, 0.0)


def _move(
    terms: Terms, H: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple[float, float], tuple[float, float]]:
    """Return what a step of ``H`` [s] makes of the terms, and of u and v in these.

    Further, in rows, what its end adds to the terms: of a constant force of 1 N, of an impulse of 1 N·s at the end, and
    of a force that falls linearly, without an impulse, and moves a free mass by 1 N·s² over its mass; and what the
    first and the last add to u and v.
    """
    rates, impulse, shown = terms
    turned = rates * H
    moved = np.exp(turned)
    by_force = impulse * np.expm1(turned) / rates
    shifted = impulse * _falling(turned) * 6.0 / H
    at_end = _reals(np.conj(shown * moved))
    added = _reals(np.array([by_force, impulse, shifted]))
    force_moves, shift_moves = ((shown @ each).real.tolist() for each in (by_force, shifted))
    return moved, at_end, added, force_moves, shift_moves


def _falling(x: np.ndarray) -> np.ndarray:
    """Return ∫ (2s − 1) exp(x s) ds from 0 to 1."""
    with np.errstate(invalid="ignore"):
        exact = ((x - 2.0) * np.exp(x) + x + 2.0) / x**2
    return np.where(np.abs(x) < _SMALL, x / 6.0 * np.exp(0.5 * x), exact)


def _reals(values: np.ndarray) -> np.ndarray:
    """Return complex ``values`` as pairs of reals."""
    return np.ascontiguousarray(values).view(float)
