"""Two ways to integrate one phase of a `HybridSystem`, chosen to share no error.

`RungeKuttaPropagator` hands dX/dt to scipy (DOP853, Radau). `ExponentialPropagator` diagonalises the phase's linear
part and solves it exactly; what is nonlinear or not proportionally damped enters as forces r(t) that act at the
interface, collocated at s Gauss points of each step::

    ξ̈ + α_b ω² ξ̇ + ω² ξ = c + P r(t),     r = R(y, z, u),
    ξ(τ) = C(τ) ξ₀ + S(τ) ξ̇₀ + ∫₀^τ S(τ − σ) (c + P r(σ)) dσ,    S the response to a unit impulse, C = Ṡ + α_b ω² S

Steps need not resolve the beam's period for accuracy in a linear phase, only for seeing its events.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg
from scipy.integrate import DOP853, Radau, solve_ivp

from .hybrid_system import HybridSystem, Phase, ReferenceFailure

METHODS = ("exponential", "DOP853", "Radau")
_STAGES = 12
_QUADRATURE = 24
_MAX_HALVINGS = 60
#: Step size × largest |root| of the phase: 12 Gauss points interpolate e^{iθ}, θ ≤ 2, to 1e-12.
_STEP_PHASE = 2.0
#: Largest accepted impulse of the last two Legendre coefficients of r over a step, as a share of the momentum there.
#: The step's end is far more exact: Gauss points integrate what these coefficients leave out.
_TAIL = 1e-12


class Segment(ABC):
    """One accepted step of size ``size`` [s] with states at ``nodes``, 0 and ``size`` among them."""

    size: float
    nodes: np.ndarray  #: (k,)
    states: np.ndarray  #: (k, 2r + 3); good enough to find events, exact at both ends

    @abstractmethod
    def state(self, tau: float) -> np.ndarray:
        """X at ``tau`` after the start, at the accuracy of the method."""


class Propagator(ABC):
    """Advances a state within one phase."""

    @abstractmethod
    def advance(self, remaining: float) -> Segment:
        """One step; ends at ``remaining`` [s] from here at the latest if the method chooses its steps itself."""


@dataclass
class _RungeKuttaSegment(Segment):
    owner: RungeKuttaPropagator
    start: np.ndarray
    size: float
    nodes: np.ndarray
    states: np.ndarray

    def state(self, tau: float) -> np.ndarray:
        if tau <= 0.0:
            return np.array(self.start)
        # Again from the start, because the dense output is a power of the step less accurate.
        solution = solve_ivp(
            self.owner.rhs,
            (0.0, tau),
            self.start,
            method=self.owner.method,
            rtol=self.owner.rtol,
            atol=self.owner.atol,
            first_step=tau,
        )
        return self.owner.system.synchronise(self.owner.phase, solution.y[:, -1].copy())


class RungeKuttaPropagator(Propagator):
    """scipy's DOP853 or Radau on the modal form."""

    def __init__(
        self,
        system: HybridSystem,
        phase: Phase,
        X: np.ndarray,
        horizon: float,
        method: str,
        rtol: float,
        atol: float,
    ) -> None:
        self.system, self.phase, self.method, self.rtol, self.atol = system, phase, method, rtol, atol
        solver: Any = {"DOP853": DOP853, "Radau": Radau}[method]
        self._solver = solver(self.rhs, 0.0, X.copy(), horizon, rtol=rtol, atol=atol)

    def rhs(self, _time: float, X: np.ndarray) -> np.ndarray:
        return self.system.derivative(self.phase, X)

    def advance(self, remaining: float) -> Segment:
        solver = self._solver
        start, begin = solver.y.copy(), solver.t
        message = solver.step()
        if solver.status == "failed":
            raise ReferenceFailure(f"{self.method} failed in phase {self.phase.name}: {message}")
        size = solver.t - begin
        nodes = np.linspace(0.0, size, 10)
        states = solver.dense_output()(begin + nodes).T
        states[0], states[-1] = start, solver.y
        return _RungeKuttaSegment(self, start, size, nodes, self.system.synchronise(self.phase, states))


@dataclass(frozen=True)
class _Weights:
    """Maps over [0, τᵢ] for targets τᵢ: free response and response to the forces at the Gauss points."""

    C: np.ndarray  #: (targets, p)
    S: np.ndarray
    C_dot: np.ndarray
    S_dot: np.ndarray
    force: np.ndarray  #: (targets, stages, p): ∫ S(τᵢ − σ) ℓ_k(σ) dσ
    force_dot: np.ndarray


