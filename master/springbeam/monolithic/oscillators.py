"""Damped oscillators ξ̈ + c ξ̇ + ω² ξ = f(t), many at once, under forces that are polynomials over a step.

Free response and response to a polynomial are exact to rounding for any step, underdamped to overdamped, however
fast the oscillator. With the roots s₁,₂ = −σ ± √(σ² − ω²), σ = c/2::

    S(τ) = (e^{s₁τ} − e^{s₂τ})/(s₁ − s₂)    response to a unit impulse;    C = Ṡ + 2σ S    to a unit displacement
    ξ(τ) = C(τ) ξ₀ + S(τ) ξ̇₀ + ∫₀^τ S(τ − ν) f(ν) dν
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.laguerre import laggauss

#: Gauss points of a step, at which forces are given.
STAGES = 24
#: Points at which S and Ṡ are taken where all roots are below `_SLOW`/h: they interpolate e^{iθ}, θ ≤ 60, to 1e-13.
_KERNEL_POINTS = 64
_SLOW = 60.0
#: Roots nearer than this share of σ are moved apart by it: S changes by its square.
_CRITICAL = 1e-6


class GaussRule:
    """Gauss–Legendre collocation on [0, 1]: nodes, weights, Legendre transform."""

    def __init__(self, stages: int) -> None:
        x, w = np.polynomial.legendre.leggauss(stages)
        self.nodes = 0.5 * (x + 1.0)
        self.weights = 0.5 * w
        #: (stages, stages): values at the nodes → Legendre coefficients.
        self.transform = np.polynomial.legendre.legvander(x, stages - 1).T * w * (np.arange(stages)[:, None] + 0.5)

    def lagrange(self, x: np.ndarray) -> np.ndarray:
        """Return ℓ_k, which is 1 at node k and 0 at the others, at ``x`` in [0, 1]: (..., stages)."""
        return np.polynomial.legendre.legvander(2.0 * x - 1.0, len(self.nodes) - 1) @ self.transform


GAUSS = GaussRule(STAGES)
_KERNEL = GaussRule(_KERNEL_POINTS)
#: Where a step is evaluated: the Gauss points and the end, as fractions of it.
TARGETS = np.append(GAUSS.nodes, 1.0)
#: Points and weights of ∫₀^∞ e^{−x} f(x) dx, exact where f has the degree of ℓ_k.
_DECAY, _DECAY_WEIGHTS = laggauss(STAGES // 2)


def _convolutions() -> np.ndarray:
    """Return ∫₀^c L_m(c − x) ℓ_k(x) dx for each target c, (targets, stages, kernel points).

    ℓ_k and L_m are 1 at one Gauss point and at one kernel point and 0 at the others.
    """
    exact = GaussRule((STAGES + _KERNEL_POINTS) // 2)  # for a product of these
    inside = TARGETS[:, None] * exact.nodes
    forces = GAUSS.lagrange(inside) * (TARGETS[:, None] * exact.weights)[..., None]
    return np.swapaxes(forces, 1, 2) @ _KERNEL.lagrange(TARGETS[:, None] - inside)


_CONVOLUTIONS = _convolutions()


@dataclass(frozen=True)
class StepWeights:
    """Maps from the start of a step, and from forces at its Gauss points, to the targets; p oscillators."""

    start: np.ndarray  #: (2, 2, targets, p): C, S take ξ₀, ξ̇₀ to ξ; Ċ, Ṡ to ξ̇
    force: np.ndarray  #: (2, targets, stages, p): ∫₀^τ S(τ − ν) ℓ_k(ν) dν; … with Ṡ in place of S

    def free(self, xi: np.ndarray, xi_dot: np.ndarray) -> np.ndarray:
        """Return ξ and ξ̇ at the targets, (2, targets, p), from those at the start without forces."""
        return self.start[:, 0] * xi + self.start[:, 1] * xi_dot

    def forced(self, forces: np.ndarray, patterns: np.ndarray) -> np.ndarray:
        """Return ξ and ξ̇ at the targets, (2, targets, p), from rest under k ``forces``, (stages, k), (k, p)."""
        return np.sum((forces.T @ self.force) * patterns, axis=2)


class Oscillators:
    """p oscillators.

    Parameters
    ----------
    omega2 : (p,) array
        ω² [1/s²]; may be zero or negative.
    c : (p,) array
        Damping [1/s].
    """

    def __init__(self, omega2: np.ndarray, c: np.ndarray) -> None:
        self.omega2 = omega2
        self.c = c
        self.sigma = 0.5 * c
        #: s₁, s₂ with |s₁| ≤ |s₂|, (p,) complex; apart, so that one can divide by their difference.
        self.slow, self.fast = self._roots(_CRITICAL)
        #: |s₁| and |s₂| [1/s], (2p,).
        self.rates = np.abs(np.concatenate([self.slow, self.fast]))
        apart = np.tile(self.slow - self.fast, 2)
        #: 1/(s₁ − s₂) where the root is none of a rest, (2p,), and 1/ω², (p,); 0 of a mode that nothing holds.
        self._between = np.divide(1.0, apart, out=np.zeros_like(apart), where=(apart != 0.0) & (self.rates > 0.0))
        self._compliance = np.divide(1.0, omega2, out=np.zeros_like(omega2), where=omega2 != 0.0)

    def _roots(self, apart: float) -> tuple[np.ndarray, np.ndarray]:
        """Return s₁ and s₂, nearer ones moved ``apart`` by this share of σ on either side."""
        sigma = self.sigma
        discriminant = self.sigma**2 - self.omega2
        root = np.maximum(np.sqrt(np.abs(discriminant)), apart * np.abs(sigma))
        over = discriminant > 0.0
        half = np.where(over, np.copysign(root, sigma), 1j * root)
        fast = -sigma - half
        # The product of the roots is ω²: their sum would cancel.
        with np.errstate(divide="ignore", invalid="ignore"):
            slow = np.where(over & (fast != 0.0), self.omega2 / fast, -sigma + half)
        return slow, fast

    def kernels(self, tau: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return S and Ṡ = s₁ S + e^{s₂τ} at times ``tau``, shape tau.shape + (p,)."""
        t = tau[..., None]
        slow, fast = self._roots(0.0)
        between = (fast - slow) * t
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = np.where(between == 0.0, 1.0, np.expm1(between) / between)  # of e^{(s₂ − s₁)ν} over [0, τ]
        S = t * np.exp(slow * t) * mean
        return S.real, (slow * S + np.exp(fast * t)).real

    def weights(self, size: float, at: slice = slice(None)) -> StepWeights:
        """Return the weights of a step of ``size`` [s], of those targets that ``at`` picks."""
        S, S_dot = self.kernels(TARGETS[at] * size)
        force = np.empty((2, len(S), STAGES, len(self.omega2)))
        near = np.abs(self.fast) * size <= _SLOW
        if np.any(near):
            oscillators = Oscillators(self.omega2[near], self.c[near])
            kernels = oscillators.kernels(_KERNEL.nodes * size)
            force[..., near] = [_CONVOLUTIONS[at] @ (size * kernel) for kernel in kernels]
        if not np.all(near):
            far = ~near
            slow = self.slow[far]
            fast = self.fast[far]
            with_slow = _convolve(slow, size, at)
            with_fast = _convolve(fast, size, at)
            force[0][..., far] = ((with_slow - with_fast) / (slow - fast)).real
            force[1][..., far] = ((slow * with_slow - fast * with_fast) / (slow - fast)).real
        start = np.array([[S_dot + self.c * S, S], [-self.omega2 * S, S_dot]])
        return StepWeights(start, force)

    def amplitudes(self, xi: np.ndarray, xi_dot: np.ndarray, forces: np.ndarray) -> np.ndarray:
        """Return the amplitudes at ``rates`` of the free motion about equilibrium under ``forces``, (k, p): (k, 2p)."""
        off = xi - forces * self._compliance
        both = np.concatenate([xi_dot - self.fast * off, self.slow * off - xi_dot], axis=1)
        return np.abs(both * self._between)


def _convolve(s: np.ndarray, size: float, at: slice) -> np.ndarray:
    """Return ∫₀^τ e^{s(τ − ν)} ℓ_k(ν) dν at those targets that ``at`` picks, for roots s: (targets, stages, len(s)).

    With z = s h and c = τ/h it is (e^{zc} L(0) − L(c))/s, L(c) = ∫₀^∞ e^{−x} ℓ_k(c + x/z) dx. That loses nothing where
    |z| is large; elsewhere the exponential is interpolated.
    """
    z = size * s
    c = TARGETS[at]
    slow = np.abs(z) <= _SLOW
    fast = z[~slow]
    ahead = GAUSS.lagrange(np.append(0.0, c)[:, None, None] + _DECAY[:, None] / fast)
    start, *ends = np.swapaxes(np.tensordot(ahead, _DECAY_WEIGHTS, ([1], [0])), 1, 2)
    convolved = np.empty((len(c), STAGES, len(s)), complex)
    convolved[..., slow] = _CONVOLUTIONS[at] @ (size * np.exp(_KERNEL.nodes[:, None] * z[slow]))
    convolved[..., ~slow] = (np.exp(c[:, None, None] * fast) * start - ends) / s[~slow]
    return convolved
