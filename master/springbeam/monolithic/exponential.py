"""Exact modal integration of one phase of a `HybridSystem`.

The phase's linear part is diagonalised and solved exactly; what is nonlinear, or damped otherwise than the modes,
enters as forces r(t) at the interface, collocated at s Gauss points of each step::

    ξ̈ + c ξ̇ + ω² ξ = f + Pᵀ r(t),     r = R(ξ, ξ̇) by way of u, v, y and z
    ξ(τ) = C(τ) ξ₀ + S(τ) ξ̇₀ + ∫₀^τ S(τ − σ) (f + Pᵀ r(σ)) dσ,    S the response to a unit impulse, C = Ṡ + c S

Steps resolve all motion that is not silent: not for accuracy, which a linear phase has at any step, but so that no
event slips through between two nodes. Beams whose fast modes stay silent, or are damped out, cost little.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from .hybrid_system import NOISE, HybridSystem, ReferenceFailure
from .laws import ReferencePhase
from .oscillators import GAUSS, STAGES, TARGETS, Oscillators
from .semi_discrete import singular_modes

_MAX_ITERATIONS = 60
#: Step size × rate of the fastest motion that is not silent: 12 Gauss points interpolate e^{iθ}, θ ≤ 2, to 1e-12.
_STEP_PHASE = 2.0
#: What the last two Legendre coefficients of the forces may add to the velocity of an end over a step, as a share of
#: the largest velocity. The step's end is far more exact: Gauss points integrate what these coefficients leave out.
_TAIL = 1e-12
_SMALLEST_SHARE = 2.0**-60
_CACHED_SIZES = 64
#: Where states of a segment are kept, as fractions of it.
_NODES = np.append(0.0, TARGETS)


class Segment(NamedTuple):
    """One accepted step: its states at ``nodes`` [s], from 0 to its size, and what finds those between them."""

    nodes: np.ndarray  #: (k,)
    states: np.ndarray  #: (k, 2n + 3)
    inside: Callable[[float], np.ndarray]  #: τ [s] → X


class LinearForm:
    """A phase in the modes ξ of what moves in it, x = basis ξ + offset: its linear part, and the forces r.

    Attributes
    ----------
    omega2, c : (p,) arrays
        ω² [1/s²], negative where a spring with k1 < 0 wins, and damping [1/s].
    inputs : (k, p) array
        P: the forces r. First, on the top, what is left of the spring's damping, and −k2 (y − y₀)³; then
        the law's force C;
        each if the phase has it.
    ends, at : (2, p) array, (2, 1) array
        u and y are ends @ ξ + at.
    """

    def __init__(self, system: HybridSystem, phase: ReferencePhase) -> None:
        self.system, self.phase = s, phase = system, phase
        self.unresolved = f"no step resolves the interface force in phase {phase.name}"
        (omega2, c, load) = s.oscillating(phase)
        held = s.held(phase)
        self.offset = held.levels @ held.along
        self.omega2, self.basis = _modes(omega2, s.space(phase))
        self.inverse = self.basis / np.sum(self.basis**2, axis=0)  # its columns are at right angles
        self.c = c @ self.basis**2  # where nothing is joined a mode is a coordinate
        self.damping = 0.0
        if s.joined(phase):
            self.c = s.alpha_b * self.omega2
            #: Damping of the spring that ``c`` does not hold [N·s/m].
            self.damping = s.spring.damping - s.alpha_b * s.spring.linear_stiffness
        self.constant = (load - omega2 * self.offset) @ self.basis
        self.loads = s.patterns @ self.basis
        ends = np.array([s.tip, s.top])
        self.ends = ends @ self.basis
        self.at = (ends @ self.offset)[:, None] + [[0.0], [s.floor]]
        nonlinear = bool(self.damping or s.spring.cubic_stiffness)
        self.of_spring = nonlinear and s.has_spring and bool(np.any(self.ends[1]))
        self.of_law = s.law.acts(phase.contact)
        inputs = [s.top] * self.of_spring + [s.between] * self.of_law
        self.inputs = np.reshape(inputs, (len(inputs), s.n)) @ self.basis
        self.oscillators = Oscillators(self.omega2, self.c)
        self.weights = lru_cache(_CACHED_SIZES)(self.oscillators.weights)

    def modal(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return (ξ, ξ̇) of a state."""
        return (X[self.system.A] - self.offset) @ self.inverse, X[self.system.V] @ self.inverse

    def load_at(self, times: np.ndarray) -> np.ndarray:
        """Return all loads on the modes, (..., p), at ``times`` [s] of shape (...)."""
        return np.asarray(self.constant + self.system.loads.values(times) @ self.loads)

    def forces(self, xi: np.ndarray, xi_dot: np.ndarray) -> np.ndarray:
        """Return R: forces (k, inputs) at modes (k, p)."""
        u, y = self.ends @ xi.T + self.at
        v, z = self.ends @ xi_dot.T
        found = []
        spring = self.system.spring
        if self.of_spring:
            found.append(-self.damping * z - spring.cubic_stiffness * (y - spring.unloaded) ** 3)
        if self.of_law:
            found.append(self.system.law.force(y - u, z - v))
        return np.asarray(np.reshape(found, (len(found), len(xi))).T)

    def longest_step(self, X: np.ndarray) -> float:
        """Return the step [s] that resolves the free motion from X, but for amplitudes as small as rounding."""
        xi, xi_dot = self.modal(X)
        force = self.forces(xi[None], xi_dot[None])[0] @ self.inputs + self.load_at(X[self.system.T])
        rates, amplitudes = self.oscillators.components(xi, xi_dot, force)
        reach = np.max(np.abs(self.ends), axis=0, initial=0.0)  # of the ends, by a unit of each mode
        silent = NOISE * np.max(reach, initial=0.0) * max(float(np.linalg.norm(xi)), np.max(amplitudes, initial=0.0))
        fastest = np.max(rates[np.tile(reach, 2) * amplitudes > silent], initial=0.0)
        return min(_STEP_PHASE / fastest if fastest > 0.0 else np.inf, self.system.loads.longest_step)

    def step(self, X: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
        """Move from X over a step of ``size`` [s].

        Returns the states at `TARGETS`, and the accelerations (stages, 2) of the ends by the forces r. Raises
        ReferenceFailure if the step is too long to find these.
        """
        s = self.system
        weights = self.weights(float(f"{size:.12e}"))  # sizes recur but for rounding
        times = X[s.T] + size * TARGETS
        xi, xi_dot = self.modal(X)
        load = self.load_at(times[:-1])
        r = np.repeat(self.forces(xi[None], xi_dot[None]), STAGES, axis=0)
        for iteration in range(_MAX_ITERATIONS):
            with np.errstate(over="ignore", invalid="ignore"):  # an escaping spring; found below
                moved = weights.motion(xi, xi_dot, load + r @ self.inputs)
                new = self.forces(*(at_targets[:-1] for at_targets in moved))
                change = np.max(np.abs(new - r), initial=0.0)
                scale = np.max(np.abs(new), initial=0.0)
            r = new
            if change <= (4e-16 if iteration < 9 else 1e-14) * scale:
                break
        else:
            raise ReferenceFailure(self.unresolved)
        states = np.repeat(X[None], len(times), axis=0)
        states[:, s.A], states[:, s.V] = moved[0] @ self.basis.T + self.offset, moved[1] @ self.basis.T
        states[:, s.T] = times
        states[-1, s.D] += size * float(GAUSS.weights @ s.dissipation_rate(self.phase, states[:-1]))
        states[-1, s.W] += size * float(GAUSS.weights @ s.load_power(states[:-1]))
        return states, r @ self.inputs @ self.ends.T


def _modes(omega2: np.ndarray, space: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return ω² and orthonormal modes in ``space`` of the stiffness diag(omega2).

    By singular values of its factor (see `semi_discrete`), unless a part of it is negative.
    """
    if np.all(omega2 >= 0.0):
        omega, modes = singular_modes(np.sqrt(omega2)[:, None] * space)
        return omega**2, space @ modes
    omega2, modes = np.linalg.eigh(space.T @ (omega2[:, None] * space))
    return omega2, space @ modes


class ExponentialPropagator:
    """Integrates a phase from X on: exact in the linear part, ``form``, by Gauss collocation in the rest."""

    def __init__(self, form: LinearForm, X: np.ndarray, speed: float = 0.0) -> None:
        self.form = form
        self.X = X
        self._speed = speed  #: the largest of the ends so far, the scale of `_TAIL` [m/s]
        self._force_limit = np.inf  #: what resolving r allows [s]
        self.elapsed = 0.0  #: since the start [s]

    def advance(self, remaining: float) -> Segment:
        """Make one step towards ``remaining`` [s] from here."""
        limit = self.form.longest_step(self.X)
        while True:
            size = min(limit, self._force_limit)
            # Powers of two recur, also in other segments: weights are dear.
            size = remaining if remaining <= size else 2.0 ** float(np.floor(np.log2(size)))
            try:
                segment = self._step(size)
            except ReferenceFailure:
                self._force_limit = 0.5 * size
                if size < _SMALLEST_SHARE * remaining:
                    raise
            else:
                self._force_limit *= 2.0
                self.X = segment.states[-1]
                self.elapsed += size
                return segment

    def _step(self, size: float) -> Segment:
        """Make one step. Raises ReferenceFailure where it is too long for the forces r."""
        form = self.form
        X = self.X
        states, pulled = form.step(X, size)
        u, v, y, z = np.abs(form.system.ends(form.phase, states))
        self._speed = max(self._speed, float(np.max([v, z])))
        tail = size * np.sum(np.abs(GAUSS.transform[-2:] @ pulled), axis=0)
        # A place that rounding would change as much is no reason for a shorter step.
        unresolved = (tail > _TAIL * self._speed) & (tail * size > NOISE * np.max([u, y]))
        if np.any(unresolved) or not np.all(np.isfinite(states)):
            raise ReferenceFailure(form.unresolved)

        speed = self._speed

        def inside(tau: float) -> np.ndarray:
            # Stepped anew, because the forces of the whole segment may hold a kink that lies after τ.
            inner = ExponentialPropagator(form, X, speed)
            while tau - inner.elapsed > 1e-15 * tau:
                inner.advance(tau - inner.elapsed)
            return inner.X

        return Segment(size * _NODES, np.vstack([X, states]), inside)
