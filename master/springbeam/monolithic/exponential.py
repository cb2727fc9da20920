"""Exact modal integration of one phase of a `HybridSystem`.

The phase's linear part is diagonalised and solved exactly; what is nonlinear, or damped otherwise than the modes,
enters as forces r(t) at the interface, collocated at s Gauss points of each step::

    ξ̈ + c ξ̇ + ω² ξ = f + Pᵀ r(t),     r = R(ξ, ξ̇) by way of u, v, y and z
    ξ(τ) = C(τ) ξ₀ + S(τ) ξ̇₀ + ∫₀^τ S(τ − σ) (f + Pᵀ r(σ)) dσ,    S the response to a unit impulse, C = Ṡ + c S

Steps resolve all motion that is not silent: not for accuracy, which a linear phase has at any step, but so that no
event slips through between two nodes. Beams whose fast modes stay silent, or are damped out, cost little.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import legendre

from .hybrid_system import NOISE, HybridSystem, ReferenceFailure
from .laws import ReferencePhase
from .oscillators import GAUSS, STAGES, TARGETS, Oscillators, StepWeights
from .semi_discrete import singular_modes

_MAX_ITERATIONS = 60
#: Largest change of the forces in the last iteration, as a share of them.
_CONVERGED = 1e-14
#: Step size × rate of the fastest motion that is not silent: 24 Gauss points interpolate e^{iθ}, θ ≤ 12, to 3e-12.
_STEP_PHASE = 12.0
#: What the last two Legendre coefficients of the forces may add to the velocity of an end over a step, as a share of
#: the largest velocity. The step's end is far more exact: Gauss points integrate what these coefficients leave out.
_TAIL = 1e-12
_SMALLEST_SHARE = 2.0**-60
_CACHED_SIZES = 64
#: Where states of a segment are kept, as fractions of it.
_NODES = np.append(0.0, TARGETS)
#: Takes values at the nodes of a segment to the Legendre coefficients of the polynomial through them.
TO_LEGENDRE = np.linalg.inv(legendre.legvander(2.0 * _NODES - 1.0, STAGES + 1))
#: Takes these values to its slope at the end of a segment of size 1.
END_SLOPE = np.arange(STAGES + 2) * np.arange(1, STAGES + 3) @ TO_LEGENDRE
#: Weights of its barycentric form (Berrut & Trefethen 2004, (4.2)).
_BARYCENTRIC = 1.0 / np.prod(4.0 * (_NODES[:, None] - _NODES) + np.eye(len(_NODES)), axis=1)
#: Stands for the distance 0 from a node, whose value is then all that counts.
_ON_NODE = 1e-200


@dataclass(frozen=True)
class Segment:
    """One accepted step from X = ``states[0]``: its states at ``nodes`` [s], from 0 to its size."""

    form: LinearForm
    nodes: np.ndarray  #: (k,)
    states: np.ndarray  #: (k, 2n + 3)
    speed: float  #: the largest of the ends so far [m/s]

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return the states at ``times`` [s], (m, 2n + 3), by the polynomial through those at the nodes.

        What is dissipated and the work of the loads are integrated up to there.
        """
        s = self.form.system
        states = self._through(times)
        before = self._through(times[:, None] * GAUSS.nodes)
        for part, rate in ((s.D, s.dissipation_rate(self.form.phase, before)), (s.W, s.load_power(before))):
            states[:, part] = self.states[0, part] + times * (rate @ GAUSS.weights)
        return states

    def _through(self, times: np.ndarray) -> np.ndarray:
        away = times[..., None] / self.nodes[-1] - _NODES
        shares = _BARYCENTRIC / np.where(away == 0.0, _ON_NODE, away)
        return shares / np.sum(shares, axis=-1, keepdims=True) @ self.states

    def pieces(self, tau: float) -> Iterator[Segment]:
        """Step anew up to τ [s]: the forces of the whole segment may hold a kink that lies after τ."""
        inner = ExponentialPropagator(self.form, self.states[0], self.speed)
        while tau - inner.elapsed > 1e-15 * tau:
            yield inner.advance(tau - inner.elapsed)


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
    ends, at : (2, p) array, (2,) array
        u and y are ends @ ξ + at.
    """

    def __init__(self, system: HybridSystem, phase: ReferencePhase) -> None:
        self.system = s = system
        self.phase = phase
        self.unresolved = f"no step resolves the interface force in phase {phase.name}"
        (omega2, c, load) = s.oscillating(phase)
        held = s.held(phase)
        soft = held.rows / np.where(omega2 > 0.0, omega2, 1.0)
        self.offset = np.linalg.solve(soft @ held.rows.T, held.levels) @ soft
        self.omega2, self.basis = _modes(omega2, s.space(phase))
        self.inverse = self.basis / np.sum(self.basis**2, axis=0)  # its columns are at right angles
        self.c = c @ self.basis**2  # where nothing is joined a mode is a coordinate
        self.damping = 0.0
        if s.joined(phase):
            self.c = s.alpha_b * self.omega2
            #: Damping of the spring that ``c`` does not hold [N·s/m].
            self.damping = s.spring.damping - s.alpha_b * s.spring.linear_stiffness
        #: What a constant and a unit of each load add to ξ̈, (p,) and (loads, p).
        self.constant = (load - omega2 * self.offset) @ self.basis
        self.patterns = s.patterns @ self.basis
        ends = np.array([s.tip, s.top])
        self.ends = ends @ self.basis
        self.at = ends @ self.offset + [0.0, s.floor]
        #: What a unit of each mode moves an end by at most, of its slow and its fast root, (2p,).
        self.reach = np.tile(np.max(np.abs(self.ends), axis=0), 2)
        nonlinear = bool(self.damping or s.spring.cubic_stiffness)
        self.of_spring = nonlinear and s.has_spring and bool(np.any(self.ends[1]))
        self.of_law = s.law.acts(phase.contact)
        inputs = [s.top] * self.of_spring + [s.between] * self.of_law
        self.inputs = np.reshape(inputs, (len(inputs), s.n)) @ self.basis
        self.oscillators = Oscillators(self.omega2, self.c)
        self.weights = lru_cache(_CACHED_SIZES)(self._weights)

    def modal(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return (ξ, ξ̇) of a state."""
        return (X[self.system.A] - self.offset) @ self.inverse, X[self.system.V] @ self.inverse

    def ends_at(self, moved: np.ndarray) -> np.ndarray:
        """Return u and y, v and z at modes (2, k, p): (2, k, 2)."""
        ends = moved @ self.ends.T
        ends[0] += self.at
        return ends

    def forces(self, ends: np.ndarray) -> np.ndarray:
        """Return R: forces (k, inputs) of ends that move as `ends_at` says."""
        (u, y), (v, z) = ends.swapaxes(1, 2)
        forces = np.empty((len(u), len(self.inputs)))
        if self.of_spring:
            spring = self.system.spring
            stretched = y - spring.unloaded
            forces[:, 0] = -self.damping * z - spring.cubic_stiffness * (stretched * stretched * stretched)
        if self.of_law:
            forces[:, -1] = self.system.law.force(y - u, z - v)
        return forces

    def _weights(self, size: float) -> tuple[StepWeights, np.ndarray, np.ndarray]:
        """Return the weights of a step, and what they make of r and of the constant.

        That is r.ravel() → `ends_at`, and ξ and ξ̇ at `TARGETS`.
        """
        weights = self.oscillators.weights(size)
        onto = (self.ends[:, None] * self.inputs).reshape(2 * len(self.inputs), len(self.omega2))
        of_ends = np.reshape(weights.force[:, :-1] @ onto.T, (2, STAGES, STAGES, 2, len(self.inputs)))
        constant = weights.forced(np.ones((STAGES, 1)), self.constant[None])
        return weights, np.moveaxis(of_ends, 3, 2).reshape(2 * STAGES * 2, STAGES * len(self.inputs)), constant

    def longest_step(self, X: np.ndarray) -> float:
        """Return the step [s] that resolves the motion from X, but for amplitudes as small as rounding.

        That is the free motion, and what loads excite that are 0 at the start of the step, as a sine.
        """
        xi, xi_dot = self.modal(X)
        r = self.forces(self.ends_at(np.array([[xi], [xi_dot]])))[0]
        loads = self.system.loads
        longest = loads.longest_step
        times = X[self.system.T] + np.array([0.0, longest][: 1 + (len(loads) > 0)])
        forces = r @ self.inputs + self.constant + loads.values(times) @ self.patterns
        amplitudes = self.oscillators.amplitudes(xi, xi_dot, forces).max(axis=0)
        silent = NOISE * self.reach.max(initial=0.0) * max(np.linalg.norm(xi), amplitudes.max(initial=0.0))
        fastest = self.oscillators.rates[self.reach * amplitudes > silent].max(initial=0.0)
        return min(_STEP_PHASE / fastest if fastest > 0.0 else np.inf, longest)

    def step(self, X: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
        """Move from X over a step of ``size`` [s].

        Returns the states at `TARGETS`, and the accelerations (stages, 2) of the ends by the forces r. Raises
        ReferenceFailure if the step is too long to find these.
        """
        s = self.system
        weights, of_ends, constant = self.weights(size)
        times = X[s.T] + size * TARGETS
        xi, xi_dot = self.modal(X)
        moved = weights.free(xi, xi_dot) + constant
        if len(s.loads):
            moved += weights.forced(s.loads.values(times[:-1]), self.patterns)
        without = self.ends_at(moved[:, :-1])
        r = self._resolved(without, of_ends, self.forces(self.ends_at(np.array([[xi], [xi_dot]]))))
        moved += weights.forced(r, self.inputs)
        states = np.repeat(X[None], len(times), axis=0)
        states[:, s.A] = moved[0] @ self.basis.T + self.offset
        states[:, s.V] = moved[1] @ self.basis.T
        states[:, s.T] = times
        states[-1, s.D] += size * float(GAUSS.weights @ s.dissipation_rate(self.phase, states[:-1]))
        states[-1, s.W] += size * float(GAUSS.weights @ s.load_power(states[:-1]))
        return states, r @ self.inputs @ self.ends.T

    def _resolved(self, without: np.ndarray, of_ends: np.ndarray, first: np.ndarray) -> np.ndarray:
        """Return the forces r at the Gauss points, (stages, inputs), of ends that move ``without`` them as given.

        ``first`` is r at the start, (1, inputs). Raises ReferenceFailure where no r is found.
        """
        r = np.repeat(first, STAGES, axis=0)
        if not len(self.inputs):
            return r
        with np.errstate(over="ignore", invalid="ignore"):  # an escaping spring; found by the caller
            for _ in range(_MAX_ITERATIONS):
                new = self.forces(without + (of_ends @ r.ravel()).reshape(without.shape))
                change = np.abs(new - r).max()
                r = new
                if not np.isfinite(change):
                    break
                if change <= _CONVERGED * np.abs(new).max():
                    return r
        raise ReferenceFailure(self.unresolved)


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
            # Powers of √2 recur, also in other segments: weights are dear.
            size = remaining if remaining <= size else 2.0 ** (0.5 * float(np.floor(2.0 * np.log2(size))))
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
        if np.any(unresolved) or not np.all(np.isfinite(states)) or not self._power_resolved(size, states):
            raise ReferenceFailure(form.unresolved)

        return Segment(form, size * _NODES, np.vstack([X, states]), self._speed)

    def _power_resolved(self, size: float, states: np.ndarray) -> bool:
        """Whether the power that a slack contact takes without a force r is resolved, as r is."""
        s = self.form.system
        phase = self.form.phase
        if phase.contact != "slack":
            return True
        u, v, y, z = s.ends(phase, states[:-1])
        power = s.law.dissipation(phase.contact, y - u, z - v)
        tail = size * float(np.sum(np.abs(GAUSS.transform[-2:] @ power)))
        energy = 0.5 * float(np.max(np.sum(states[:, s.V] ** 2, axis=1)))
        return tail <= max(_TAIL * energy, NOISE * size * float(np.max(np.abs(power))))
