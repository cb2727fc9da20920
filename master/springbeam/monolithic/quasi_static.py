"""A beam without inertia as a `HybridSystem`: its tip is one coordinate that has a stiffness and no mass.

Equilibrium, K (q + α_b q̇) = e C + F, leaves of the beam the deflection u of its tip. With k the stiffness at the tip
and u_F its deflection under the loads::

    k (u + α_b u̇ − u_F) = C
    free    C = 0: α_b ü + u̇ = 0 from u̇ = (u_F − u)/α_b on; undamped, u = u_F
    joined  u = y: the spring bears k, α_b k and k u_F as well, and C follows

A tip that is let go undamped jumps to u_F, and ½ k (u − u_F)² is lost. Meeting the spring costs nothing.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from ..scene import Beam, Scene
from .hybrid_system import NOISE, HybridSystem, Oscillating
from .laws import Phase
from .semi_discrete import ModalBeam, points


class QuasiStaticSystem(HybridSystem):
    """Equations of a beam without inertia and a spring, under a rigid law; x = (u, √m y)."""

    def __init__(self, scene: Scene) -> None:
        assert scene.beam is not None
        k, rest, stored = _statics(scene.beam)
        one = np.ones(1)
        shape, length = one[None], scene.beam.length * one
        super().__init__(
            scene, ModalBeam(np.sqrt(k) * one, one, k * rest * one, length, shape, shape, shape, scene.beam.alpha_b)
        )
        self.tip_mobility = self.mobility = np.inf
        self._rest = rest
        #: Strain energy [J] under the loads that the tip's deflection does not tell.
        self._hidden = stored - 0.5 * k * rest**2

    def row(self, phase: Phase) -> None:
        """Return nothing: no force is needed to take along what has no mass."""

    def oscillating(self, phase: Phase) -> Oscillating:
        """Return the spring, which bears the beam while it is joined, or beside it a tip that relaxes."""
        moving, omega2, c, load = super().oscillating(phase)
        if self.joined(phase):
            borne = (part[:1] / self.mass for part in (self.omega2, self.c, self.load * self.root_mass))
            return Oscillating(
                slice(1, moving.stop), *(own[1:] + more for own, more in zip((omega2, c, load), borne, strict=True))
            )
        relaxation = 1.0 / self.alpha_b if self.alpha_b else 0.0
        return Oscillating(moving, np.append(0.0, omega2[1:]), np.append(relaxation, c[1:]), np.append(0.0, load[1:]))

    def contact_force(self, phase: Phase, own: np.ndarray, p: np.ndarray, rate: np.ndarray) -> np.ndarray:
        return -own[..., 0] * self.joined(phase)

    def synchronise(self, phase: Phase, X: np.ndarray) -> np.ndarray:
        """Put the tip of X, in place, where the phase has it, on the spring or relaxing by itself; return X."""
        super().synchronise(phase, X)
        u, v = X[..., self.A], X[..., self.V]
        if self.joined(phase):
            u[..., 0], v[..., 0] = u[..., 1] / self.root_mass, v[..., 1] / self.root_mass
        elif self.alpha_b > 0.0:
            v[..., 0] = (self._rest - u[..., 0]) / self.alpha_b
        else:
            u[..., 0], v[..., 0] = self._rest, 0.0
        return X

    def settle(self, phase: Phase, X: np.ndarray) -> float:
        before = X[0] - self._rest
        after = self.synchronise(phase, X)[0] - self._rest
        return 0.5 * float(self.omega2[0] * (before**2 - after**2)) if phase.contact == "free" else 0.0

    def noise(self, unit: Literal["m", "m/s", "N"], X: np.ndarray) -> float:
        """Return the noise of any pair, and what the rounding of an event's time makes of a place, and of the force."""
        moved = NOISE * abs(float(X[self.T])) * float(np.abs(X[self.V]) @ (self.tip + self.top))
        force = NOISE * float(self.omega2[0] * abs(X[0]) + self.c[0] * abs(X[self.n]) + abs(self.load[0]))
        return super().noise(unit, X) + {"m": moved, "m/s": 0.0, "N": float(self.omega2[0]) * moved + force}[unit]

    def shapes(self, states: np.ndarray) -> None:
        """Return nothing: the unknowns are those of the tip alone."""

    def energies(self, X: np.ndarray, phase: Phase) -> dict[str, np.ndarray]:
        found = super().energies(X, phase)
        found["e_beam"] = found["e_beam"] - 0.5 * X[..., self.n] ** 2 + self._hidden
        found["e_load"] = found["e_load"] - 2.0 * self._hidden
        return found


def _statics(beam: Beam) -> tuple[float, float, float]:
    """Return (k, u_F, ½ work of the loads) by the moments and shear forces of the loads and of a unit tip force."""
    x, dx = points(beam)
    EI = beam.young_modulus * beam.second_moment_of_area
    KAG = beam.shear_coefficient * beam.area * beam.shear_modulus
    h, arm = beam.length / beam.n_elements, beam.length - x
    near = np.minimum(arm, h)  # of the tip: where the hat function of its load is not zero
    hat, lever = near - near**2 / (2.0 * h), near**2 / 2.0 - near**3 / (3.0 * h)
    shear = beam.distributed_load * arm + beam.tip_load_coefficient * hat
    moment = 0.5 * beam.distributed_load * arm**2 + beam.tip_load_coefficient * (arm * hat - lever)
    compliance = float(dx @ (arm**2 / EI + 1.0 / KAG))
    deflection = float(dx @ (arm * moment / EI + shear / KAG))
    return 1.0 / compliance, deflection, 0.5 * float(dx @ (moment**2 / EI + shear**2 / KAG))
