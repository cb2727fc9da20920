"""Spring and beam as one constraint-eliminated ODE per phase.

Coordinates x = (a, √m y) have the mass 1 and a diagonal stiffness: a are the beam's modes, as far as there is a beam,
and y the spring's top, if there is one. State of every phase, a vector of length 2n + 3::

    X = (x, ẋ, D, W, t),      D the energy dissipated so far [J], W the work of the loads that vary [J]

Dynamics, with u = tip·x, y = top·x and p = f(t) − ω² x − c ẋ − k2 (y − y₀)³ top (Ahn & Tate, eqs. (1)–(6), (8))::

    ẍ = p + C between + N top,      between = tip − top
    free    C = 0, or the force of the law (`laws`)
    joined  u = y: C = −between·p / between·between
    seated  y = φ, N = C − m top·p; joined: C = −tip·p / tip·tip
    without a spring top = 0 and y = φ on an elastic stop, else tip and top are one: between = top = tip, C = N
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from ..scene import Beam, Scene, Spring, Stop
from .laws import EndsMotion, ReferencePhase, Unit, law_of
from .semi_discrete import ModalBeam, ModalLoads, modal_beam, points

#: What rounding leaves of a sum that is exactly zero, as a share of its terms.
NOISE = 16.0 * float(np.finfo(float).eps)


class ReferenceFailure(RuntimeError):
    """The reference failed; the message has the cause and the time."""


class Held(NamedTuple):
    """The constraints of a phase: rows g, at right angles, with g·x = level, g·ẋ = 0, and how each moves x."""

    rows: np.ndarray  #: (k, n)
    along: np.ndarray  #: (k, n): what x changes by where g·x changes by 1; −along·p is the force along g
    levels: np.ndarray  #: (k,)

    def hold(self, x: np.ndarray, levels: np.ndarray | float) -> None:
        """Bring x, of shape (..., n), in place to where g·x are ``levels``."""
        x += (levels - x @ self.rows.T) @ self.along


class HybridSystem:
    """Equations of motion, energies and forces of a scene, phase by phase; of its own beam's modes, or of ``beam``.

    Attributes
    ----------
    r, n : int
        How many modes and coordinates there are.
    omega2, c, load : (n,) arrays
        ω² [1/s²], damping [1/s] and constant loads.
    patterns : (loads, n) array
        Forces of a unit of each load that varies.
    tip, top, between : (n,) arrays
        u = tip·x, y = top·x; ``between`` is what C acts on.
    """

    def __init__(self, scene: Scene, beam: ModalBeam | None = None) -> None:
        self.scene = scene
        self.law = law_of(scene)
        self.beam = beam = modal_beam(scene.beam) if beam is None and scene.beam is not None else beam
        self.has_spring = scene.spring is not None
        self.alone = not (self.has_spring or scene.elastic_stop)
        #: Without a spring its terms vanish, and without a stop nothing is ever seated on this one.
        self.spring = p = scene.spring or Spring(mass=1.0, linear_stiffness=0.0)
        self.stop = scene.stop or Stop(position=0.0)
        self.mass = p.mass * self.has_spring
        self.root_mass = float(np.sqrt(p.mass))
        one = np.ones(int(self.has_spring))
        omega2, load, b = (np.zeros(0),) * 3 if beam is None else (beam.omega**2, beam.load, beam.tip)
        self.alpha_b = 0.0 if beam is None else beam.alpha
        self.loads = ModalLoads(scene, beam)
        self.r = len(b)
        self.n = len(b) + len(one)
        self.omega2 = np.append(omega2, one * p.linear_stiffness / p.mass)
        self.c = np.append(self.alpha_b * omega2, one * p.damping / p.mass)
        self.load = np.append(load, one * (p.external_force + p.linear_stiffness * p.unloaded) / self.root_mass)
        self.patterns = np.column_stack([self.loads.patterns, np.outer(self.loads.on_spring, one) / self.root_mass])
        self.tip = np.append(b, 0.0 * one)
        self.top = self.tip if self.alone else np.append(0.0 * b, one / self.root_mass)
        self.between = self.tip if self.alone else self.tip - self.top
        #: What an impulse of 1 N·s adds to the velocity of the tip, and to that between the ends [1/kg].
        self.tip_mobility = float(self.tip @ self.tip)
        self.mobility = float(self.between @ self.between)
        #: y where nothing moves it.
        self.floor = self.stop.position * self.scene.elastic_stop
        #: What counts of ẋ²/2 as kinetic energy.
        self.inertia = np.ones(self.n)
        #: `held` of a phase, made once.
        self.constraints = cache(self.held)
        #: Strain energy [J] under the constant loads that does not depend on x.
        self._hidden = 0.0
        self.size = 2 * self.n + 3
        self.A = slice(0, self.n)
        self.V = slice(self.n, 2 * self.n)
        self.D = 2 * self.n
        self.W = 2 * self.n + 1
        self.T = 2 * self.n + 2

    # Phases ---------------------------------------------------------------------------------------------------------

    def joined(self, phase: ReferencePhase) -> bool:
        """Whether u = y holds as a constraint."""
        return self.alone or (self.law.rigid and phase.contact != "free")

    def pressed(self, phase: ReferencePhase) -> bool:
        """Whether the law's energies count."""
        return not self.law.rigid and phase.contact != "free"

    def held(self, phase: ReferencePhase, level: float | None = None) -> Held:
        """Return what joins or holds the ends; the top, and the tip that is joined to it, at ``level`` [m] if given."""
        joined = self.joined(phase)
        if phase.seated or level is not None:
            constrained = [self.tip] * joined + [self.top] * self.has_spring
        else:
            constrained = [self.between] * (joined and not self.alone)
        rows = np.reshape(constrained, (len(constrained), self.n))
        levels = np.full(len(rows), self.stop.position * phase.seated if level is None else level)
        return Held(rows, rows / np.sum(rows**2, axis=1, keepdims=True), levels)

    def space(self, phase: ReferencePhase) -> np.ndarray:
        """Return the directions in which x can move, orthonormal, (n, p)."""
        rows = self.held(phase).rows
        return np.linalg.svd(rows)[2][len(rows) :].T

    def oscillating(self, phase: ReferencePhase) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return ω² and c [1/s², 1/s] and the constant loads of the coordinates in a phase."""
        return self.omega2, self.c, self.load

    # Motion ---------------------------------------------------------------------------------------------------------

    def ends(self, phase: ReferencePhase, X: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return u, v, y and z of states of shape (..., 2n + 3)."""
        x = X[..., self.A]
        x_dot = X[..., self.V]
        y = x @ self.top + self.floor
        z = x_dot @ self.top
        return (y, z, y, z) if self.joined(phase) else (x @ self.tip, x_dot @ self.tip, y, z)

    def motion(self, phase: ReferencePhase, X: np.ndarray) -> EndsMotion:
        """Return accelerations and interface quantities of states of shape (..., 2n + 3)."""
        u, v, y, z = self.ends(phase, X)
        own = self.load - self.omega2 * X[..., self.A] - self.c * X[..., self.V]
        if len(self.loads):
            own = own + self.loads.values(X[..., self.T]) @ self.patterns
        if self.spring.cubic_stiffness:
            own = own - (self.spring.cubic_stiffness * (y - self.spring.unloaded) ** 3)[..., None] * self.top
        held = self.constraints(phase)
        C = np.zeros_like(u)
        N = np.zeros_like(u)
        if self.joined(phase) and len(held.rows):
            C = -own @ held.along[0]
        elif self.law.acts(phase.contact) and not self.alone:
            C = self.law.force(y - u, z - v)
        a = own + C[..., None] * self.between
        if phase.seated:
            N = C - self.mass * (own @ self.top)
            a[..., self.r :] = 0.0
        return EndsMotion(u, v, y, z, C, N, a, a @ self.top)

    def load_power(self, X: np.ndarray) -> np.ndarray:
        """Return the power of the loads that vary [W] on states of shape (..., 2n + 3)."""
        if not len(self.loads):
            return np.zeros(X.shape[:-1])
        return np.sum(self.loads.values(X[..., self.T]) * (X[..., self.V] @ self.patterns.T), axis=-1)

    def dissipation_rate(self, phase: ReferencePhase, X: np.ndarray) -> np.ndarray:
        """Return ẋᵀ c ẋ, and what the law takes [W]."""
        rate = np.asarray(X[..., self.V] ** 2 @ self.c)
        if self.law.damping and self.pressed(phase):
            u, v, y, z = self.ends(phase, X)
            rate = rate + self.law.dissipation(phase.contact, y - u, z - v)
        return rate

    def synchronise(self, phase: ReferencePhase, X: np.ndarray) -> np.ndarray:
        """Remove from X, in place, what rounding or an impact leaves of a constraint; return X."""
        held = self.held(phase)
        held.hold(X[..., self.A], held.levels)
        held.hold(X[..., self.V], 0.0)
        return X

    # What rows show -------------------------------------------------------------------------------------------------

    def shapes(self, states: np.ndarray) -> np.ndarray | None:
        """Return deflections, bending moments and shear forces at `SHAPE_POINTS`, shape (k, 63), of k states.

        They are in m, N·m and N; ``None`` without modes of a beam.
        """
        if self.beam is None or self.scene.massless:  # whose coordinate is that of the tip alone
            return None
        a = states[:, : self.r]
        v = states[:, self.n : self.n + self.r]
        return np.hstack([a @ self.beam.sampler.T, (a + self.alpha_b * v) @ self.beam.inner.T])

    def energies(self, X: np.ndarray, phase: ReferencePhase) -> dict[str, np.ndarray]:
        """Return energies [J] of states of shape (k, 2n + 3); ``e_load`` is minus the work of the loads."""
        x = X[..., self.A]
        x_dot = X[..., self.V]
        u, _, y, _ = self.ends(phase, X)
        p = self.spring
        kinetic = 0.5 * self.inertia * x_dot**2
        bent = 0.5 * self.omega2[: self.r] * x[..., : self.r] ** 2
        square = (y - p.unloaded) ** 2
        spring = (0.5 * p.linear_stiffness + 0.25 * p.cubic_stiffness * square) * square
        return {
            "e_beam": np.sum(kinetic[..., : self.r] + bent, axis=-1) + self._hidden,
            "e_spring": np.sum(kinetic[..., self.r :], axis=-1) + spring,
            "e_contact": self.law.potential(y - u) if self.pressed(phase) else np.zeros_like(y),
            "e_dissipated": X[..., self.D],
            "e_load": p.linear_stiffness * p.unloaded * y - x @ self.load - X[..., self.W] - 2.0 * self._hidden,
        }

    def noise(self, unit: Unit, X: np.ndarray) -> float:
        """Return what rounding leaves of a displacement, velocity or contact force that is exactly zero.

        A place also has the rounding of the time of an event.
        """
        x = np.abs(X[self.A])
        x_dot = np.abs(X[self.V])
        tip = np.abs(self.tip)
        top = np.abs(self.top)
        speed = float((tip + top) @ x_dot)
        if unit == "m":
            return NOISE * (float((tip + top) @ x) + abs(self.stop.position) + abs(float(X[self.T])) * speed)
        if unit == "m/s":
            return NOISE * speed
        own = np.abs(self.omega2) * x + self.c * x_dot + np.abs(self.load)
        return NOISE * float((tip @ own) / self.mobility + self.mass * (top @ own))


