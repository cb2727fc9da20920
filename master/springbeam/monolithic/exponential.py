"""Exact modal integration of one phase of a `HybridSystem`.

The phase's linear part is diagonalised and solved exactly; what is nonlinear, or damped otherwise than the modes,
enters as forces r(t) at the interface, collocated at s Gauss points of each step::

    ξ̈ + c ξ̇ + ω² ξ = f + Pᵀ r(t),     r = R(ξ, ξ̇) by way of u, v, y and z
    ξ(τ) = C(τ) ξ₀ + S(τ) ξ̇₀ + ∫₀^τ S(τ − σ) (f + Pᵀ r(σ)) dσ,    S the response to a unit impulse, C = Ṡ + c S

Steps resolve the motion that can be seen at the interface: not for accuracy, which a linear phase has at any step, but
so that no event slips through between two nodes. Beams whose fast modes stay silent, or are damped out, cost little.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from .hybrid_system import NOISE, HybridSystem, ReferenceFailure
from .laws import Phase
from .oscillators import GAUSS, STAGES, Oscillators, StepWeights
from .semi_discrete import singular_modes

_MAX_ITERATIONS = 60
#: Step size × rate of the fastest motion that matters: 12 Gauss points interpolate e^{iθ}, θ ≤ 2, to 1e-12.
_STEP_PHASE = 2.0
#: What all faster motion together may amount to: of the tip's displacement, of a contact force, of the energy that
#: damping takes.
_UNSEEN_DISPLACEMENT, _UNSEEN_FORCE, _UNSEEN_ENERGY = 1e-12, 1e-9, 1e-14
#: Largest accepted impulse of the last two Legendre coefficients of r over a step, as a share of the momentum there.
#: The step's end is far more exact: Gauss points integrate what these coefficients leave out.
_TAIL = 1e-12
_SMALLEST_SHARE = 2.0**-60
_CACHED_SIZES = 64


@dataclass(frozen=True)
class Segment:
    """One accepted step: its states at ``nodes`` [s], from 0 to its size, and what finds those between them."""

    nodes: np.ndarray  #: (k,)
    states: np.ndarray  #: (k, 2n + 3)
    inside: Callable[[float], np.ndarray]  #: τ [s] → X

    @property
    def size(self) -> float:
        """How long it lasts [s]."""
        return float(self.nodes[-1])

    def state(self, tau: float) -> np.ndarray:
        """Return X at ``tau`` after the start [s]."""
        if tau <= 0.0 or tau == self.size:
            return np.array(self.states[0 if tau <= 0.0 else -1])
        return self.inside(tau)


class LinearForm:
    """The linear part of a phase, in the modes ξ of what moves in it: x = basis ξ + offset.

    A constraint g·x = const leaves the space orthogonal to g, and the modes are those in it. Without one they are the
    coordinates x themselves.

    Attributes
    ----------
    omega2, c : (p,) arrays
        ω² [1/s²], negative where a spring with k1 < 0 wins, and damping [1/s].
    constant, loads : (p,), (loads, p) arrays
        Constant loads, and forces of a unit of each load that varies.
    inputs : (k, p) array
        P: the forces r. First, on the top, what is left of the spring's damping, and −k2 y³; then the law's force C;
        each if the phase has it.
    ends, at : (2, p) array, (2, 1) array
        u and y are ends @ ξ + at.
    pressing : (p,) array
        What a mode adds to the contact force that must not change sign; zeros if there is none.
    """

    def __init__(self, system: HybridSystem, phase: Phase) -> None:
        self.system, self.phase = s, phase = system, phase
        moving, omega2, c, constant = s.oscillating(phase)
        loads, tip, top, between = (rows[..., moving] for rows in (s.patterns, s.tip, s.top, s.between))
        row = s.row(phase)
        self.moving = moving
        self.offset, self.pressing = np.zeros(len(omega2)), np.zeros(len(omega2))
        self.at = np.array([[0.0], [s.stop.position * s.fixed(phase)]])
        #: Damping of the spring that ``c`` does not hold yet [N·s/m].
        self.damping = 0.0
        #: `offset` + this @ ξ = x; ``None`` where x are the modes.
        self.basis: np.ndarray | None = None
        if row is not None:
            if phase.seated:
                self.offset = tip * (s.stop.position / s.tip_mobility)
                self.at[0] = s.stop.position
            if phase.seated or phase.contact == "touch":
                self.pressing = row[moving] * omega2
            constant = constant - omega2 * self.offset
            omega2, self.basis = _modes(omega2, scipy.linalg.null_space(row[None, moving]))
            constant, loads, tip, top, between, self.pressing = (
                rows @ self.basis for rows in (constant, loads, tip, top, between, self.pressing)
            )
            c, self.damping = s.alpha_b * omega2, s.spring.damping - s.alpha_b * s.spring.linear_stiffness
        self.omega2, self.c, self.constant, self.loads = omega2, c, constant, loads
        self.of_spring = bool(np.any(top)) and s.has_spring and bool(self.damping or s.spring.cubic_stiffness)
        self.of_law = s.law.acts(phase.contact)
        inputs = [top] * self.of_spring + [between] * self.of_law
        self.inputs = np.reshape(inputs, (len(inputs), len(omega2)))
        self.ends = np.array([tip, top])
        self.oscillators = Oscillators(omega2, c)
        self.mobility = np.sum(self.inputs**2, axis=1)  #: acceleration per unit force r [1/kg]
        self._weights: dict[str, StepWeights] = {}  #: by the first digits of sizes, which recur but for rounding

    def pack(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return (ξ, ξ̇) of a state."""
        x, x_dot = X[self.system.A][self.moving], X[self.system.V][self.moving]
        return (x, x_dot) if self.basis is None else ((x - self.offset) @ self.basis, x_dot @ self.basis)

    def unpack(self, xi: np.ndarray, xi_dot: np.ndarray, times: np.ndarray, X: np.ndarray) -> np.ndarray:
        """Return states (k, 2n + 3) from modes (k, p) at ``times`` (k,) [s]; X supplies what does not move."""
        s = self.system
        states = np.repeat(X[None, :], len(xi), axis=0)
        x, x_dot = states[:, s.A], states[:, s.V]
        if self.basis is not None:
            xi, xi_dot = xi @ self.basis.T + self.offset, xi_dot @ self.basis.T
        x[:, self.moving], x_dot[:, self.moving], states[:, s.T] = xi, xi_dot, times
        return s.synchronise(self.phase, states)

    def load_at(self, times: np.ndarray) -> np.ndarray:
        """Return all loads on the modes, (..., p), at ``times`` [s] of shape (...)."""
        return np.asarray(self.constant + self.system.loads.values(times) @ self.loads)

    def forces(self, xi: np.ndarray, xi_dot: np.ndarray) -> np.ndarray:
        """Return R: forces (inputs, k) at modes (k, p)."""
        (u, y), (v, z) = self.ends @ xi.T + self.at, self.ends @ xi_dot.T
        found, spring = [], self.system.spring
        if self.of_spring:
            found.append(-self.damping * z - spring.cubic_stiffness * y**3)
        if self.of_law:
            found.append(self.system.law.force(y - u, z - v))
        return np.array(found).reshape(len(found), len(xi))

    def weights(self, size: float) -> StepWeights:
        """Return the weights of a step of ``size`` [s]; those of some sizes are kept."""
        digits = f"{size:.12e}"
        if digits not in self._weights:
            if len(self._weights) >= _CACHED_SIZES:
                self._weights.clear()
            self._weights[digits] = self.oscillators.weights(size)
        return self._weights[digits]

    def longest_step(self, xi: np.ndarray, xi_dot: np.ndarray, r: np.ndarray, X: np.ndarray) -> float:
        """Return the step [s] that resolves the free motion seen in displacements, contact forces and dissipation.

        ``r`` (k,) are the forces at the start, X. What is left out is no error: it only may hide an event as small.
        """
        if not len(self.omega2):
            return self.system.loads.longest_step
        force = r @ self.inputs + self.load_at(X[self.system.T])
        rates, amplitudes = self.oscillators.components(xi, xi_dot, force)
        order = np.argsort(-rates)
        rates, amplitudes = rates[order], amplitudes[order]
        mode = order % len(self.omega2)
        stiffness = np.abs(self.omega2)[mode]
        alpha = self.system.alpha_b
        pressing = np.abs(self.pressing)[mode] * (1.0 + alpha * rates)
        limits = [(np.abs(row)[mode], 1, _UNSEEN_DISPLACEMENT) for row in self.ends]
        limits.append((pressing, 1, _UNSEEN_FORCE))
        if alpha > 0.0:
            limits.append((stiffness + rates**2, 2, _UNSEEN_ENERGY))
        fastest, rounding = 0.0, NOISE * float(np.linalg.norm(xi))  # of each amplitude, where nothing moves
        for weights, power, unseen in limits:
            from_fast = np.cumsum(weights * amplitudes**power)
            seen = from_fast > np.maximum(unseen * from_fast[-1], np.cumsum(weights) * rounding**power)
            if np.any(seen):
                fastest = max(fastest, float(rates[np.argmax(seen)]))
        return min(_STEP_PHASE / fastest if fastest > 0.0 else np.inf, self.system.loads.longest_step)


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
        self.system, self.phase, self.form, self.X = form.system, form.phase, form, X
        self._speed = speed  #: largest interface velocity so far × √mass, the scale of `_TAIL`
        self._force_limit = np.inf  #: what resolving r allows [s]
        self.elapsed = 0.0  #: since the start [s]

    def advance(self, remaining: float) -> Segment:
        """Make one step towards ``remaining`` [s] from here."""
        xi, xi_dot = self.form.pack(self.X)
        r = self.form.forces(xi[None], xi_dot[None])
        limit = self.form.longest_step(xi, xi_dot, r[:, 0], self.X)
        while True:
            size = min(limit, self._force_limit)
            # Powers of two recur, also in other segments: weights are dear.
            size = remaining if remaining <= size else 2.0 ** float(np.floor(np.log2(size)))
            segment = self._step(size, xi, xi_dot, r)
            if segment is not None:
                self._force_limit *= 2.0
                self.X = segment.states[-1]
                self.elapsed += size
                return segment
            self._force_limit = 0.5 * size
            if size < _SMALLEST_SHARE * remaining:
                raise ReferenceFailure(f"no step resolves the interface force in phase {self.phase.name}")

    def _step(self, size: float, xi: np.ndarray, xi_dot: np.ndarray, start: np.ndarray) -> Segment | None:
        """Make one step, or None where it is too long for the forces r, whose values at its start are given."""
        s, phase, form, X = self.system, self.phase, self.form, self.X
        w = form.weights(size)
        times = X[s.T] + size * GAUSS.nodes
        load = form.load_at(times)
        r = self._forces(w, xi, xi_dot, load, start)
        if r is None:
            return None
        xi, xi_dot = w.motion(xi, xi_dot, load + r.T @ form.inputs)
        root_mobility = np.sqrt(form.mobility)
        self._speed = max(self._speed, float(np.max(np.abs(xi_dot @ form.inputs.T / root_mobility), initial=0.0)))
        tail = np.sum(np.abs(r @ GAUSS.transform[-2:].T), axis=1)
        # A place that rounding would change as much is no reason for a shorter step.
        reach = NOISE * float(np.max(np.abs(form.ends @ xi.T), initial=0.0))
        if np.any((tail * size * root_mobility > _TAIL * self._speed) & (tail * size**2 * form.mobility > reach)):
            return None
        states = form.unpack(xi, xi_dot, np.append(times, X[s.T] + size), X)
        if not np.all(np.isfinite(states)):
            return None
        states[-1, s.D] = X[s.D] + size * float(GAUSS.weights @ s.dissipation_rate(phase, states[:-1]))
        if len(s.loads):
            states[-1, s.W] = X[s.W] + size * float(GAUSS.weights @ s.load_power(states[:-1]))
        nodes = np.concatenate([[0.0], GAUSS.nodes * size, [size]])
        states, speed = np.vstack([X, states]), self._speed

        def inside(tau: float) -> np.ndarray:
            # Stepped anew, because the forces of the whole segment may hold a kink that lies after τ.
            inner = ExponentialPropagator(form, states[0], speed)
            while tau - inner.elapsed > 1e-15 * tau:
                inner.advance(tau - inner.elapsed)
            return inner.X

        return Segment(nodes, states, inside)

    def _forces(
        self, w: StepWeights, xi: np.ndarray, xi_dot: np.ndarray, load: np.ndarray, start: np.ndarray
    ) -> np.ndarray | None:
        """Solve r = R(w, ẇ) at the Gauss points, (k, stages), by iteration; ``load`` are all other forces."""
        form, r = self.form, np.repeat(start, STAGES, axis=1)
        if not len(r):
            return r
        for iteration in range(_MAX_ITERATIONS):
            with np.errstate(over="ignore", invalid="ignore"):  # an escaping spring; found below
                displacements, velocities = w.motion(xi, xi_dot, load + r.T @ form.inputs)
                new = form.forces(displacements[:-1], velocities[:-1])
            if not np.all(np.isfinite(new)):
                return None
            change, scale = np.max(np.abs(new - r)), np.max(np.abs(new))
            r = new
            if change <= 4e-16 * scale or (iteration > 8 and change <= 1e-14 * scale):
                return r
        return None
