"""Ahn & Tate's Algorithm 1 as a co-simulation: lines (7)–(31) with the two FMUs in place of (62) and (53).

The beam FMU steps by ``generalized_alpha`` with ρ∞ = 1, which is (62); the spring's midpoint rule (53) is replaced by
IDA over the step, restarted by its exact start values wherever the algorithm overwrites y or z. The tip is moved to y
(lines 18, 21) by the constant tip force that does so; nothing opposes that force, so its work is energy from nowhere,
and ``energy_residual`` shows it. Readings where the print leaves something open: ``docs/paper.md``. Steps are of
``coupling.macro_step``; where ``time.t_end`` is off their grid the last one is shorter.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..bodies.checkpointed import Checkpointed
from ..bodies.fmu_bodies import FmuSpring
from ..bodies.protocol import NO_FORCE, BeamBody, BodyFailed, StepRefused
from ..contact.laws import Compliance
from ..contact.phases import Joint, Phase
from ..coupling.protocol import NOTHING_BOOKED
from ..results.recording import Recorder
from ..results.steps import packed
from ..results.trajectory import Event
from ..scene import Scene
from ..scene.resolution import not_resolved
from .ledger import errors
from .log import Log
from .outcome import OVERFLOW, RunStopped
from .stepping import State

_MAX_ITERATIONS = 50
#: Newton's tolerance of the spring's and the tip's position (section 6: ε = 1e-12) [m].
_TOLERANCE = 1e-12


class PaperLaw(Checkpointed):
    """One run of Algorithm 1 with given bodies; parameters as of `springbeam.run.master.Master`."""

    CHECKPOINTED = (
        "_beam",
        "_spring",
        "state",
        "h",
        "_begun",
        "_touched",
        "_stiffness",
        "_energy_at_start",
        "_injected",
        "_solves",
        "_iterations",
        "macro_steps",
        "_beam_response",
    )

    def __init__(
        self,
        scene: Scene,
        start_time: float,
        beam: BeamBody,
        spring: FmuSpring,
        recorder: Recorder,
    ) -> None:
        assert scene.spring is not None
        self.scene, self._recorder = scene, recorder
        self._log = Log(scene, recorder)
        recorder.fetch = self.hand_over
        self._beam, self._spring = beam, spring
        self._parameters = scene.spring
        self._phi = -np.inf if scene.stop is None else scene.stop.position
        self.h = scene.coupling.H
        self.state, self._start_time = State(start_time), start_time
        self._begun = self._touched = False
        self._stiffness = 0.0  #: λ_nc as lines 12 and 15 have left it
        self._energy_at_start: float | None = None
        self._injected = {"beam": 0.0, "spring": 0.0}
        self._solves = self._iterations = 0
        self.macro_steps = 0
        #: u_tip per unit tip force over one step [m/N]; the beam is linear.
        self._beam_response = 0.0

    @property
    def done(self) -> bool:
        """Whether the run has reached t_end."""
        whole, rest = self.scene.equal_steps
        return self._begun and self.macro_steps == whole + (rest > 0.0)

    def step(self) -> None:
        """Make the next step; the first call begins the run. Raises RunStopped."""
        try:
            if not self._begun:
                self._begin()
            if not self.done:
                self._made()
            if self._log.full or self.done:
                self.hand_over()
        except (StepRefused, BodyFailed, OverflowError) as error:
            self.hand_over()
            raise RunStopped(OVERFLOW if isinstance(error, OverflowError) else str(error), self.state.time) from error

    def hand_over(self) -> None:
        """Give the recorder the records that it does not have yet."""
        self._log.hand_over(self.h)

    def catch_up(self) -> None:
        """Take note of the records that the recorder has of a run that was restored."""
        self._log.catch_up()

    def _made(self) -> None:
        whole, rest = self.scene.equal_steps
        last = self.macro_steps == whole
        if last:
            self.h = rest
            self._measure_beam()
        phase, contact, inside, foundation = self._step()
        self.macro_steps += 1
        self.state.time = self.scene.time.t_end if last else self._start_time + self.macro_steps * self.h
        if phase == "seated":
            self._event("stop_impact", impulse_foundation=self.h * foundation)
        if not self._touched and self._beam.motion().displacement <= self._parameters.equilibrium:
            self._touched, self._stiffness = True, self.scene.contact.stiffness
            self._first_contact()
        self._record(phase, contact, inside, foundation)

    def _begin(self) -> None:
        self._touched = self._beam.motion().displacement <= self._parameters.equilibrium
        if self._touched:
            self._stiffness = self.scene.contact.stiffness
            self._first_contact()
        self._record("tied" if self._touched else "free", 0.0, 0.0, 0.0)
        self._measure_beam()
        self._begun = True

    def _first_contact(self) -> None:
        """Line 5, or ẏ(t_c) as the scene has it."""
        z = self._spring.motion().velocity
        if self.scene.contact.impact == "tip":
            z = self._beam.motion().velocity
        self._spring.restart(self.state.time, self._parameters.equilibrium, z, self._spring.energies().dissipated)
        self._event("impact")

    def _measure_beam(self) -> None:
        """Measure by a force that moves the tip as far as it moves by itself: the response to 1 N may be rounding."""
        beam = self._beam
        beam.mark()
        alone = beam.advance(self.state.time, self.h, NO_FORCE)
        length = max(abs(alone.displacement), self.h * abs(alone.velocity))
        force = 2.0 * beam.mass * length / self.h**2 or 1.0
        beam.rewind()
        pushed = beam.advance(self.state.time, self.h, (force, 0.0, 0.0))
        beam.rewind()
        self._beam_response = (pushed.displacement - alone.displacement) / force

    def _law(self, w: float, stiffness: float | None = None) -> float:
        """λ (Ψ − w)₊^p [N] with the λ_nc that lines 12 and 15 have left, or with ``stiffness``."""
        acting = self._stiffness if stiffness is None else stiffness
        return Compliance(acting, self.scene.contact.exponent).force(self._parameters.equilibrium - w)

    def _step(self) -> tuple[str, float, float, float]:
        """Lines 8–30. Returns the phase and the means of the tip's force, λ_nc(Ψ−u)₊^p and N over the step [N]."""
        beam, spring, psi = self._beam, self._spring, self._parameters.equilibrium
        u = beam.motion().displacement
        start = spring.motion()
        y, z = start.displacement, start.velocity
        beam.mark()
        u_free = beam.advance(self.state.time, self.h, NO_FORCE).displacement
        if not self._touched:
            spring.advance(self.state.time, self.h, NO_FORCE)
            return "free", 0.0, 0.0, 0.0
        u_new = self._predicted_tip(u_free, u)  # line 9
        kinetic, potential, dissipated, _ = spring.energies()
        acting, phase, foundation = self._stiffness, "free", 0.0
        joined = u_new <= psi  # line 14 then asks for no y_new
        if not joined:
            y_new, pressing = self._spring_end(y, y)  # line 10
            if psi < y_new < u_new:  # lines 11–13
                self._stiffness = 0.0
            else:
                joined = u_new <= y_new  # line 14
        if joined:
            phase = "tied"
            self._stiffness = acting = self.scene.contact.stiffness  # line 15
            spring.restart(self.state.time, u_new, z, dissipated)  # line 16
            y_new, pressing = self._spring_end(u_new, u_new)  # line 17
            if y_new <= self._phi:  # lines 20–24
                phase, y_new = "seated", self._phi
                spring.restart(self.state.time, y, z, dissipated)
                pressing = 0.5 * (self._law(y_new) + self._law(y))
                foundation = self._foundation_force(pressing)
            u_new = y_new  # lines 18, 21
            z_new = 2.0 * (y_new - y) / self.h - z  # line 29
            if phase == "seated":
                spring.restart(self.state.time + self.h, y_new, z_new, spring.energies().dissipated)
            else:  # the spring has come to y_new: only its velocity is another
                spring.apply_impulse(spring.mass * (z_new - spring.motion().velocity))
        contact = (u_new - u_free) / self._beam_response  # lines 13, 19, 22
        if contact != 0.0:  # else the beam is there
            beam.rewind()
            beam.advance(self.state.time, self.h, (contact, 0.0, 0.0))
        inside = 0.5 * (self._law(u_new, acting) + self._law(u, acting))
        # What no force of the model does: the overwritten tip's work on the beam, the exchanged yˡ on the spring.
        self._injected["beam"] += (contact - inside) * (u_new - u)
        worked = (foundation - pressing + self._parameters.external_force) * (y_new - y)
        self._injected["spring"] += self._spring_energy() - kinetic - potential - worked
        return phase, contact, inside, foundation

    def _predicted_tip(self, u_free: float, u: float) -> float:
        """uˡ⁺¹ of (62), nonlinear only at the tip: u = u_free + b ½ (λ(Ψ−u)₊^p + λ(Ψ−uˡ)₊^p)."""
        before, w, p = self._law(u), u, self.scene.contact.exponent
        for _ in range(_MAX_ITERATIONS):
            force = self._law(w)
            depth = self._parameters.equilibrium - w
            slope = -p * force / depth if depth > 0.0 else 0.0
            half = 0.5 * self._beam_response
            change = (w - u_free - half * (force + before)) / (1.0 - half * slope)
            w -= change
            if abs(change) <= _TOLERANCE:
                return w
        raise StepRefused("line 9 of Algorithm 1: Newton's method for the tip does not converge")

    def _spring_end(self, y: float, guess: float) -> tuple[float, float]:
        """yˡ⁺¹ from y and the mean force ½ (λ(Ψ−yˡ⁺¹)₊^p + λ(Ψ−y)₊^p) that presses the spring on the way."""
        before, end = self._law(y), guess
        self._spring.mark()
        response = 0.5 * self.h**2 / self._parameters.mass
        for k in range(1, _MAX_ITERATIONS + 1):
            force = self._law(end)
            pressing = 0.5 * (force + before)
            self._spring.rewind()
            reached = self._spring.advance(self.state.time, self.h, (pressing, 0.0, 0.0)).displacement
            depth = self._parameters.equilibrium - end
            slope = -self.scene.contact.exponent * force / depth if depth > 0.0 else 0.0
            change = (end - reached) / (1.0 + 0.5 * response * slope)
            if abs(change) <= _TOLERANCE:
                self._solves += 1
                self._iterations += k
                return reached, pressing
            end -= change
        raise StepRefused("lines 10 and 17 of Algorithm 1: Newton's method for the spring does not converge")

    def _foundation_force(self, pressing: float) -> float:
        """The constant N [N] with which the step from (yˡ, zˡ) ends on the foundation."""
        self._spring.mark()
        n, response = 0.0, 0.5 * self.h**2 / self._parameters.mass
        for _ in range(_MAX_ITERATIONS):
            self._spring.rewind()
            reached = self._spring.advance(self.state.time, self.h, (pressing, 0.0, 0.0), (n, 0.0, 0.0)).displacement
            miss = self._phi - reached
            if abs(miss) <= _TOLERANCE:
                return n
            n += miss / response
        raise StepRefused("line 24 of Algorithm 1: no foundation force found")

    def _spring_energy(self) -> float:
        energies = self._spring.energies()
        return energies.kinetic + energies.potential

    def _event(self, kind: str, impulse_foundation: float = 0.0) -> None:
        tip, top = self._beam.motion(), self._spring.motion()
        values = (top.displacement, top.velocity, tip.displacement, tip.velocity)
        self._log.happened(Event(self.state.time, kind, *values, impulse_foundation=impulse_foundation))

    def _record(self, phase: str, contact: float, inside: float, foundation: float) -> None:
        (u, v, _, _), (y, z, _, _) = self._beam.motion(), self._spring.motion()
        of_beam, of_spring = self._beam.energies(), self._spring.energies()
        if self._energy_at_start is None:
            self._energy_at_start = of_beam.kinetic + of_beam.potential + (of_spring.kinetic + of_spring.potential)
            self._energy_at_start += of_beam.dissipated + of_spring.dissipated
            self._energy_at_start += of_beam.load_potential + of_spring.load_potential
        self.state.phase = {"free": Phase(), "tied": Phase(Joint.TIED), "seated": Phase(Joint.TIED, seated=True)}[phase]
        # Nothing is known between its rows: no record has a size.
        self._log.add(
            packed(
                *(self.state.time, 0.0, u, v, 0.0, 0.0, y, z, 0.0, 0.0, contact, 0.0, 0.0, foundation, 0.0, 0.0),
                *(u, v, y, z, self.state.phase.number, self._log.events, contact, inside),
                *(*of_beam, *of_spring, *NOTHING_BOOKED, 0.0, 0.0, 0.0, self._energy_at_start),
            )
        )
        self._log.show(self.state.time, self._beam.shape())

    def summary(self) -> dict[str, Any]:
        """Return what `springbeam.run.master.Master` does, with what the algorithm injected [J]."""
        warnings = ["contact.law = 'paper' overwrites the tip's position, which changes the energy by energy_residual"]
        unresolved = not_resolved(self.scene, 0.0)
        if unresolved is not None:
            warnings.append(unresolved)
        steps = self._recorder.steps()
        off = errors(self.scene, steps, steps[:1], 0.0, of_interface=False) if len(steps) else None
        return {
            "time": self.state.time,
            "macro_steps": self.macro_steps,
            "events": self._log.events,
            "halved_steps": 0,
            "iterations": self._iterations,
            "spring_steps_per_solve": self._iterations / self._solves if self._solves else 0.0,
            "max_energy_residual": 0.0 if off is None else float(abs(off.share).max()),
            "max_energy_residual_joule": 0.0 if off is None else float(abs(off.residual).max()),
            "injected_into_beam": self._injected["beam"],
            "injected_into_spring": self._injected["spring"],
            "resolved": unresolved is None,
            "warnings": warnings,
        }
