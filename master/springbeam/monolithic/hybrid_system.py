"""Spring and beam as one constraint-eliminated ODE per phase.

State of every phase, a vector of length 2r + 5 (r modal coordinates of the beam, r = 0 without one)::

    X = (a, ȧ, y, z, D, W, t),      D the energy dissipated so far [J], W the work of the loads that vary [J]

Dynamics, with u = bᵀa, p = f(t) − ω²(a + α_b ȧ) the beam's own forces and s = f_s(t) − α_s z − k1 y − k2 y³ the
spring's (Ahn & Tate, eqs. (1)–(6), (8))::

    free    ä = p + b C,  m z' = s − C,           C = 0, or the force of the law (`laws`)
    joined  ä = p + b C,  m z' = s − C,  u = y:   C = (s − m bᵀp) / (1 + m bᵀb)
    elastic stop: no spring, y = φ, z = 0, and C the force of the law
    seated  y = φ, z = 0, N = C − s;  joined: u = φ, C = −bᵀp / bᵀb
    without a spring the tip is joined to an end with m = 0 and s = 0
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from ..scene import Scene, Spring, Stop
from .laws import Motion, Phase, law_of
from .semi_discrete import Loads, ModalBeam, modal_beam

#: What rounding leaves of a sum that is exactly zero, as a share of its terms.
NOISE = 16.0 * float(np.finfo(float).eps)


class ReferenceFailure(RuntimeError):
    """The reference cannot go on; the message says why and at which time."""


class HybridSystem:
    """Equations of motion, energies and forces of a scene, phase by phase; of its own beam's modes, or of ``beam``."""

    def __init__(self, scene: Scene, beam: ModalBeam | None = None) -> None:
        self.scene, self.law = scene, law_of(scene)
        self.beam = modal_beam(scene.beam) if beam is None and scene.beam is not None else beam
        self.has_spring = scene.spring is not None
        #: Without a spring its terms vanish; a tip above no wall then is joined to an end that has no mass.
        self.spring = scene.spring or Spring(mass=1.0, linear_stiffness=0.0)
        self.mass = self.spring.mass if self.has_spring else 0.0
        self.inverse_mass = 1.0 / self.mass if self.has_spring else 0.0
        self.alone = not (self.has_spring or scene.elastic_stop)
        #: Without a stop nothing is ever seated on this one.
        self.stop = scene.stop or Stop(position=0.0)
        empty = np.zeros(0)
        self.b = empty if self.beam is None else self.beam.tip
        self.load = empty if self.beam is None else self.beam.load
        self.alpha_b = 0.0 if self.beam is None else self.beam.alpha
        self.stiffness = empty if self.beam is None else self.beam.omega**2
        #: eᵀM⁻¹e [1/kg]; infinite for a beam without inertia.
        self.inverse_tip_mass = float(self.b @ self.b)
        self.loads = Loads(scene, self.beam)
        self.r = len(self.stiffness)
        self.size = 2 * self.r + 5
        self.A, self.V = slice(0, self.r), slice(self.r, 2 * self.r)
        self.Y, self.Z = 2 * self.r, 2 * self.r + 1
        self.D, self.W, self.T = 2 * self.r + 2, 2 * self.r + 3, 2 * self.r + 4

    def joined(self, phase: Phase) -> bool:
        """Whether u = y holds as a constraint."""
        return self.alone or self.law.holds(phase.contact)

    def held(self, phase: Phase) -> bool:
        """Whether the tip stands on the foundation, u = φ."""
        return phase.seated and self.joined(phase)

    def _own_forces(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return p, (..., r), and s [N], (...), of states."""
        a, v, y, z = X[..., self.A], X[..., self.V], X[..., self.Y], X[..., self.Z]
        p, spring, s = self.load - self.stiffness * (a + self.alpha_b * v), self.spring, np.zeros_like(y)
        if self.has_spring:
            elastic = (spring.linear_stiffness + spring.cubic_stiffness * y**2) * y
            s = spring.external_force - spring.damping * z - elastic
        if len(self.loads):
            values = self.loads.values(X[..., self.T])
            p, s = p + values @ self.loads.patterns, s + values @ self.loads.on_spring
        return p, s

    def load_power(self, X: np.ndarray) -> np.ndarray:
        """Return the power of the loads that vary [W] on states of shape (..., 2r + 5)."""
        speeds = X[..., self.V] @ self.loads.patterns.T + X[..., self.Z, None] * self.loads.on_spring
        return np.asarray(np.sum(self.loads.values(X[..., self.T]) * speeds, axis=-1))

    def motion(self, phase: Phase, X: np.ndarray) -> Motion:
        """Return accelerations and interface quantities of states of shape (..., 2r + 5)."""
        a, v, y, z = X[..., self.A], X[..., self.V], X[..., self.Y], X[..., self.Z]
        u_tip, v_tip = a @ self.b, v @ self.b
        p, s = self._own_forces(X)
        if self.joined(phase):
            by_beam, by_spring = self.multiplier(phase)
            C = by_beam * (p @ self.b) + by_spring * s
        else:
            C = self.law.force(y - u_tip, z - v_tip) if self.law.acts(phase.contact) else np.zeros_like(y)
        N = C - s if phase.seated else np.zeros_like(y)
        z_dot = np.zeros_like(y) if phase.seated else (s - C) * self.inverse_mass
        return Motion(u_tip, v_tip, y, z, C, N, p + self.b * C[..., None], z_dot)

    def multiplier(self, phase: Phase) -> tuple[float, float]:
        """Return what bᵀp and s are multiplied by in the C of ends that are joined."""
        if phase.seated:
            return -1.0 / self.inverse_tip_mass, 0.0
        share = 1.0 / (1.0 + self.mass * self.inverse_tip_mass)
        return -self.mass * share, share

    def dissipation_rate(self, phase: Phase, X: np.ndarray) -> np.ndarray:
        """Return α_b ȧᵀω²ȧ + α_s z², and what the law takes [W]."""
        v, z = X[..., self.V], X[..., self.Z]
        rate = np.asarray(self.alpha_b * (v**2 @ self.stiffness) + self.spring.damping * z**2)
        if not (self.law.dissipative and self.law.counts(phase.contact)):
            return rate
        penetration, closing = X[..., self.Y] - X[..., self.A] @ self.b, z - v @ self.b
        return np.asarray(rate + self.law.dissipation(phase.contact, penetration, closing))

    def synchronise(self, phase: Phase, X: np.ndarray) -> np.ndarray:
        """Remove from X, in place, what rounding leaves of the constraint, y = u or, seated, u = φ; return X."""
        if self.held(phase):
            towards = self.b / self.inverse_tip_mass
            X[..., self.A] += (self.stop.position - X[..., self.A] @ self.b)[..., None] * towards
            X[..., self.V] -= (X[..., self.V] @ self.b)[..., None] * towards
        elif self.joined(phase):
            X[..., self.Y] = X[..., self.A] @ self.b
            X[..., self.Z] = X[..., self.V] @ self.b
        return X

    def settle(self, phase: Phase, X: np.ndarray) -> float:
        """Bring what has no inertia to its place in a phase that begins; return the energy [J] that this takes."""
        return 0.0

    def shapes(self, states: np.ndarray) -> np.ndarray | None:
        """Return deflections, bending moments and shear forces at `SHAPE_POINTS`, shape (k, 63), of k states.

        They are in m, N·m and N; ``None`` without a beam.
        """
        if self.beam is None:
            return None
        a, v = states[:, self.A], states[:, self.V]
        return np.hstack([a @ self.beam.sampler.T, (a + self.alpha_b * v) @ self.beam.inner.T])

    def energies(self, X: np.ndarray, phase: Phase) -> dict[str, np.ndarray]:
        """Return energies [J] of states of shape (k, 2r + 5); ``e_load`` is minus the work of the loads."""
        a, v, y, z = X[..., self.A], X[..., self.V], X[..., self.Y], X[..., self.Z]
        p = self.spring
        spring = 0.5 * self.mass * z**2 + 0.5 * p.linear_stiffness * y**2 + 0.25 * p.cubic_stiffness * y**4
        contact = self.law.potential(y - a @ self.b) if self.law.counts(phase.contact) else np.zeros_like(y)
        return {
            "e_beam": 0.5 * np.sum(v**2 + self.stiffness * a**2, axis=-1),
            "e_spring": spring,
            "e_contact": contact,
            "e_dissipated": X[..., self.D],
            "e_load": -(a @ self.load) - p.external_force * y - X[..., self.W],
        }

    def noise(self, unit: Literal["m", "m/s", "N"], X: np.ndarray) -> float:
        """Return what rounding leaves of a displacement, velocity or contact force that is exactly zero."""
        a, v, b = np.abs(X[self.A]), np.abs(X[self.V]), np.abs(self.b)
        if unit == "m":
            return NOISE * (float(a @ b) + abs(float(X[self.Y])) + abs(self.stop.position))
        if unit == "m/s":
            return NOISE * (float(v @ b) + abs(float(X[self.Z])))
        beam = float(b @ (self.stiffness * (a + self.alpha_b * v) + np.abs(self.load)))
        p = self.spring
        spring = abs(p.external_force) + p.damping * abs(float(X[self.Z])) + abs(p.linear_stiffness * float(X[self.Y]))
        weight = self.inverse_tip_mass + self.inverse_mass
        return NOISE * ((beam if weight == np.inf else beam / weight) + spring)
