"""A beam without inertia as a `HybridSystem`: its tip is one coordinate that has a stiffness and no mass.

Equilibrium, K (q + α_b q̇) = e C + F, leaves of the beam the deflection u of its tip. With k the stiffness at the tip
and u_F its deflection under the loads::

    k (u + α_b u̇ − u_F) = C
    free    C = 0: u̇ = (u_F − u)/α_b; undamped, u = u_F
    joined  u = y, u̇ = z, which gives C;  m ż = s − C

A tip that is let go undamped jumps to u_F, and ½ k (u − u_F)² is lost. Meeting the spring costs nothing.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Literal

import numpy as np
from scipy.integrate import fixed_quad

from ..scene import Beam, Scene
from .exponential import LinearForm
from .hybrid_system import NOISE, HybridSystem
from .laws import Phase
from .semi_discrete import ModalBeam

#: What a spring alone has of a state X.
_OF_SPRING = slice(2, None)


class QuasiStaticSystem(HybridSystem):
    """Equations of a beam without inertia and a spring, under a rigid law."""

    def __init__(self, scene: Scene) -> None:
        assert scene.beam is not None
        k, rest, stored = _statics(scene.beam)
        one = np.ones(1)
        tip = ModalBeam(
            np.sqrt(k) * one,
            one,
            k * rest * one,
            scene.beam.length * one,
            one[None],
            one[None],
            one[None],
            scene.beam.alpha_b,
        )
        super().__init__(scene, tip)
        self.inverse_tip_mass = np.inf
        self._rest = rest
        #: Strain energy [J] under the loads that the tip's deflection does not tell.
        self._hidden = stored - 0.5 * k * rest**2

    def multiplier(self, phase: Phase) -> tuple[float, float]:
        return -1.0, 0.0

    def synchronise(self, phase: Phase, X: np.ndarray) -> np.ndarray:
        """Put the tip of X, in place, where the phase has it, on the spring or relaxing by itself; return X."""
        if self.joined(phase):
            X[..., self.A], X[..., self.V] = X[..., [self.Y]], X[..., [self.Z]]
        elif self.alpha_b > 0.0:
            X[..., self.V] = (self._rest - X[..., self.A]) / self.alpha_b
        else:
            X[..., self.A], X[..., self.V] = self._rest, 0.0
        return X

    def settle(self, phase: Phase, X: np.ndarray) -> float:
        before = X[self.A] - self._rest
        after = self.synchronise(phase, X)[self.A] - self._rest
        return 0.5 * float(self.stiffness @ (before**2 - after**2)) if phase.contact == "free" else 0.0

    def noise(self, unit: Literal["m", "m/s", "N"], X: np.ndarray) -> float:
        """Return the noise of any pair, and what the rounding of an event's time makes of a place, and of the force."""
        moved = NOISE * abs(float(X[self.T])) * (abs(float(X[self.V][0])) + abs(float(X[self.Z])))
        return super().noise(unit, X) + {"m": moved, "m/s": 0.0, "N": float(self.stiffness[0]) * moved}[unit]

    def shapes(self, states: np.ndarray) -> None:
        """Return nothing: the unknowns are those of the tip alone."""

    def energies(self, X: np.ndarray, phase: Phase) -> dict[str, np.ndarray]:
        found = super().energies(X, phase)
        found["e_beam"] = found["e_beam"] - 0.5 * np.sum(X[..., self.V] ** 2, axis=-1) + self._hidden
        found["e_load"] = found["e_load"] - 2.0 * self._hidden
        return found


class QuasiStaticForm(LinearForm):
    """A spring that bears the beam's stiffness, damping and load while it is joined; a free tip relaxes to u_F."""

    def __init__(self, system: HybridSystem, phase: Phase) -> None:
        spring, k = system.spring, float(system.stiffness[0])
        joined = system.joined(phase)
        if joined:
            added = {
                "linear_stiffness": spring.linear_stiffness + k,
                "damping": spring.damping + system.alpha_b * k,
                "external_force": spring.external_force + float(system.load[0]),
            }
            spring = spring.model_copy(update=added)
        alone = HybridSystem(system.scene.model_copy(update={"upper": None, "lower": spring}))
        super().__init__(alone, Phase("free", phase.seated))
        self._pair, self._pair_phase = system, phase
        self._relaxing = not joined and system.alpha_b > 0.0
        self._rest = system.load / system.stiffness

    def pack(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return super().pack(X[_OF_SPRING])

    def unpack(self, xi: np.ndarray, xi_dot: np.ndarray, times: np.ndarray, X: np.ndarray) -> np.ndarray:
        s, states = self._pair, np.repeat(X[None, :], len(xi), axis=0)
        states[:, _OF_SPRING] = super().unpack(xi, xi_dot, times, X[_OF_SPRING])
        if self._relaxing:
            states[:, s.A] = self._rest + (X[s.A] - self._rest) * np.exp((X[s.T] - times) / s.alpha_b)[:, None]
        return s.synchronise(self._pair_phase, states)

    def longest_step(self, xi: np.ndarray, xi_dot: np.ndarray, r: np.ndarray, X: np.ndarray) -> float:
        longest = super().longest_step(xi, xi_dot, r, X[_OF_SPRING])
        if self._relaxing and abs(float(X[0] - self._rest[0])) > self._pair.noise("m", X):
            return min(longest, self._pair.alpha_b)
        return longest


def _statics(beam: Beam) -> tuple[float, float, float]:
    """Return (k, u_F, ½ work of the loads) by the influence function G(x, ξ) of a unit force at ξ."""
    L, h = beam.length, beam.length / beam.n_elements
    EI = beam.young_modulus * beam.second_moment_of_area
    KAG = beam.shear_coefficient * beam.area * beam.shear_modulus

    def integral(f: Callable[[np.ndarray], np.ndarray], *breaks: float) -> float:
        parts = itertools.pairwise(np.unique([0.0, L, *breaks]))
        return float(sum(fixed_quad(f, a, b, n=5)[0] for a, b in parts))

    def influence(x: float, at: np.ndarray) -> np.ndarray:
        low, high = np.minimum(x, at), np.maximum(x, at)
        return np.asarray(low / KAG + low**2 * (3.0 * high - low) / (6.0 * EI))

    def load(x: np.ndarray) -> np.ndarray:
        return beam.distributed_load + beam.tip_load_coefficient * np.maximum(0.0, 1.0 - (L - x) / h)

    def deflection(x: float) -> float:
        return integral(lambda at: influence(x, at) * load(at), L - h, x)

    work = integral(lambda x: load(x) * np.array([deflection(at) for at in x]), L - h)
    return 1.0 / float(influence(L, np.array([L]))[0]), deflection(L), 0.5 * work