class _GaussRule:
    """Gauss–Legendre collocation on [0, 1]: nodes, weights, Lagrange basis, Legendre transform."""

    def __init__(self, stages: int) -> None:
        x, w = np.polynomial.legendre.leggauss(stages)
        self.nodes = 0.5 * (x + 1.0)
        self.weights = 0.5 * w
        vandermonde = np.polynomial.legendre.legvander(x, stages - 1)
        self.transform = vandermonde.T * w * (np.arange(stages)[:, None] + 0.5)
        self.stages = stages

    def lagrange(self, c: np.ndarray) -> np.ndarray:
        """ℓ_k(c): shape c.shape + (stages,)."""
        return np.asarray(np.polynomial.legendre.legvander(2.0 * c - 1.0, self.stages - 1) @ self.transform)


_GAUSS = _GaussRule(_STAGES)
_INNER = _GaussRule(_QUADRATURE)
_TARGETS = np.append(_GAUSS.nodes, 1.0)
#: Quadrature points on [0, c] for each target c, shape (targets, Q), and weight × ℓ_k there, (targets, stages, Q).
_ELAPSED = _TARGETS[:, None] * _INNER.nodes
_FORCE_BASIS = np.swapaxes(_GAUSS.lagrange(_ELAPSED) * (_TARGETS[:, None] * _INNER.weights)[..., None], 1, 2)


