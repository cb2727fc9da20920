"""The beam without its inertia: a tip compliance, solved here and now, with no FMU.

Without mass every section is in equilibrium, M q̈ = 0, and K (q + α_b q̇) = e C + F leaves one unknown, the tip's
deflection w from where the loads alone hold it (`springbeam.scene.statics`):

    k (w + α_b ẇ) = C,     1/k = L³/3EI + L/KAG,     u_tip = u_load + w.

Joined, C is a polynomial of degree d over the step and w one of degree d + 1 that starts where it is and satisfies the
equation in the mean against all polynomials of degree d (a continuous Petrov–Galerkin method; d = 0 is the midpoint
rule). Since ẇ is such a polynomial, the work of C is accounted for exactly,

    ∫ C ẇ dτ = ½ k Δ(w²) + α_b k ∫ ẇ² dτ,

at any step and any α_b ≥ 0: what the conditions of scheme `energy` need (`springbeam.coupling.solver`). (The exact
response to a polynomial force would not do: without damping it jumps whenever C does.) Nothing at its end,
w = w₀ e^{−τ/α_b}.
"""

from __future__ import annotations

import math
from functools import lru_cache
from operator import mul
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre

from ..scene import Beam, statics
from ..scene.statics import SHAPE_POINTS
from . import force
from .protocol import NO_FORCE, SIZES_REMEMBERED, Body, Energies, Force, Motion


class BendState(NamedTuple):
    """What changes of a beam without inertia."""

    w: float  #: [m]
    velocity: float  #: [m/s]
    integral: float = 0.0  #: of u_tip over the last step, as in `Motion`
    integral_2: float = 0.0
    dissipated: float = 0.0  #: so far [J]


class QuasiStaticBeam(Body):
    """The massless beam as a body.

    Parameters
    ----------
    beam
        Of the scene; its mesh, modes and density play no part.
    degree
        d, of the contact force over a step.
    tip, velocity
        u_tip [m] and its rate [m/s] at the start.
    """

    state: BendState

    #: An impulse meets nothing.
    mass = 0.0

    def __init__(self, beam: Beam, degree: int, tip: float, velocity: float) -> None:
        self._stiffness = 1.0 / statics.tip_compliance(beam)
        self._alpha = beam.alpha_b
        self._degree = degree
        self.damping = self._alpha * self._stiffness
        self.reach = statics.tip_reach(beam)
        self._tip_shape = statics.tip_force_shape(beam, SHAPE_POINTS)
        self._load_shape = statics.load_shape(beam, SHAPE_POINTS)
        self._arm = beam.length * (1.0 - SHAPE_POINTS)
        self._load_shear, self._load_moment = statics.load_forces(beam, self._arm)
        self._rest = statics.tip_load_deflection(beam)
        self._load_energy = statics.load_energy(beam)
        self.state = BendState(tip - self._rest, velocity)
        self._responses = lru_cache(SIZES_REMEMBERED)(self._response)

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE) -> Motion:
        k = self._stiffness
        given = [*(c / k for c in force.legendre(contact, size, self._degree)), self.state.w]
        w, velocity, first, second, *rate = [sum(map(mul, row, given)) for row in self._responses(size)]
        mean_square = sum(c * c / (2 * j + 1) for j, c in enumerate(rate))
        return self._arrive(size, w, velocity, first, second, self._alpha * k * size * mean_square)

    def advance_alone(self, time: float, size: float) -> Motion:
        start = self.state.w
        alpha = self._alpha
        # α_b = 0: at once.
        left, gone = (math.exp(-size / alpha), -math.expm1(-size / alpha)) if alpha > 0.0 else (0.0, 1.0)
        w = start * left
        velocity = -start * left / alpha if alpha > 0.0 else 0.0
        first = alpha * start * gone
        lost = 0.5 * self._stiffness * (start * start - w * w)
        return self._arrive(size, w, velocity, first, alpha * (start * size - first), lost)

    def _response(self, size: float) -> list[list[float]]:
        """Return rows over (Legendre coefficients of C/k, w at the start), shape (d + 5, d + 2).

        They give w and ẇ at the end, ∫w, ∫∫w, and the d + 1 Legendre coefficients of ẇ.
        """
        d = self._degree
        derivative = 2.0 / size * legendre.legder(np.eye(d + 2))
        at_start = (-1.0) ** np.arange(d + 2)
        w = np.linalg.inv(np.vstack([np.eye(d + 1, d + 2) + self._alpha * derivative, at_start]))
        rate = derivative @ w
        once = size * w[0]
        twice = 0.5 * size * size * (w[0] - w[1] / 3.0)
        rows: list[list[float]] = [row.tolist() for row in (w.sum(axis=0), rate.sum(axis=0), once, twice, *rate)]
        return rows

    def _arrive(self, size: float, w: float, velocity: float, first: float, second: float, lost: float) -> Motion:
        """Take what a step of ``size`` [s] has come to: w, ẇ, ∫w, ∫∫w, and the energy it has dissipated."""
        integrals = self._rest * size + first, 0.5 * self._rest * size * size + second
        self.state = BendState(w, velocity, *integrals, self.state.dissipated + lost)
        return self.motion()

    def motion(self) -> Motion:
        w, *others = self.state[:4]
        return Motion(self._rest + w, *others)

    def energies(self) -> Energies:
        """Return the strain energy of w and the loads together, and the loads' potential, −(their work)."""
        k = self._stiffness
        w = self.state.w
        rest = self._rest
        strain = 0.5 * k * w * w + k * w * rest + 0.5 * self._load_energy
        return Energies(0.0, strain, self.state.dissipated, -k * w * rest - self._load_energy)

    def shape(self) -> np.ndarray:
        """See `Body.shape`; without inertia moment and shear force are those of statics."""
        deflection = self._load_shape + self._stiffness * self.state.w * self._tip_shape
        C = self._stiffness * (self.state.w + self._alpha * self.state.velocity)
        moment = self._load_moment + C * self._arm
        shear = self._load_shear + C
        return np.concatenate([deflection, moment, shear])

    def stiffness(self, displacement: Any) -> float:
        return self._stiffness

    def apply_impulse(self, impulse: float) -> None:
        raise AssertionError("a massless tip takes no impulse")

    def holding_force(self, displacement: float, velocity: float) -> float:
        return self._stiffness * (displacement - self._rest + self._alpha * velocity)

    def join(self, velocity: float) -> None:
        self.state = self.state._replace(velocity=velocity)

    def release(self) -> float:
        w = self.state.w
        if self._alpha > 0.0:
            self.join(-w / self._alpha)
            return 0.0
        # Without damping the tip is at rest at once.
        self.state = self.state._replace(w=0.0, velocity=0.0)
        return 0.5 * self._stiffness * w * w
