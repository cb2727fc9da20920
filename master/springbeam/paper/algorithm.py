"""Algorithm 1 of Ahn & Tate, lines 1–31, for two bodies whatever solves their equations.

Line numbers in comments are those of the printed algorithm. Where it leaves something open the choice has a name:

``at_contact``
    z at t_c: see `AtContact`.
``y_temp`` (lines 16–17, "accommodate the transmission condition")
    ``"equation"``: (53) starts from the tip's position u instead of yˡ, and line 29 forms z from the true yˡ.
    ``"guess"``: u is where Newton's method starts; (53) keeps yˡ.
    ``"both"``: u takes the place of yˡ in (53) and in line 29.
``y == φ`` (line 20)
    y ≤ φ.
Lines 11 and 14 leave a third case, y ≤ Ψ < u: nothing is changed.

Line 18 overwrites the tip by the spring's position. The force on the tip that would do so is applied and its work
counted (``e_injected_beam``), like what exchanging yˡ adds to the spring (``e_injected_spring``): nothing else in the
model pays for either, and ``energy_residual`` shows it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from math import inf, isfinite
from time import perf_counter
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np

from ..motion.events import Event, EventKind, Joint
from ..results.trajectory import Trajectory
from ..scene import Scene
from ..scene.laws import TransmissionContact
from . import problem

#: z at t_c: ``"rest"``, as it is, which is 0 of a spring at rest (section 6); ``"tip"``, the tip's velocity (line 5).
#: The tip of the semi-discrete beam does not jump, so that this is also the average of eq. (11).
AtContact = Literal["rest", "tip"]
YTemp = Literal["equation", "guess", "both"]

#: Limits of Newton's method, on the change of the unknown (section 6: ε = 1e-12) [m].
MOST_ITERATIONS = 50
TOLERANCE = 1e-12


class AlgorithmFailure(RuntimeError):
    """Newton's method did not converge, a body refused a step, or the solution overflows.

    ``trajectory`` holds the steps before, if the run has begun.
    """

    trajectory: Trajectory | None = None


class Law(NamedTuple):
    """The force λ (Ψ − w)₊^p [N], with the λ_nc that lines 12 and 15 have left."""

    stiffness: float
    exponent: float
    equilibrium: float  #: Ψ [m]

    def force(self, w: float) -> tuple[float, float]:
        """Return the force at the height ``w`` [m], and its derivative by w."""
        depth = max(self.equilibrium - w, 0.0)
        slope = -self.exponent * self.stiffness * depth ** (self.exponent - 1.0) if depth > 0.0 else 0.0
        return self.stiffness * depth**self.exponent, slope


class SpringStep(NamedTuple):
    """Where a step of the spring ends, and under which mean forces."""

    y: float  #: [m]
    z: float  #: [m/s]
    dissipated: float  #: [J]
    pressing: float  #: mean of the law's force ½ (λ(Ψ − yˡ⁺¹)₊^p + λ(Ψ − yˡ)₊^p) [N]
    foundation: float = 0.0  #: N [N]
    iterations: int = 0  #: of Newton's method


class Bodies(ABC):
    """The two bodies, as one of the programs advances them; the beam has a state, the spring is given its own."""

    name: ClassVar[str]
    #: Errors of a step that cannot be made.
    FAILURES: ClassVar[tuple[type[Exception], ...]] = (AlgorithmFailure, OverflowError)
    response: float  #: u_tip per unit tip force over a step [m/N]; the beam is linear

    @abstractmethod
    def set_step(self, h: float) -> None:
        """Prepare for steps of ``h`` [s]."""

    @property
    @abstractmethod
    def tip(self) -> tuple[float, float]:
        """The tip's deflection and velocity [m, m/s]."""

    @abstractmethod
    def advance_free(self, time: float) -> float:
        """Advance the beam by (62) without a force from ``time`` [s] on; return the tip's deflection [m]."""

    @abstractmethod
    def push(self, force: float) -> None:
        """Make the last step again, under a ``force`` on the tip [N]."""

    @abstractmethod
    def spring_step(self, time: float, y: float, z: float, law: Law, guess: float) -> SpringStep:
        """Return the step of the spring by (53) from (y, z), under the law; Newton's method begins at ``guess``."""

    @abstractmethod
    def step_to_foundation(self, time: float, y: float, z: float, law: Law, phi: float) -> SpringStep:
        """Return the step of the spring from (y, z) that the constant N ends at φ."""

    @abstractmethod
    def energies(self) -> tuple[float, float, float]:
        """Return the beam's energy, what it has dissipated, and the potential of its loads [J]."""

    @abstractmethod
    def shape(self) -> Any:
        """Return the state of the beam, of which `shapes` makes a row."""

    @abstractmethod
    def shapes(self, states: list[Any]) -> np.ndarray:
        """Return deflections [m], bending moments [N·m] and shear forces [N] of states, shape (n, 63)."""

    def predicted_tip(self, u_free: float, u: float, law: Law) -> float:
        """Return uˡ⁺¹ of (62), nonlinear only at the tip: u = u_free + b ½ (λ(Ψ−u)₊^p + λ(Ψ−uˡ)₊^p)."""
        half = 0.5 * self.response
        before, _ = law.force(u)
        w = u
        for _ in range(MOST_ITERATIONS):
            force, slope = law.force(w)
            change = (w - u_free - half * (force + before)) / (1.0 - half * slope)
            w -= change
            if abs(change) <= TOLERANCE:
                return w
        raise AlgorithmFailure("Newton's method for the tip (line 9) does not converge")


