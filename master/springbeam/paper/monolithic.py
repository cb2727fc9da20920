"""Algorithm 1 with (52)–(56) and (62)–(65) as a monolithic code: the beam's mesh by one factorisation of (62)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from ..monolithic.semi_discrete import assemble, constant_forces, inner_forces
from ..results.trajectory import Trajectory
from ..scene import Scene
from . import problem
from .algorithm import (
    MOST_ITERATIONS,
    TOLERANCE,
    Algorithm,
    AlgorithmFailure,
    AtContact,
    Bodies,
    Law,
    SpringStep,
    YTemp,
)


def algorithm_1(
    scene: Scene,
    *,
    at_contact: AtContact = "rest",
    y_temp: YTemp = "equation",
    progress: Callable[[float], object] = float,
) -> Trajectory:
    """Run Algorithm 1 with h_t = ``coupling.macro_step`` on a scene with beam and spring, and a shorter last step to
    ``time.t_end`` where that is off the grid.

    Parameters
    ----------
    at_contact, y_temp
        See `springbeam.paper.algorithm`.
    progress
        Called with the time [s] at the end of each step.

    Returns
    -------
    Trajectory
        A row per step from t_c on (from 0 with ``approach = "elastic"``). ``contact_force``, ``compliance_force`` and
        ``tie_reaction`` are means over the step that ends in the row. ``e_total`` is (63) + ``e_dissipated``, and
        ``energy_residual`` what the algorithm has injected. Extra columns: ``e_injected_beam``,
        ``e_injected_spring`` [J], and ``case`` (11, 14, or 0 where neither line holds).
        ``summary["iterations_per_solve"]`` are Newton iterations per solve of (53) (Table 2), counted up to and
        including the first step |Δ| ≤ 1e-12 m; ``summary["newton"]`` has those of line 10, ``predicted``, and of line
        17, ``joined``, and the number of ``solves``.

    Raises
    ------
    SceneError
        If the scene is not one that Algorithm 1 is written for.
    AlgorithmFailure
        With the time and the trajectory so far, where an iteration fails or the solution overflows.
    """
    problem.refuse(scene)
    return Algorithm(scene, Meshed(scene), at_contact, y_temp).run(progress)


class Meshed(Bodies):
    """The mesh of the beam, and the spring's midpoint rule."""

    name = "monolithic"

    def __init__(self, scene: Scene) -> None:
        assert scene.beam is not None
        assert scene.spring is not None
        beam = scene.beam
        self._beam = beam
        self._spring = scene.spring
        self.discrete = d = assemble(beam)
        self.load = d.nodal(*constant_forces(beam))
        slope = beam.initial_deflection_slope + (scene.contact_time or 0.0) * beam.initial_velocity_slope
        #: Unknowns of the mesh [rad, m], their last the tip's deflection, and their rates; both at the start of a step.
        self._now = self._before = (slope * d.slope_shape, beam.initial_velocity_slope * d.slope_shape)
        self._dissipated = np.zeros(2)  #: up to the start of a step, and its end [J]

    def set_step(self, h: float) -> None:
        """Factorise (62) for steps of ``h`` [s]."""
        d = self.discrete
        alpha = self._beam.alpha_b
        self.h = h
        self._old = 4.0 * d.M + (2.0 * alpha * h - h**2) * d.K
        self._solve = spla.splu(sp.csc_matrix(4.0 * d.M + (h**2 + 2.0 * alpha * h) * d.K)).solve
        #: How (62) answers to a unit force at the tip.
        self._answer: np.ndarray = 2.0 * h**2 * self._solve(d.tip_vector)
        self.response = float(self._answer[-1])

    @property
    def tip(self) -> tuple[float, float]:
        q, v = self._now
        return float(q[-1]), float(v[-1])

    def known(self) -> np.ndarray:
        """Return the right-hand side of (62) without a force on the tip."""
        q, v = self._before
        return self._old @ q + 4.0 * self.h * (self.discrete.M @ v) + 2.0 * self.h**2 * self.load

    def advance_free(self, time: float) -> float:
        self._before = self._now
        self._dissipated[0] = self._dissipated[1]
        self._free = self._solve(self.known())
        self._move(self._free)
        return float(self._free[-1])

    def push(self, force: float) -> None:
        self._move(self._free + force * self._answer)

    def _move(self, q: np.ndarray) -> None:
        """End the step at ``q``, with the rates of line 29."""
        change = q - self._before[0]
        self._now = q, 2.0 * change / self.h - self._before[1]
        self._dissipated[1] = (
            self._dissipated[0] + self._beam.alpha_b * float(change @ (self.discrete.K @ change)) / self.h
        )

    def spring_step(self, time: float, y: float, z: float, law: Law, guess: float) -> SpringStep:
        end = guess
        for k in range(1, MOST_ITERATIONS + 1):
            force, slope = self._foundation_force(y, z, end, law)
            change = force / slope
            end -= change
            if abs(change) <= TOLERANCE:
                return self._ended(y, z, end, law)._replace(iterations=k)
        raise AlgorithmFailure("Newton's method for the position of the spring (lines 10, 17) does not converge")

    def step_to_foundation(self, time: float, y: float, z: float, law: Law, phi: float) -> SpringStep:
        force, _ = self._foundation_force(y, z, phi, law)
        return self._ended(y, z, phi, law)._replace(foundation=force)

    def _ended(self, y: float, z: float, end: float, law: Law) -> SpringStep:
        change = end - y
        pressing = 0.5 * (law.force(end)[0] + law.force(y)[0])
        return SpringStep(end, 2.0 * change / self.h - z, self._spring.damping * change**2 / self.h, pressing)

    def _foundation_force(self, y: float, z: float, Y: float, law: Law) -> tuple[float, float]:
        """Return N of (53) with (54) for a step from (y, z) that ends at ``Y``, and its derivative by ``Y``."""
        p = self._spring
        h = self.h
        x = y - p.unloaded
        X = Y - p.unloaded
        force, slope = law.force(Y)
        value = (
            2.0 * p.mass * ((Y - y) / h - z) / h
            + p.damping * (Y - y) / h
            + 0.5 * p.linear_stiffness * (X + x)
            + 0.25 * p.cubic_stiffness * (X**2 + x**2) * (X + x)
            + 0.5 * (force + law.force(y)[0])
            - p.external_force
        )
        cubic = 0.25 * p.cubic_stiffness * (3.0 * X**2 + 2.0 * X * x + x**2)
        tangent = 2.0 * p.mass / h**2 + p.damping / h + 0.5 * p.linear_stiffness + cubic + 0.5 * slope
        return value, tangent

    def energies(self) -> tuple[float, float, float]:
        q, v = self._now
        d = self.discrete
        strain = d.B @ q
        energy = 0.5 * float(v @ (d.M @ v) + strain @ strain)
        return energy, float(self._dissipated[1]), -float(q @ self.load)

    def shape(self) -> tuple[np.ndarray, np.ndarray]:
        return self._now

    def shapes(self, states: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
        q, v = (np.array(rows) for rows in zip(*states, strict=True))
        inner = inner_forces(self._beam, self.discrete, (q + self._beam.alpha_b * v).T)
        return np.hstack([q @ self.discrete.interpolated().T, inner.T])