class LinearForm:
    """The linear part of a phase in M-orthonormal coordinates ξ, with inputs r at the interface."""

    def __init__(self, system: HybridSystem, phase: Phase) -> None:
        self.system, self.phase = system, phase
        r, b, load = system.r, system.b, system.load
        p = system.spring
        m, root_m = p.mass, np.sqrt(p.mass)
        spring_moves = system.has_spring and not phase.seated
        joined = system.joined(phase)
        held = phase.seated and (joined or not system.has_spring)
        #: A joined spring takes part in α_b × stiffness; its own damping is corrected in r.
        self.damping_correction = p.damping - system.alpha_b * p.linear_stiffness
        self.offset = np.zeros(r)
        if held:
            if system.scene.stop is None:
                raise ReferenceFailure("seated without a stop")
            beta = system.inverse_tip_mass
            self.offset = b * (system.scene.stop.position / beta)
            tangent = scipy.linalg.null_space(b[None, :])
            omega2, modes = _modes(system.omega[:, None] * tangent)
            self.basis = tangent @ modes
            self.omega2 = omega2
            self.constant = self.basis.T @ (load - system.stiffness * self.offset)
            self.inputs = np.zeros((0, len(omega2)))
        elif joined:
            beta = system.inverse_tip_mass
            # M = I + m bbᵀ; its inverse root is I − γ bbᵀ.
            gamma = (1.0 - 1.0 / np.sqrt(1.0 + m * beta)) / beta
            inverse_root = np.eye(r) - gamma * np.outer(b, b)
            if p.linear_stiffness >= 0.0:
                factor = np.vstack([np.diag(system.omega), np.sqrt(p.linear_stiffness) * b])
                omega2, modes = _modes(factor @ inverse_root)
            else:
                K = np.diag(system.stiffness) + p.linear_stiffness * np.outer(b, b)
                omega2, modes = np.linalg.eigh(inverse_root @ K @ inverse_root)
            self.basis = inverse_root @ modes
            self._to_modes = modes.T @ (np.eye(r) + (np.sqrt(1.0 + m * beta) - 1.0) / beta * np.outer(b, b))
            self.omega2 = omega2
            self.constant = self.basis.T @ (load + b * p.external_force)
            self.inputs = (self.basis.T @ b)[None, :]
        else:
            self.omega2 = system.stiffness
            self.constant = load
            self.inputs = np.zeros((0, r))
            self.basis = np.eye(r)
            if spring_moves:
                self.omega2 = np.append(self.omega2, p.linear_stiffness / m)
                self.constant = np.append(load, p.external_force / root_m)
                self.inputs = np.append(np.zeros(r), 1.0 / root_m)[None, :]
            if system.two_bodies and system.compliance and phase.contact != "free":
                push = np.append(b, -1.0 / root_m) if spring_moves else b
                self.inputs = np.vstack([self.inputs, push])
        self.joined, self.held, self.spring_moves = joined, held, spring_moves
        self.sigma = 0.5 * system.alpha_b * self.omega2
        discriminant = self.sigma**2 - self.omega2
        roots = np.where(
            discriminant > 0.0,
            np.abs(self.sigma) + np.sqrt(np.maximum(discriminant, 0.0)),
            np.sqrt(np.abs(self.omega2)),
        )
        self.radius = float(roots.max(initial=0.0))  #: largest |root| [1/s]
        self._cache: dict[str, _Weights] = {}

    def pack(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        s = self.system
        a, v = X[s.A] - self.offset, X[s.V]
        if self.joined and not self.held:
            return self._to_modes @ a, self._to_modes @ v
        if self.held:
            return self.basis.T @ a, self.basis.T @ v
        if self.spring_moves:
            root = np.sqrt(s.spring.mass)
            return np.append(a, root * X[s.Y]), np.append(v, root * X[s.Z])
        return a, v

    def unpack(self, xi: np.ndarray, xi_dot: np.ndarray, X: np.ndarray) -> np.ndarray:
        """States of shape (k, 2r + 3) from modes of shape (k, p); X supplies what does not move."""
        s = self.system
        states = np.tile(X, (len(xi), 1))
        if self.joined or self.held:
            states[:, s.A] = xi @ self.basis.T + self.offset
            states[:, s.V] = xi_dot @ self.basis.T
            return s.synchronise(self.phase, states)
        states[:, s.A], states[:, s.V] = xi[:, : s.r], xi_dot[:, : s.r]
        if self.spring_moves:
            root = np.sqrt(s.spring.mass)
            states[:, s.Y], states[:, s.Z] = xi[:, -1] / root, xi_dot[:, -1] / root
        return states

    def forces(self, xi: np.ndarray, xi_dot: np.ndarray, X: np.ndarray) -> np.ndarray:
        """R: the inputs r, shape (inputs, k), at modes of shape (k, p)."""
        s = self.system
        if not len(self.inputs):
            return np.zeros((0, len(xi)))
        rows = []
        if self.joined:
            y, z = xi @ self.inputs[0], xi_dot @ self.inputs[0]
        elif self.spring_moves:
            root = np.sqrt(s.spring.mass)
            y, z = xi[:, -1] / root, xi_dot[:, -1] / root
        else:
            y = np.full(len(xi), X[s.Y])
            z = np.zeros(len(xi))
        if self.joined or self.spring_moves:
            rows.append(-self.damping_correction * z - s.spring.cubic_stiffness * y**3)
        if len(self.inputs) > len(rows):
            rows.append(s.compliance_force(y - xi[:, : s.r] @ s.b))
        return np.array(rows)

    def kernels(self, tau: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """S and Ṡ at times ``tau``: shape tau.shape + (p,)."""
        t = np.asarray(tau)[..., None]
        sigma, omega2 = self.sigma, self.omega2
        discriminant = sigma**2 - omega2
        over = discriminant > 0.0
        root = np.sqrt(np.abs(discriminant))
        decay = np.exp(-sigma * t)
        x = root * t
        with np.errstate(over="ignore", invalid="ignore"):
            S = np.where(over, t * decay * _sinhc(x), t * decay * np.sinc(x / np.pi))
            S_dot = np.where(over, decay * np.cosh(x), decay * np.cos(x)) - sigma * S
        far = over & (x > 1.0)
        if np.any(far):
            safe = np.where(over, root, 1.0)
            slow = -omega2 / (safe + sigma)  # = root − σ without the cancellation
            first, second = np.exp(slow * t), np.exp(-(safe + sigma) * t)
            S = np.where(far, (first - second) / (2.0 * safe), S)
            S_dot = np.where(far, (slow * first + (safe + sigma) * second) / (2.0 * safe), S_dot)
        return S, S_dot

    def weights(self, size: float) -> _Weights:
        """Weights of a step of ``size`` [s] at the Gauss points and the end; the last ones used are kept."""
        key = f"{size:.12e}"  # differences of equally spaced times are equal only to rounding
        known = self._cache.pop(key, None)
        if known is not None:
            self._cache[key] = known
            return known
        S, S_dot = self.kernels(_TARGETS * size)
        kernel, kernel_dot = self.kernels((_TARGETS[:, None] - _ELAPSED) * size)
        basis = _FORCE_BASIS * size
        result = _Weights(
            C=S_dot + 2.0 * self.sigma * S,
            S=S,
            C_dot=-self.omega2 * S,
            S_dot=S_dot,
            force=np.matmul(basis, kernel),
            force_dot=np.matmul(basis, kernel_dot),
        )
        if len(self._cache) >= 64:
            self._cache.pop(next(iter(self._cache)))
        self._cache[key] = result
        return result

    def respond(self, w: _Weights, xi: np.ndarray, xi_dot: np.ndarray, r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Modes at the targets, shape (targets, p), under the forces r of shape (inputs, stages)."""
        load = self.constant + r.T @ self.inputs  # (stages, p)
        return (
            w.C * xi + w.S * xi_dot + np.einsum("ikj,kj->ij", w.force, load),
            w.C_dot * xi + w.S_dot * xi_dot + np.einsum("ikj,kj->ij", w.force_dot, load),
        )


def _sinhc(x: np.ndarray) -> np.ndarray:
    safe = np.where(x > 0.0, x, 1.0)
    return np.where(x > 0.0, np.sinh(np.minimum(safe, 700.0)) / safe, 1.0)


def _modes(factor: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """ω² and orthonormal modes of factorᵀfactor, from singular values (see `semi_discrete`)."""
    _, sigma, vt = scipy.linalg.svd(factor, full_matrices=False)
    return sigma[::-1] ** 2, vt[::-1].T


@dataclass
class _ExponentialSegment(Segment):
    form: LinearForm
    size: float
    nodes: np.ndarray
    states: np.ndarray
    speed: float

    def state(self, tau: float) -> np.ndarray:
        # Stepped anew, because the forces of the whole segment may hold a kink that lies after τ.
        inner = ExponentialPropagator(self.form, self.states[0].copy(), self.speed)
        elapsed = 0.0
        while tau - elapsed > 1e-15 * tau:
            elapsed += inner.advance(tau - elapsed).size
        return np.array(inner.X)


class ExponentialPropagator(Propagator):
    """Exact in the phase's linear part, Gauss collocation in the rest."""

    def __init__(self, form: LinearForm, X: np.ndarray, speed: float = 0.0) -> None:
        self.form, self.X = form, X
        self._speed = speed  # largest interface velocity so far × √mass, the scale of `_TAIL`
        self._mobility = np.sum(form.inputs**2, axis=1)  # [1/kg]
        self._limit = _STEP_PHASE / form.radius if form.radius > 0.0 else np.inf
        self._halvings = 0

    def advance(self, remaining: float) -> Segment:
        steps = 1.0 if np.isinf(self._limit) else np.ceil(remaining / self._limit * (1.0 - 1e-9))
        whole = remaining / max(steps, 1.0)
        while self._halvings < _MAX_HALVINGS:
            # Halved steps keep to limit/2ᵏ, whose weights are known already.
            size = whole if self._halvings == 0 else min(self._limit, remaining) * 0.5**self._halvings
            segment = self._step(size if remaining > 1.5 * size else remaining)
            if segment is not None:
                self.X = segment.states[-1].copy()
                self._halvings = max(self._halvings - 1, 0)
                return segment
            self._halvings += 1
        raise ReferenceFailure(f"no step resolves the interface force in phase {self.form.phase.name}")

    def _step(self, size: float) -> _ExponentialSegment | None:
        form, X = self.form, self.X
        w = form.weights(size)
        modes = form.pack(X)
        r = np.repeat(form.forces(modes[0][None], modes[1][None], X), _STAGES, axis=1)
        for iteration in range(60):
            xi, xi_dot = form.respond(w, *modes, r)
            new = form.forces(xi[:-1], xi_dot[:-1], X)
            if not np.all(np.isfinite(new)):
                return None
            change, scale = np.max(np.abs(new - r), initial=0.0), np.max(np.abs(new), initial=0.0)
            r = new
            if change <= 4e-16 * scale or (iteration > 8 and change <= 1e-14 * scale):
                break
        else:
            return None
        if len(r):
            self._speed = max(self._speed, float(np.max(np.abs(xi_dot @ form.inputs.T / np.sqrt(self._mobility)))))
            tail = np.sum(np.abs(r @ _GAUSS.transform[-2:].T), axis=1)
            if np.any(tail * size * np.sqrt(self._mobility) > _TAIL * self._speed):
                return None
        xi, xi_dot = form.respond(w, *modes, r)
        states = form.unpack(xi, xi_dot, X)
        if not np.all(np.isfinite(states)):
            return None
        end = _with_dissipation(form.system, X, states, size)
        states = np.vstack([X, states[:-1], end])
        nodes = np.concatenate([[0.0], _GAUSS.nodes * size, [size]])
        return _ExponentialSegment(form, size, nodes, states, self._speed)


def _with_dissipation(system: HybridSystem, start: np.ndarray, states: np.ndarray, size: float) -> np.ndarray:
    """The last of ``states`` with D integrated over the Gauss points, which are the others."""
    end = np.array(states[-1])
    end[system.D] = start[system.D] + size * float(_GAUSS.weights @ system.dissipation_rate(states[:-1]))
    return end