class _Row(NamedTuple):
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


class Algorithm:
    """A run of a scene by ``bodies``; see `springbeam.paper.monolithic.algorithm_1`."""

    def __init__(self, scene: Scene, bodies: Bodies, at_contact: AtContact, y_temp: YTemp = "equation") -> None:
        assert scene.spring is not None
        assert isinstance(scene.contact, TransmissionContact)
        self._scene = scene
        self._bodies = bodies
        self._at_contact = at_contact
        self._y_temp = y_temp
        self._spring = scene.spring
        self._phi = -inf if scene.stop is None else scene.stop.position
        self._full = Law(scene.contact.stiffness, scene.contact.exponent, scene.spring.equilibrium)
        self._law = self._full._replace(stiffness=0.0)
        self._touched = False
        self._time = scene.contact_time or 0.0  #: where the present step begins [s]
        self._h = 0.0  #: its size [s]
        self._y = scene.spring.equilibrium  #: [m]
        self._z = scene.spring.initial_velocity  #: [m/s]
        self._dissipated = 0.0  #: by the spring so far [J]
        self._into_beam = 0.0  #: injected so far [J]
        self._into_spring = 0.0
        self._iterations: dict[str, list[int]] = {"predicted": [], "joined": []}
        self._events: list[Event] = []
        self._rows: list[_Row] = []
        self._states: list[Any] = []
        self._began = perf_counter()

    def run(self, progress: Callable[[float], object]) -> Trajectory:
        """Make all steps. Raises AlgorithmFailure with those so far."""
        try:
            self._advance(progress)
        except self._bodies.FAILURES as failed:
            failure = AlgorithmFailure(f"{failed} at t = {self._time:.6g} s")
            failure.trajectory = self._trajectory() if self._rows else None
            raise failure from failed
        return self._trajectory()

    def _advance(self, progress: Callable[[float], object]) -> None:
        beam = self._scene.beam
        assert beam is not None
        if beam.approach == "undeformed" or self._bodies.tip[0] <= self._spring.equilibrium:
            self._first_contact()
        self._record("tied" if self._touched else "free")
        for end, size in problem.steps(self._scene):
            if size != self._h:
                self._h = size
                self._bodies.set_step(size)
            step = self._contact_step if self._touched else self._free_step
            step(end)
            progress(end)

    def _free_step(self, end: float) -> None:
        """Make lines 1–4: both advance alone, until a step ends with the tip at Ψ or below."""
        u = self._bodies.advance_free(self._time)
        self._take(self._bodies.spring_step(self._time, self._y, self._z, self._law, self._y), end)
        if u <= self._spring.equilibrium:
            self._first_contact()
        self._record("free")

    def _first_contact(self) -> None:
        """Make lines 5 and 6."""
        self._touched = True
        self._law = self._full
        self._y = self._spring.equilibrium
        if self._at_contact == "tip":
            self._z = self._bodies.tip[1]
        self._note(EventKind.IMPACT)

    def _contact_step(self, end: float) -> None:
        """Make lines 8–30."""
        bodies = self._bodies
        psi = self._spring.equilibrium
        y = self._y
        z = self._z
        u, _ = bodies.tip
        energy = self._spring_energy()
        u_free = bodies.advance_free(self._time)
        acting = self._law
        u_new = bodies.predicted_tip(u_free, u, acting)  # line 9
        case = 0
        phase = "free"
        joined = u_new <= psi  # line 14 then asks for no y_new
        if not joined:
            reached = self._counted("predicted", bodies.spring_step(self._time, y, z, acting, y))  # line 10, N = 0
            joined = u_new <= reached.y
        if not joined and psi < reached.y:  # lines 11–13: the interior of (62) does not see λ_nc
            case = 11
            self._law = self._full._replace(stiffness=0.0)
        elif joined:  # line 14
            case = 14
            phase = "tied"
            self._law = acting = self._full  # line 15
            y_temp = y if self._y_temp == "guess" else u_new  # line 16
            reached = self._counted("joined", bodies.spring_step(self._time, y_temp, z, acting, u_new))  # line 17
            if reached.y <= self._phi:  # lines 20–24
                phase = "seated"
                reached = bodies.step_to_foundation(self._time, y, z, acting, self._phi)
            u_new = reached.y  # lines 18, 21
            if self._y_temp != "both" or phase == "seated":
                reached = reached._replace(z=2.0 * (reached.y - y) / self._h - z)  # line 29
        contact = (u_new - u_free) / bodies.response  # lines 13, 19, 22: the tip's row of (62) is overwritten
        if contact != 0.0:  # else the beam is there
            bodies.push(contact)
        inside = 0.5 * (acting.force(u_new)[0] + acting.force(u)[0])
        self._take(reached, end)
        # What no force of the model does: the overwritten tip's work on the beam, the exchanged yˡ on the spring.
        self._into_beam += (contact - inside) * (u_new - u)
        worked = (reached.foundation - reached.pressing + self._spring.external_force) * (reached.y - y)
        self._into_spring += self._spring_energy() - energy + reached.dissipated - worked
        if phase == "seated":
            self._note(EventKind.STOP_IMPACT, self._h * reached.foundation)
        self._record(phase, contact, inside, reached.foundation, case)

    def _counted(self, line: str, step: SpringStep) -> SpringStep:
        self._iterations[line].append(step.iterations)
        return step

    def _take(self, reached: SpringStep, end: float) -> None:
        """Go on from the ``end`` [s] of a step."""
        if not all(map(isfinite, (reached.y, reached.z, *self._bodies.tip))):
            raise OverflowError("the solution overflows")
        self._time = end
        self._y = reached.y
        self._z = reached.z
        self._dissipated += reached.dissipated

    def _spring_energy(self) -> float:
        """Return ½ m z² + ½ k1 x² + ¼ k2 x⁴ [J], x = y − y₀."""
        p = self._spring
        square = (self._y - p.unloaded) ** 2
        return 0.5 * p.mass * self._z**2 + 0.5 * p.linear_stiffness * square + 0.25 * p.cubic_stiffness * square**2

    def _record(
        self, phase: str, contact: float = 0.0, inside: float = 0.0, foundation: float = 0.0, case: int = 0
    ) -> None:
        e_beam, dissipated, e_load = self._bodies.energies()
        e_load -= self._spring.external_force * self._y
        energies = (e_beam, self._spring_energy(), dissipated + self._dissipated, e_load)
        ends = (*self._bodies.tip, self._y, self._z)
        injected = (float(case), self._into_beam, self._into_spring)
        self._rows.append(_Row(self._time, *ends, phase, contact, inside, foundation, *energies, *injected))
        self._states.append(self._bodies.shape())

    def _note(self, kind: EventKind, impulse: float = 0.0) -> None:
        ends = (self._y, self._z, *self._bodies.tip)
        self._events.append(Event(self._time, kind, *ends, impulse_foundation=impulse, joint=Joint.TIED))

    def _trajectory(self) -> Trajectory:
        """Return the rows so far as a result."""
        columns = dict(zip(_Row._fields, map(np.array, zip(*self._rows, strict=True)), strict=True))
        predicted = self._iterations["predicted"]
        joined = self._iterations["joined"]
        newton = {name: float(np.mean(counts)) if counts else 0.0 for name, counts in self._iterations.items()}
        summary: dict[str, Any] = {
            "algorithm": self._bodies.name,
            "iterations_per_solve": float(np.mean(predicted + joined)) if predicted + joined else 0.0,
            "newton": {**newton, "solves": len(predicted + joined)},
            "steps_apart": int(np.sum(columns["case"] == 11)),
            "wall_time": perf_counter() - self._began,
        }
        return problem.result(self._scene, columns, self._bodies.shapes(self._states), self._events, summary)
