"""Algorithm 1 through the beam and the spring FMU: lines (7)–(31) with the two bodies in place of (62) and (53).

The beam FMU steps by the midpoint rule, which is (62); the spring's midpoint rule (53) is replaced by IDA over the
step, and wherever the algorithm overwrites y or z a new instance of the spring FMU begins there. The tip is moved to y
(lines 18, 21) by the constant tip force that does so; nothing opposes that force, so its work is energy from nowhere,
and ``energy_residual`` shows it. Readings where the print leaves something open: ``README.md``.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from math import inf, isfinite
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from ..bodies.own import FmuBeam, FmuSpring
from ..bodies.protocol import NO_FORCE, BodyFailed, StepRefused
from ..motion.events import Event, EventKind, Joint
from ..results.trajectory import Trajectory
from ..scene import Scene
from ..scene.laws import TransmissionContact
from . import problem
from .problem import AlgorithmFailure, AtContact

_MAX_ITERATIONS = 50
#: Newton's tolerance of the spring's and the tip's position (section 6: ε = 1e-12) [m].
_TOLERANCE = 1e-12


class SpringStep(NamedTuple):
    """Where a step of the spring ends, and under which mean forces."""

    y: float  #: [m]
    z: float  #: [m/s]
    dissipated: float  #: [J]
    pressing: float = 0.0  #: mean of the law's force ½ (λ(Ψ − yˡ⁺¹)₊^p + λ(Ψ − yˡ)₊^p) [N]
    foundation: float = 0.0  #: N [N]


class Row(NamedTuple):
    """Beam and spring after a step; forces are means over it [N]."""

    time: float
    u_tip: float
    v_tip: float
    y: float
    z: float
    phase: str
    contact_force: float  #: on the tip, of whatever kind
    compliance_force: float  #: of the law on the tip
    foundation_force: float
    e_beam: float
    e_spring: float
    e_dissipated: float
    e_load: float
    case: float
    e_injected_beam: float
    e_injected_spring: float


def algorithm_1(
    scene: Scene, *, at_contact: AtContact = "rest", progress: Callable[[float], object] = float
) -> Trajectory:
    """Run Algorithm 1 through the FMUs with h_t = ``coupling.macro_step`` on a scene with beam and spring.

    Parameters
    ----------
    at_contact
        See `springbeam.paper.problem.AtContact`.
    progress
        Called with the time [s] at the end of each step.

    Returns
    -------
    Trajectory
        A row per step from t_c on (from 0 with ``approach = "elastic"``), as of
        `springbeam.paper.monolithic.algorithm_1`. ``summary["iterations_per_solve"]`` (Table 2) are steps of the
        spring.

    Raises
    ------
    SceneError
        If the scene is not one that Algorithm 1 is written for.
    FmuError
        If an FMU cannot be found or loaded.
    AlgorithmFailure
        With the trajectory so far, where an iteration fails, a body refuses a step, or the solution overflows.
    """
    problem.refuse(scene)
    with closing(_Algorithm(scene, at_contact)) as algorithm:
        try:
            algorithm.run(progress)
        except (StepRefused, BodyFailed, OverflowError) as failed:
            failure = AlgorithmFailure(f"{failed} at t = {algorithm.time:.6g} s")
            failure.trajectory = algorithm.trajectory() if algorithm.begun else None
            raise failure from failed
        return algorithm.trajectory()


class _Algorithm:
    def __init__(self, scene: Scene, at_contact: AtContact) -> None:
        assert scene.beam is not None
        assert scene.spring is not None
        assert isinstance(scene.contact, TransmissionContact)
        self._scene = scene
        self._spring = scene.spring
        self._contact = scene.contact
        self._at_contact = at_contact
        self._phi = -inf if scene.stop is None else scene.stop.position
        self.time = scene.contact_time or 0.0  #: where the present step begins [s]
        slope = scene.beam.initial_deflection_slope + self.time * scene.beam.initial_velocity_slope
        midpoint = {"integrator": "midpoint", "n_modes": 0}  # (62)
        self._beam = FmuBeam(scene.beam.model_copy(update=midpoint), self.time, slope)
        self._y = self._spring.equilibrium  #: [m]
        self._z = self._spring.initial_velocity  #: [m/s]
        self._stiffness = 0.0  #: λ_nc as lines 12 and 15 have left it
        self._touched = False
        self._h = 0.0  #: size of the present step [s]
        self._response = 0.0  #: u_tip per unit tip force over a step of that size [m/N]; the beam is linear
        self._dissipated = 0.0  #: by the spring so far [J]
        self._injected_into_beam = 0.0  #: [J]
        self._injected_into_spring = 0.0  #: [J]
        self._solves = 0
        self._iterations = 0
        self._events: list[Event] = []
        self._rows: list[Row] = []
        self._shapes: list[np.ndarray] = []
        self._began = perf_counter()

    @property
    def begun(self) -> bool:
        """Whether the row of the start is made."""
        return bool(self._rows)

    def close(self) -> None:
        self._beam.close()

    def run(self, progress: Callable[[float], object]) -> None:
        """Make all steps; `trajectory` has them, also where one fails."""
        beam = self._scene.beam
        assert beam is not None
        if beam.approach == "undeformed" or self._beam.motion().displacement <= self._spring.equilibrium:
            self._first_contact()
        self._record(self.time, "tied" if self._touched else "free")
        for end, size in problem.steps(self._scene):
            if size != self._h:
                self._h = size
                self._measure_response()
            if self._touched:
                self._contact_step(end)
            else:
                self._free_step(end)
            self.time = end
            progress(end)

    def trajectory(self) -> Trajectory:
        """Return the rows so far as a result."""
        columns = dict(zip(Row._fields, map(np.array, zip(*self._rows, strict=True)), strict=True))
        summary: dict[str, Any] = {
            "algorithm": "through the FMUs",
            "iterations_per_solve": self._iterations / self._solves if self._solves else 0.0,
            "wall_time": perf_counter() - self._began,
        }
        return problem.result(self._scene, columns, np.array(self._shapes), self._events, summary)

    # Steps ----------------------------------------------------------------------------------------------------------

    def _free_step(self, end: float) -> None:
        """Make lines 1–4: both advance alone, until a step ends with the tip at Ψ or below."""
        tip = self._beam.advance(self.time, self._h, NO_FORCE)
        self._take(self._spring_alone(self._y, self._z))
        if tip.displacement <= self._spring.equilibrium:
            self.time = end
            self._first_contact()
        self._record(end, "free")

    def _first_contact(self) -> None:
        """Make lines 5 and 6."""
        self._touched = True
        self._stiffness = self._contact.stiffness
        self._y = self._spring.equilibrium
        if self._at_contact == "tip":
            self._z = self._beam.motion().velocity
        self._note(EventKind.IMPACT, self.time)

    def _contact_step(self, end: float) -> None:
        """Make lines 8–30."""
        psi = self._spring.equilibrium
        h = self._h
        y = self._y
        z = self._z
        u = self._beam.motion().displacement
        energy = self._spring_energy()
        self._beam.mark()
        u_free = self._beam.advance(self.time, h, NO_FORCE).displacement
        u_new = self._predicted_tip(u_free, u)  # line 9
        acting = self._stiffness
        case = 0
        phase = "free"
        reached = None
        joined = u_new <= psi  # line 14 then asks for no y_new
        if not joined:
            reached = self._spring_step(y, z)  # line 10
            if psi < reached.y < u_new:  # lines 11–13
                case = 11
                self._stiffness = 0.0
            else:
                joined = u_new <= reached.y  # line 14
        if joined:
            case = 14
            phase = "tied"
            self._stiffness = acting = self._contact.stiffness  # line 15
            reached = self._spring_step(u_new, z)  # lines 16, 17
            if reached.y <= self._phi:  # lines 20–24
                phase = "seated"
                reached = self._step_to_foundation(y, z)
            u_new = reached.y  # lines 18, 21
            reached = reached._replace(z=2.0 * (reached.y - y) / h - z)  # line 29
        assert reached is not None
        self._take(reached)
        contact = (u_new - u_free) / self._response  # lines 13, 19, 22
        if contact != 0.0:  # else the beam is there
            self._beam.rewind()
            self._beam.advance(self.time, h, (contact, 0.0, 0.0))
        inside = 0.5 * (self._law(u_new, acting) + self._law(u, acting))
        # What no force of the model does: the overwritten tip's work on the beam, the exchanged yˡ on the spring.
        self._injected_into_beam += (contact - inside) * (u_new - u)
        worked = (reached.foundation - reached.pressing + self._spring.external_force) * (reached.y - y)
        self._injected_into_spring += self._spring_energy() - energy + reached.dissipated - worked
        if phase == "seated":
            self._note(EventKind.STOP_IMPACT, end, h * reached.foundation)
        self._record(end, phase, contact, inside, reached.foundation, case)

    def _predicted_tip(self, u_free: float, u: float) -> float:
        """Return uˡ⁺¹ of (62), nonlinear only at the tip: u = u_free + b ½ (λ(Ψ−u)₊^p + λ(Ψ−uˡ)₊^p)."""
        before = self._law(u)
        w = u
        half = 0.5 * self._response
        for _ in range(_MAX_ITERATIONS):
            force = self._law(w)
            change = (w - u_free - half * (force + before)) / (1.0 - half * self._slope(w, force))
            w -= change
            if abs(change) <= _TOLERANCE:
                return w
        raise StepRefused("line 9 of Algorithm 1: Newton's method for the tip does not converge")

    # The spring: each function begins with a new instance from (y, z) ------------------------------------------------

    def _new_spring(self, y: float, z: float) -> FmuSpring:
        return FmuSpring(self._spring.model_copy(update={"initial_velocity": z}), self.time, y)

    def _spring_alone(self, y: float, z: float) -> SpringStep:
        """Return the step from ``y`` and ``z`` without a force on the top."""
        with closing(self._new_spring(y, z)) as spring:
            motion = spring.advance(self.time, self._h, NO_FORCE)
            return SpringStep(motion.displacement, motion.velocity, spring.energies().dissipated)

    def _spring_step(self, y: float, z: float) -> SpringStep:
        """Return the step from ``y`` and ``z`` under the mean force of the law."""
        before = self._law(y)
        end = y
        with closing(self._new_spring(y, z)) as spring:
            spring.mark()
            response = 0.5 * self._h**2 / spring.mass
            for k in range(1, _MAX_ITERATIONS + 1):
                force = self._law(end)
                pressing = 0.5 * (force + before)
                spring.rewind()
                motion = spring.advance(self.time, self._h, (pressing, 0.0, 0.0))
                change = (end - motion.displacement) / (1.0 + 0.5 * response * self._slope(end, force))
                if abs(change) <= _TOLERANCE:
                    self._solves += 1
                    self._iterations += k
                    return SpringStep(*motion[:2], spring.energies().dissipated, pressing)
                end -= change
        raise StepRefused("lines 10 and 17 of Algorithm 1: Newton's method for the spring does not converge")

    def _step_to_foundation(self, y: float, z: float) -> SpringStep:
        """Return the step from ``y`` and ``z`` that the constant N ends on the foundation."""
        pressing = 0.5 * (self._law(self._phi) + self._law(y))
        with closing(self._new_spring(y, z)) as spring:
            spring.mark()
            n = 0.0
            response = 0.5 * self._h**2 / spring.mass
            for _ in range(_MAX_ITERATIONS):
                spring.rewind()
                motion = spring.advance(self.time, self._h, (pressing, 0.0, 0.0), (n, 0.0, 0.0))
                miss = self._phi - motion.displacement
                if abs(miss) <= _TOLERANCE:
                    return SpringStep(self._phi, motion.velocity, spring.energies().dissipated, pressing, n)
                n += miss / response
        raise StepRefused("line 24 of Algorithm 1: no foundation force found")

    def _take(self, reached: SpringStep) -> None:
        self._y = reached.y
        self._z = reached.z
        self._dissipated += reached.dissipated
        if not (isfinite(reached.y) and isfinite(reached.z)):
            raise OverflowError("the solution overflows")

    # Laws and energies ----------------------------------------------------------------------------------------------

    def _law(self, w: float, stiffness: float | None = None) -> float:
        """Return λ (Ψ − w)₊^p [N] with the λ_nc that lines 12 and 15 have left, or with ``stiffness``."""
        acting = self._stiffness if stiffness is None else stiffness
        return float(acting * max(self._spring.equilibrium - w, 0.0) ** self._contact.exponent)

    def _slope(self, w: float, force: float) -> float:
        """Return the derivative of `_law` by w [N/m], from its ``force`` there."""
        depth = self._spring.equilibrium - w
        return -self._contact.exponent * force / depth if depth > 0.0 else 0.0

    def _spring_energy(self) -> float:
        """Return ½ m z² + ½ k1 x² + ¼ k2 x⁴ [J], x = y − y₀."""
        p = self._spring
        square = (self._y - p.unloaded) ** 2
        return 0.5 * p.mass * self._z**2 + 0.5 * p.linear_stiffness * square + 0.25 * p.cubic_stiffness * square**2

    def _measure_response(self) -> None:
        """Find the response to a force that moves the tip as far as it moves by itself; to 1 N it may be rounding."""
        beam = self._beam
        size = self._h
        beam.mark()
        alone = beam.advance(self.time, size, NO_FORCE)
        length = max(abs(alone.displacement), size * abs(alone.velocity))
        force = 2.0 * beam.mass * length / size**2 or 1.0
        beam.rewind()
        pushed = beam.advance(self.time, size, (force, 0.0, 0.0))
        beam.rewind()
        self._response = (pushed.displacement - alone.displacement) / force

    # Rows -----------------------------------------------------------------------------------------------------------

    def _record(
        self, time: float, phase: str, contact: float = 0.0, inside: float = 0.0, foundation: float = 0.0, case: int = 0
    ) -> None:
        tip = self._beam.motion()
        energies = self._beam.energies()
        self._shapes.append(self._beam.shape())
        self._rows.append(
            Row(
                time,
                tip.displacement,
                tip.velocity,
                self._y,
                self._z,
                phase,
                contact,
                inside,
                foundation,
                e_beam=energies.kinetic + energies.potential,
                e_spring=self._spring_energy(),
                e_dissipated=energies.dissipated + self._dissipated,
                e_load=energies.load_potential - self._spring.external_force * self._y,
                case=float(case),
                e_injected_beam=self._injected_into_beam,
                e_injected_spring=self._injected_into_spring,
            )
        )

    def _note(self, kind: EventKind, time: float, impulse: float = 0.0) -> None:
        tip = self._beam.motion()
        ends = (self._y, self._z, tip.displacement, tip.velocity)
        self._events.append(Event(time, kind, *ends, impulse_foundation=impulse, joint=Joint.TIED))