class QuasiStaticSystem(HybridSystem):
    """Equations of a beam without inertia and a spring, under a rigid law; x = (u, √m y).

    Equilibrium, K (q + α_b q̇) = e C + F, leaves of the beam the deflection u of its tip, which has a stiffness k and
    no mass. With u_F its deflection under the loads::

        k (u + α_b u̇ − u_F) = C
        free    C = 0: α_b ü + u̇ = 0 from u̇ = (u_F − u)/α_b on; undamped, u = u_F
        joined  u = y: k, α_b k and k u_F act on the spring as well, and C follows

    An undamped tip that is released jumps to u_F, and ½ k (u − u_F)² is lost. Meeting the spring loses nothing.
    """

    def __init__(self, scene: Scene) -> None:
        assert scene.beam is not None
        k, rest, stored = _statics(scene.beam)
        one = np.ones(1)
        shape = one[None]
        length = scene.beam.length * one
        super().__init__(
            scene, ModalBeam(np.sqrt(k) * one, one, k * rest * one, length, shape, shape, shape, scene.beam.alpha_b)
        )
        self.tip_mobility = self.mobility = np.inf
        self._rest = rest
        self.inertia = np.array([0.0, 1.0])
        self._hidden = stored - 0.5 * k * rest**2

    def held(self, phase: ReferencePhase, level: float | None = None) -> Held:
        """Return what holds the ends: a tip that has no mass is moved without a force, or rests by itself."""
        rows, along, levels = super().held(phase, level)
        if self.joined(phase):
            along[0] = self.tip
        elif not self.alpha_b:
            rows, along = (np.vstack([self.tip, part]) for part in (rows, along))
            levels = np.append(self._rest, levels)
        return Held(rows, along, levels)

    def space(self, phase: ReferencePhase) -> np.ndarray:
        """Return the directions in which u and y can move, with a unit of √m y where they are joined."""
        return super().space(phase) * (np.sqrt(1.0 + 1.0 / self.mass) if self.joined(phase) else 1.0)

    def oscillating(self, phase: ReferencePhase) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        if self.joined(phase) or not self.alpha_b:
            return super().oscillating(phase)
        omega2, c, load = (own[1:] for own in super().oscillating(phase))
        return np.append(0.0, omega2), np.append(1.0 / self.alpha_b, c), np.append(0.0, load)

    def synchronise(self, phase: ReferencePhase, X: np.ndarray) -> np.ndarray:
        """Hold X, in place, where the phase has it, or let its tip relax by itself; return X."""
        super().synchronise(phase, X)
        if self.alpha_b and not self.joined(phase):
            X[..., self.n] = (self._rest - X[..., 0]) / self.alpha_b
        return X

    def noise(self, unit: Unit, X: np.ndarray) -> float:
        """Return the noise of any pair; what the rounding of an event's time makes of a place changes the force."""
        of_pair = super().noise(unit, X)
        if unit != "N":
            return of_pair
        moved = NOISE * abs(float(X[self.T])) * float(np.abs(X[self.V]) @ (self.tip + self.top))
        force = NOISE * float(self.omega2[0] * abs(X[0]) + self.c[0] * abs(X[self.n]) + abs(self.load[0]))
        return of_pair + float(self.omega2[0]) * moved + force


def _statics(beam: Beam) -> tuple[float, float, float]:
    """Return (k, u_F, ½ work of the loads) by the moments and shear forces of the loads and of a unit tip force."""
    x, dx = points(beam)
    EI = beam.young_modulus * beam.second_moment_of_area
    KAG = beam.shear_coefficient * beam.area * beam.shear_modulus
    h = beam.length / beam.n_elements
    arm = beam.length - x
    near = np.minimum(arm, h)  # of the tip: where the hat function of its load is not zero
    hat = near - near**2 / (2.0 * h)
    lever = near**2 / 2.0 - near**3 / (3.0 * h)
    shear = beam.distributed_load * arm + beam.tip_load_coefficient * hat
    moment = 0.5 * beam.distributed_load * arm**2 + beam.tip_load_coefficient * (arm * hat - lever)
    compliance = float(dx @ (arm**2 / EI + 1.0 / KAG))
    deflection = float(dx @ (arm * moment / EI + shear / KAG))
    return 1.0 / compliance, deflection, 0.5 * float(dx @ (moment**2 / EI + shear**2 / KAG))
