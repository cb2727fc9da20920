"""Algorithm 1 through the beam and the spring FMU, in place of (62) and (53).

The beam FMU steps by the midpoint rule, which is (62); the spring's midpoint rule (53) is replaced by IDA over the
step, and a new instance of the spring FMU begins each of its steps, since the algorithm overwrites y and z. The tip is
moved to y (lines 18, 21) by the constant tip force that does so.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager

import numpy as np

from ..bodies.own import FmuBeam, FmuSpring
from ..bodies.protocol import NO_FORCE, BodyFailed, StepRefused
from ..results.trajectory import Trajectory
from ..scene import Scene
from . import problem
from .algorithm import MOST_ITERATIONS, TOLERANCE, Algorithm, AlgorithmFailure, AtContact, Bodies, Law, SpringStep


def algorithm_1(
    scene: Scene, *, at_contact: AtContact = "rest", progress: Callable[[float], object] = float
) -> Trajectory:
    """Run Algorithm 1 through the FMUs; arguments, result and errors are those of the monolithic program.

    In `springbeam.paper.monolithic.algorithm_1`, that is; iterations are steps of the spring. Also raises FmuError if
    an FMU cannot be found or loaded.
    """
    problem.refuse(scene)
    with closing(_Fmus(scene)) as bodies:
        return Algorithm(scene, bodies, at_contact).run(progress)


class _Fmus(Bodies):
    name = "through the FMUs"
    FAILURES = (*Bodies.FAILURES, StepRefused, BodyFailed)

    def __init__(self, scene: Scene) -> None:
        assert scene.beam is not None
        assert scene.spring is not None
        self._spring = scene.spring
        start = scene.contact_time or 0.0
        slope = scene.beam.initial_deflection_slope + start * scene.beam.initial_velocity_slope
        midpoint = {"integrator": "midpoint", "n_modes": 0}  # (62)
        self._beam = FmuBeam(scene.beam.model_copy(update=midpoint), start, slope)
        self._time = start

    def close(self) -> None:
        self._beam.close()

    def set_step(self, h: float) -> None:
        """Find the response to a force that moves the tip as far as it moves by itself; to 1 N it may be rounding."""
        self._h = h
        beam = self._beam
        beam.mark()
        alone = beam.advance(self._time, h, NO_FORCE)
        length = max(abs(alone.displacement), h * abs(alone.velocity))
        force = 2.0 * beam.mass * length / h**2 or 1.0
        beam.rewind()
        pushed = beam.advance(self._time, h, (force, 0.0, 0.0))
        beam.rewind()
        self.response = (pushed.displacement - alone.displacement) / force

    @property
    def tip(self) -> tuple[float, float]:
        motion = self._beam.motion()
        return motion.displacement, motion.velocity

    def advance_free(self, time: float) -> float:
        self._beam.mark()
        self._begin = time
        self._time = time + self._h
        return self._beam.advance(time, self._h, NO_FORCE).displacement

    def push(self, force: float) -> None:
        self._beam.rewind()
        self._beam.advance(self._begin, self._h, (force, 0.0, 0.0))

    @contextmanager
    def _new_spring(self, time: float, y: float, z: float) -> Iterator[FmuSpring]:
        with closing(FmuSpring(self._spring.model_copy(update={"initial_velocity": z}), time, y)) as spring:
            spring.mark()
            yield spring

    def spring_step(self, time: float, y: float, z: float, law: Law, guess: float) -> SpringStep:
        before, _ = law.force(y)
        end = guess
        with self._new_spring(time, y, z) as spring:
            response = 0.5 * self._h**2 / spring.mass
            for k in range(1, MOST_ITERATIONS + 1):
                force, slope = law.force(end)
                pressing = 0.5 * (force + before)
                spring.rewind()
                motion = spring.advance(time, self._h, (pressing, 0.0, 0.0))
                change = (end - motion.displacement) / (1.0 - 0.5 * response * slope)
                if abs(change) <= TOLERANCE:
                    return SpringStep(*motion[:2], spring.energies().dissipated, pressing, 0.0, k)
                end -= change
        raise AlgorithmFailure("Newton's method for the position of the spring (lines 10, 17) does not converge")

    def step_to_foundation(self, time: float, y: float, z: float, law: Law, phi: float) -> SpringStep:
        pressing = 0.5 * (law.force(phi)[0] + law.force(y)[0])
        n = 0.0
        with self._new_spring(time, y, z) as spring:
            response = 0.5 * self._h**2 / spring.mass
            for _ in range(MOST_ITERATIONS):
                spring.rewind()
                motion = spring.advance(time, self._h, (pressing, 0.0, 0.0), (n, 0.0, 0.0))
                miss = phi - motion.displacement
                if abs(miss) <= TOLERANCE:
                    return SpringStep(phi, motion.velocity, spring.energies().dissipated, pressing, n)
                n += miss / response
        raise AlgorithmFailure("no foundation force (line 24) found")

    def energies(self) -> tuple[float, float, float]:
        energies = self._beam.energies()
        return energies.kinetic + energies.potential, energies.dissipated, energies.load_potential

    def shape(self) -> np.ndarray:
        return self._beam.shape()

    def shapes(self, states: list[np.ndarray]) -> np.ndarray:
        return np.array(states)
