"""The master: macro steps, phases, events, the energy ledger.

One step is *mark* (the bodies remember their state), *attempt* (advance under the phase's law; may be repeated with
any size, each time from the mark), *detect* (which event comes first inside the step?) and *accept*. An event shortens
the step to itself, acts, and the run goes on from there.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from .contact import Impact, Joint, Phase, foundation_impact, meeting, spring_force
from .coupling import conditions, force
from .coupling.compliance import Compliance, compliance_energy, compliance_force
from .coupling.exchange import Exchange
from .coupling.tie import NotConverged, Tie
from .events import Sample, cubic_crossing, cubic_value, interpolated, locate, lowest_inside
from .recording import NonFiniteValue, Recorder
from .scene import ORDINARY_SCHEMES, Scene
from .subsystem import NO_FORCE, Body, Energies, Force, Held, Motion, StepRefused
from .trajectory import Event

#: ``progress(time, phase, macro_steps)``, called once per accepted step.
Progress = Callable[[float, str, int], None]

_EPS = float(np.finfo(float).eps)
#: A step that is refused is halved this often before the run stops.
_MAX_HALVINGS = 20
#: An event closer to the start of a step than this fraction of H happens at the start.
_NO_TIME = 1e-9
#: Events closer than this fraction of H are at once; so many of them and the contact is said to chatter.
_AT_ONCE, _MAX_EVENTS_AT_ONCE = 1e-6, 100
#: A rebound slower than this fraction of the fastest foundation impact so far ends seated (e < 1 only).
_SEATING_SPEED = 1e-8
#: A remainder of the macro grid shorter than this fraction of H joins the next step.
_SHORT_REMAINDER = 0.25
#: Relative energy residual at which a scheme that may create energy says so, and at which the run stops.
_ENERGY_WARNS, _ENERGY_STOPS = 1e-3, 0.1
#: Velocity mismatch of tip and spring top, relative to their speed, above which the motion is called unresolved.
_UNRESOLVED = 0.2
#: Repetitions to end a step where the contact force vanishes.
_MAX_FORCE_CUTS = 8
#: Steps after first contact whose beam shape is kept, and shapes kept evenly over the run.
_SHAPES_AFTER_CONTACT, _SHAPES_OVER_RUN = 20, 400


class RunStopped(RuntimeError):
    """The run ended before t_end; everything up to ``time`` has been recorded."""

    def __init__(self, cause: str, time: float, residual: float | None = None) -> None:
        at = "" if residual is None else f", residual {residual:.3g} m"
        super().__init__(f"stopped at t = {time:.9g} s: {cause}{at}")
        self.cause, self.time, self.residual = cause, time, residual


class BeamBody(Body, Protocol):
    def shape(self) -> np.ndarray:
        """Deflection [m] at `springbeam.trajectory.SHAPE_POINTS`, shape (21,)."""


@dataclass(frozen=True)
class Step:
    """An attempted step and what the bodies' ends did on it."""

    time: float
    size: float
    phase: Phase
    contact: Force  #: C on the step
    foundation: Force  #: N on the step
    start: tuple[Motion, Motion]  #: (tip, lower end) at the mark
    end: tuple[Motion, Motion]


@dataclass
class Counts:
    macro_steps: int = 0
    events: int = 0
    halvings: int = 0


@dataclass
class Ledger:
    """E_beam + E_spring + E_contact + dissipated + impact losses − work of external loads = constant."""

    impact_loss: float = 0.0
    initial: float | None = None
    scale: float = 0.0
    largest_residual: float = 0.0
    relative: float = 0.0

    def book(self, beam: Energies, spring: Energies, contact: float) -> dict[str, float]:
        e_beam = beam.kinetic + beam.potential
        e_spring = spring.kinetic + spring.potential
        dissipated = beam.dissipated + spring.dissipated
        load = beam.load_potential + spring.load_potential
        total = e_beam + e_spring + contact + dissipated + self.impact_loss + load
        if self.initial is None:
            self.initial = total
        residual = total - self.initial
        self.scale = max(self.scale, abs(self.initial), e_beam + abs(e_spring) + contact)
        self.largest_residual = max(self.largest_residual, abs(residual))
        if self.scale > 0.0:
            self.relative = max(self.relative, abs(residual) / self.scale)
        return {
            "e_beam": e_beam,
            "e_spring": e_spring,
            "e_contact": contact,
            "e_dissipated": dissipated,
            "e_impact_loss": self.impact_loss,
            "e_load": load,
            "e_total": total,
            "energy_residual": residual,
        }


class Simulation:
    """One run of a scene with given bodies.

    Parameters
    ----------
    scene
        What is simulated.
    start_time
        Where the run starts [s], `springbeam.scene.Scene.contact_time` or 0.
    beam, spring
        The bodies at the start time; ``None`` where the scene has none.
    recorder
        Receives rows, events and shapes.
    progress
        Called once per accepted step.
    """

    def __init__(
        self,
        scene: Scene,
        start_time: float,
        beam: BeamBody | None,
        spring: Body | None,
        recorder: Recorder,
        progress: Progress | None = None,
    ) -> None:
        self.scene, self.recorder = scene, recorder
        self._beam, self._spring, self._progress = beam, spring, progress
        self._stop = None if scene.stop is None else scene.stop.position
        lower: Body | None = spring
        if lower is None and self._stop is not None:
            lower = Held(self._stop)
        self._bodies: list[Body] = [body for body in (beam, lower) if body is not None]
        self._upper: Body | None = beam
        self._lower: Body | None = lower
        self._held = None if self._stop is None else Held(self._stop)
        self._joinable = beam is not None and spring is not None
        coupling = scene.coupling
        self.H = coupling.macro_step
        self._compliant = scene.contact.law == "compliance" and self._joinable
        law = (scene.contact.stiffness, scene.contact.exponent)
        self._exchange: Exchange | None = None
        if coupling.scheme in ORDINARY_SCHEMES:
            self._exchange = Exchange(coupling.scheme == "gauss_seidel", coupling.degree, *law)
        scheme = "energy" if self._exchange is not None else coupling.scheme
        self._tie = Tie(conditions(scheme, coupling.degree), coupling.degree, coupling.tolerance, self.H)
        self._compliance = Compliance(*law, coupling.tolerance, self.H)
        #: Whether the coupling may create energy, so that its residual is watched.
        self._lossy = scheme == "hermite" or self._exchange is not None
        self._degree = 0 if self._compliant else coupling.degree
        self.counts = Counts()
        self.time = start_time
        self.phase = Phase()
        self._ledger = Ledger()
        self._contact: Force = NO_FORCE
        self._foundation: Force = NO_FORCE
        self._smoothed = 0.0  #: mean of C's two limits at the start of the last step
        self._steps_in_phase = 0
        #: (middle, C, N) of the last two steps of this phase.
        self._middles: list[tuple[float, float, float]] = []
        self._fastest_impact = 0.0
        self._last_opening = -float("inf")
        self._reclosed = False  #: the contact had opened and closed at once: its next step does not open it again
        self._shapes_left = _SHAPES_AFTER_CONTACT
        self._next_shape = self.time
        self._largest_mismatch = 0.0
        self._largest_speed = 0.0

    # -- the run ------------------------------------------------------------------------------------------------

    def run(self) -> None:
        """Until t_end. Raises RunStopped; what was computed is with the recorder."""
        t0, t_end = self.time, self.scene.time.t_end
        self._settle_start()
        self._record()
        macro_index, at_once, since = 0, 0, self.time
        while self.time < t_end:
            target = t0 + (macro_index + 1) * self.H
            size = target - self.time
            on_grid = abs(size - self.H) <= 1e-9 * self.H
            if size < _SHORT_REMAINDER * self.H:
                macro_index += 1
                target, size, on_grid = target + self.H, size + self.H, False
            if target >= t_end - 1e-9 * self.H:
                target, size = t_end, t_end - self.time
                on_grid = abs(size - self.H) <= 1e-9 * self.H
            step, event = self._advance(self.H if on_grid else size)
            if self.time + step.size - since > _AT_ONCE * self.H:
                at_once, since = 0, self.time + step.size
            at_once += 1
            if at_once > _MAX_EVENTS_AT_ONCE:
                raise RunStopped(f"the contact chatters: {at_once} events at once", self.time)
            whole = event is None and abs(step.size - size) <= 1e-9 * self.H
            if step.size > 0.0:
                self._accept(step, target if whole else self.time + step.size)
                if self._compliant:
                    self._note_contact(step)
            while t0 + (macro_index + 1) * self.H <= self.time + 1e-9 * self.H:
                macro_index += 1
            if event is not None:
                self._act(event, step)
            self._record()
            if self._progress is not None:
                self._progress(self.time, str(self.phase), self.counts.macro_steps)

    def _advance(self, size: float) -> tuple[Step, str | None]:
        """The next step and the event it ends on, the bodies left at its end."""
        for body in self._bodies:
            body.mark()
        start = self._motions()
        for halving in range(_MAX_HALVINGS + 1):
            try:
                at_once = self._immediate_event(start)
                if at_once is not None:
                    return Step(self.time, 0.0, self.phase, self._contact, self._foundation, start, start), at_once
                return self._detect(self._attempt(size, start))
            except StepRefused as refused:
                for body in self._bodies:
                    body.rewind()
                if halving == _MAX_HALVINGS:
                    residual = refused.residual if isinstance(refused, NotConverged) else None
                    raise RunStopped(str(refused), self.time, residual) from refused
                self.counts.halvings += 1
                size *= 0.5
        raise AssertionError("unreachable")

    def _attempt(self, size: float, start: tuple[Motion, Motion]) -> Step:
        """From the mark by ``size`` under the law of the phase."""
        contact = foundation = NO_FORCE
        upper, lower, spring = self._upper, self._lower, self._spring
        ends = None if self._held is None or not self.phase.seated else self._held
        if self._compliant:
            assert upper is not None
            assert lower is not None
            if self._exchange is not None:
                contact = self._exchange.solve(upper, ends or lower, self.time, size, start)
            else:
                penetration = start[1].displacement - start[0].displacement
                contact = self._compliance.solve(upper, ends or lower, self.time, size, self._contact, penetration)
        elif self.phase.joint is Joint.FREE:
            if upper is not None:
                upper.rewind()
                upper.advance(self.time, size, NO_FORCE)
            if lower is not None and ends is None:
                lower.rewind()
                lower.advance(self.time, size, NO_FORCE)
        else:
            assert upper is not None
            assert lower is not None
            contact = self._tie.solve(upper, ends or lower, self.time, size, self._contact, start[0])
        if self.phase.seated:
            foundation = contact
            if spring is not None:
                static = spring_force(self.scene.spring, self._stop)  # type: ignore[arg-type]
                foundation = (contact[0] + static, contact[1], contact[2])
                spring.rewind()
                spring.advance(self.time, size, contact, foundation)
        return Step(self.time, size, self.phase, contact, foundation, start, self._motions())

    # -- events -------------------------------------------------------------------------------------------------

    def _functions(self) -> list[tuple[str, Callable[[tuple[Motion, Motion]], Sample]]]:
        """Event functions of the phase: positive while nothing happens, falling through zero at the event."""
        tip, low = 0, 1
        functions: list[tuple[str, Callable[[tuple[Motion, Motion]], Sample]]] = []

        def between(a: int, b: int) -> Callable[[tuple[Motion, Motion]], Sample]:
            return lambda m: Sample(m[a].displacement - m[b].displacement, m[a].velocity - m[b].velocity)

        def above(a: int, level: float) -> Callable[[tuple[Motion, Motion]], Sample]:
            return lambda m: Sample(m[a].displacement - level, m[a].velocity)

        def below(a: int, level: float) -> Callable[[tuple[Motion, Motion]], Sample]:
            return lambda m: Sample(level - m[a].displacement, -m[a].velocity)

        joint, seated = self.phase.joint, self.phase.seated
        if self._joinable and not self._compliant:
            if joint is Joint.FREE:
                functions.append(("impact", between(tip, low)))
            psi = self.scene.spring.equilibrium  # type: ignore[union-attr]
            if joint is Joint.TIED and not seated:
                functions.append(("release", below(low, psi)))
            if joint is Joint.TOUCH:
                functions.append(("retie", above(low, psi)))
        if self._stop is not None and not seated:
            functions.append(("stop_impact", above(low if self._spring is not None else tip, self._stop)))
        return functions

    def _immediate_event(self, start: tuple[Motion, Motion]) -> str | None:
        rest = 1e-12 * max(abs(start[0].velocity), abs(start[1].velocity))
        for kind, function in self._functions():
            sample = function(start)
            if sample.value <= self._position_tolerance(start) and sample.rate < -rest:
                return kind
        return None

    def _detect(self, step: Step) -> tuple[Step, str | None]:
        """The first event inside the step, located; the bodies are left at the end of what is returned."""
        found: str | None = None
        functions = self._functions()
        for _ in range(2 * len(functions) + 1):
            candidates = []
            for kind, function in functions:
                if kind == found:
                    continue
                bracket = self._bracket(function, step)
                if bracket is not None:
                    candidates.append((cubic_crossing(function(step.start), function(bracket.end), bracket.size),
                                       kind, function, bracket))  # fmt: skip
            if not candidates:
                break
            _, found, function, bracket = min(candidates, key=lambda c: c[0])
            step = self._located(function, bracket)
            if step.size < _NO_TIME * self.H:
                # Too short for a contact force: velocities that differ would be turned round by an infinite one.
                return self._at_start(step), found
        else:
            found = found or None
        if self._compliant:
            step = self._touched_inside(step)
        unilateral = self._unilateral(step)
        return unilateral if unilateral is not None else (self._settled(step), found)

    def _bracket(self, function: Callable[[tuple[Motion, Motion]], Sample], step: Step) -> Step | None:
        """The step itself if ``function`` ends below zero, a shorter one if it dips below zero inside, or None."""
        tolerance = self._position_tolerance(step.end)
        start, end = function(step.start), function(step.end)
        if end.value < -tolerance:
            return step
        inside = lowest_inside(start, end, step.size)
        if inside is None or cubic_value(start, end, step.size, inside) >= -tolerance:
            return None
        dip = self._attempt(inside, step.start)
        return dip if function(dip.end).value < -tolerance else None

    def _located(self, function: Callable[[tuple[Motion, Motion]], Sample], bracket: Step) -> Step:
        last = bracket

        def evaluate(size: float) -> Sample:
            nonlocal last
            last = self._attempt(size, bracket.start)
            return function(last.end)

        tolerance = 0.25 * self._position_tolerance(bracket.end)
        locate(evaluate, function(bracket.start), function(bracket.end), bracket.size, tolerance, self.time)
        return last

    def _touched_inside(self, step: Step) -> Step:
        """Compliance: a contact that closes and opens inside the step would be missed; it is cut to its middle."""
        start, end = (Sample(m[0].displacement - m[1].displacement, m[0].velocity - m[1].velocity)
                      for m in (step.start, step.end))  # fmt: skip
        if start.value < 0.0 or end.value < 0.0:
            return step
        inside = lowest_inside(start, end, step.size)
        if inside is None or cubic_value(start, end, step.size, inside) >= 0.0:
            return step
        cut = self._attempt(inside, step.start)
        return cut if cut.contact[0] > 0.0 else step

    def _settled(self, step: Step) -> Step:
        """Leave the bodies at the end of ``step`` (a look inside it may have moved them)."""
        if self._motions() == step.end:
            return step
        return self._attempt(step.size, step.start)

    def _position_tolerance(self, motions: tuple[Motion, Motion]) -> float:
        length = max(abs(motions[0].displacement), abs(motions[1].displacement), abs(self._stop or 0.0))
        speed = max(abs(motions[0].velocity), abs(motions[1].velocity))
        return 8.0 * _EPS * length + 1e-15 * speed * self.H

    def _unilateral(self, step: Step) -> tuple[Step, str] | None:
        """The step cut where a force that can only push would pull, and the event there."""
        kind, pick = self._pushing()
        if kind is None:
            return None
        f = pick(step)
        if self._degree == 0:
            return self._unilateral_mean(step, kind, f[0])
        changes = [tau for tau in force.sign_changes(f, step.size) if f[1] + tau * f[2] < 0.0]
        if f[0] < 0.0:
            # The sign at the start may be a false alarm: it is one if the ends, let go, close.
            if not (self._reclosed and self._steps_in_phase == 0) and self._opens(kind, step):
                return self._at_start(step), kind
            step = self._settled(step)
        if not changes:
            return None
        # The polynomial tells where the force of the step vanishes; the step is repeated until it ends there.
        last, size = step, changes[0]
        for _ in range(_MAX_FORCE_CUTS):
            last = self._attempt(size, step.start)
            g = pick(last)
            value, slope = force.end_value(g, size), g[1] + size * g[2]
            change = -value / slope if slope < 0.0 else 0.0
            if not 0.0 < size + change < step.size or abs(change) <= 1e-12 * self.H:
                break
            size += change
        return last, kind

    def _opens(self, kind: str, step: Step) -> bool:
        """Do the ends part if they are let go for the step? ("unseated": does the lower end leave the foundation?)"""
        phase = self.phase
        unseats = kind == "unseated"
        self.phase = Phase(phase.joint) if unseats else Phase(Joint.FREE, phase.seated and self._spring is not None)
        try:
            tip, low = self._attempt(step.size, step.start).end
        finally:
            self.phase = phase
        if unseats:
            assert self._stop is not None
            return low.displacement > self._stop
        return tip.displacement > low.displacement

    def _at_start(self, step: Step) -> Step:
        """No step at all: the bodies back at the mark."""
        for body in self._bodies:
            body.rewind()
        return replace(step, size=0.0, end=step.start)

    def _unilateral_mean(self, step: Step, kind: str, c: float) -> tuple[Step, str] | None:
        """Degree 0: C belongs to the middle of its step and alternates; means of neighbours do not.

        The line through the last two means tells where the force vanishes, also if that is past this step's middle.
        """
        if not self._middles:
            if c < 0.0 and not self._reclosed and self._opens(kind, step):
                return self._at_start(step), kind
            self._settled(step)
            return None
        middle = self.time + 0.5 * step.size
        points = [(t, n if kind == "unseated" else f) for t, f, n in self._middles] + [(middle, c)]
        means = [(0.5 * (t0 + t1), 0.5 * (f0 + f1)) for (t0, f0), (t1, f1) in itertools.pairwise(points)]
        time, mean = means[-1]
        if mean <= 0.0:
            if len(means) < 2 and c >= 0.0:
                return None
            at = 0.0
            if len(means) == 2 and means[0][1] > 0.0:
                at = means[0][0] + (time - means[0][0]) * means[0][1] / (means[0][1] - mean) - self.time
        elif len(means) == 2 and means[0][1] > mean:
            at = time + (time - means[0][0]) * mean / (means[0][1] - mean) - self.time
            if at >= step.size:
                return None
        else:
            return None
        if at <= _NO_TIME * self.H:
            return self._at_start(step), kind
        return (self._settled(step) if at >= step.size else self._attempt(at, step.start)), kind

    def _pushing(self) -> tuple[str | None, Callable[[Step], Force]]:
        if self.phase.seated:
            return ("unseated" if self._spring is not None else "separation"), lambda s: s.foundation
        if self.phase.joint is Joint.TOUCH and not self._compliant:
            return "separation", lambda s: s.contact
        return None, lambda s: s.contact

    # -- what an event does -------------------------------------------------------------------------------------

    def _settle_start(self) -> None:
        """First contact at the start: the tip on the spring top (or the stop), moving down or at rest."""
        if self._upper is None or self._lower is None or self._compliant:
            return
        tip, low = self._motions()
        tolerance = self._position_tolerance((tip, low)) + 1e-12 * abs(low.displacement)
        if abs(tip.displacement - low.displacement) > tolerance or tip.velocity - low.velocity > 0.0:
            return
        for body in self._bodies:
            body.mark()
        start = self._motions()
        at_start = Step(self.time, 0.0, self.phase, NO_FORCE, NO_FORCE, start, start)
        # The bodies are recorded as they arrive: the ledger starts before the impact.
        self._ledger.book(*self._energies())
        self._act("impact" if self._joinable else "stop_impact", at_start)

    def _act(self, kind: str, step: Step) -> None:
        self.counts.events += 1
        tip, low = self._motions()
        impact = Impact()
        before = self.phase
        if kind in ("separation", "release"):
            self._last_opening = self.time
        if kind == "impact":
            self._reclosed = self.time - self._last_opening <= _AT_ONCE * self.H
            impact = self._meet(tip, low)
        elif kind == "stop_impact":
            impact, kind = self._strike(tip, low)
        elif kind == "release":
            pushing = self._end_force(step) > 0.0
            self.phase = Phase(Joint.TOUCH if pushing else Joint.FREE)
            if not pushing:
                impact = self._part(tip, low)
        elif kind == "retie":
            self.phase = Phase(Joint.TIED)
        elif kind == "separation":
            self.phase = Phase(Joint.FREE, seated=before.seated and self._spring is not None)
            impact = self._part(tip, low)
        elif kind == "unseated":
            self.phase = Phase(before.joint)
        self._apply(impact)
        if self.phase != before:
            self._steps_in_phase = 0
            self._middles.clear()
            if self.phase.joint is Joint.FREE:
                self._contact = NO_FORCE
            if not self.phase.seated:
                self._foundation = NO_FORCE
        tip, low = self._motions()
        beam, spring = self._beam is not None, self._spring is not None
        self.recorder.event(
            Event(
                self.time,
                kind,
                low.displacement if spring else None,
                low.velocity if spring else None,
                tip.displacement if beam else None,
                tip.velocity if beam else None,
                impact.on_beam,
                impact.of_foundation,
                impact.energy_loss,
            )
        )

    def _note_contact(self, step: Step) -> None:
        """Compliance: opening and closing are nothing special, they are told from the step that crossed."""
        gap = [m[0].displacement - m[1].displacement for m in (step.start, step.end)]
        touching = gap[1] < 0.0
        self.phase = Phase(Joint.TOUCH if touching else Joint.FREE, self.phase.seated)
        if (gap[0] < 0.0) == touching:
            return
        at = step.size * gap[0] / (gap[0] - gap[1])
        ends = [interpolated(step.start[i], step.end[i], step.size, at) for i in (1, 0)]
        self.counts.events += 1
        values = [x for end in ends for x in end]
        self.recorder.event(Event(step.time + at, "impact" if touching else "separation", *values))

    def _meet(self, tip: Motion, low: Motion) -> Impact:
        assert self._beam is not None
        assert self._spring is not None
        below = low.displacement < self.scene.spring.equilibrium  # type: ignore[union-attr]
        if self.phase.seated:
            # The seated spring does not move: the tip strikes the foundation through it.
            self.phase = Phase(Joint.TIED, seated=True)
            return foundation_impact(None, 0.0, tip.velocity, self._beam.mass, 0.0)
        impact = meeting(self.scene.contact.impact, tip.velocity, low.velocity, self._beam.mass, self._spring.mass)
        common = low.velocity + impact.on_spring / self._spring.mass
        self.phase = Phase(Joint.TIED if below or (common <= 0.0 and self._at_equilibrium(low)) else Joint.TOUCH)
        return impact

    def _at_equilibrium(self, low: Motion) -> bool:
        psi = self.scene.spring.equilibrium  # type: ignore[union-attr]
        tolerance = 4.0 * self._position_tolerance((low, low)) + 1e-12 * abs(psi)
        return bool(abs(low.displacement - psi) <= tolerance)

    def _strike(self, tip: Motion, low: Motion) -> tuple[Impact, str]:
        """The lower end reaches the foundation: it rebounds, or stays when the rebound has died out."""
        e = self.scene.stop.restitution  # type: ignore[union-attr]
        beam, spring = self._beam, self._spring
        tied = beam is not None and self.phase.joint is not Joint.FREE and not self._compliant
        if spring is None:
            assert beam is not None
            ends: tuple[float | None, float, float | None, float] = (None, 0.0, tip.velocity, beam.mass)
        else:
            ends = (low.velocity, spring.mass, tip.velocity if tied else None, beam.mass if tied and beam else 0.0)
        speed = max(abs(v) for v in (ends[0], ends[2]) if v is not None)
        self._fastest_impact = max(self._fastest_impact, speed)
        if (e * speed <= _SEATING_SPEED * self._fastest_impact and e < 1.0) or speed == 0.0:
            joint = self.phase.joint if spring is not None else Joint.TIED
            self.phase = Phase(joint, seated=True)
            return foundation_impact(*ends, 0.0), "seated"
        return foundation_impact(*ends, e), "stop_impact"

    def _part(self, tip: Motion, low: Motion) -> Impact:
        """A tie that opens while its ends still close (the energy scheme lets velocities differ): they meet first."""
        closing = tip.velocity - low.velocity
        if self._spring is None or self._beam is None or closing >= 0.0 or self.phase.seated:
            return Impact()
        return meeting("inelastic", tip.velocity, low.velocity, self._beam.mass, self._spring.mass)

    def _apply(self, impact: Impact) -> None:
        if self._beam is not None and impact.on_beam != 0.0:
            self._beam.apply_impulse(impact.on_beam)
        if self._spring is not None and impact.on_spring != 0.0:
            self._spring.apply_impulse(impact.on_spring)
        self._ledger.impact_loss += impact.energy_loss

    def _end_force(self, step: Step) -> float:
        """C at the end of the step as well as the degree tells [N]."""
        if self._degree > 0:
            return force.end_value(step.contact, step.size)
        return self._smoothed

    # -- bookkeeping --------------------------------------------------------------------------------------------

    def _motions(self) -> tuple[Motion, Motion]:
        """(tip, lower end); the one that is missing is at rest at 0."""
        rest = Motion(0.0, 0.0, 0.0, 0.0)
        return (
            rest if self._upper is None else self._upper.motion(),
            rest if self._lower is None else self._lower.motion(),
        )

    def _energies(self) -> tuple[Energies, Energies, float]:
        nothing = Energies(0.0, 0.0, 0.0, 0.0)
        contact = 0.0
        if self._compliant and self._joinable:
            tip, low = self._motions()
            law = self.scene.contact
            contact = compliance_energy(low.displacement - tip.displacement, law.stiffness, law.exponent)
        return (
            nothing if self._beam is None else self._beam.energies(),
            nothing if self._spring is None else self._spring.energies(),
            contact,
        )

    def _accept(self, step: Step, time: float) -> None:
        self._middles = [*self._middles[-1:], (self.time + 0.5 * step.size, step.contact[0], step.foundation[0])]
        self.time = time
        self.counts.macro_steps += 1
        first = self._steps_in_phase == 0
        # At the macro point between two steps both forces are wrong by nearly the same, one up, one down.
        self._smoothed = step.contact[0] if first else 0.5 * (step.contact[0] + self._contact[0])
        self._contact = force.shifted(step.contact, step.size)
        self._foundation = force.shifted(step.foundation, step.size)
        self._steps_in_phase += 1

    def _record(self) -> None:
        tip, low = self._motions()
        row: dict[str, Any] = {"time": self.time, "phase": str(self.phase)}
        law = self.scene.contact
        row.update(u_tip=tip.displacement, v_tip=tip.velocity, y=low.displacement, z=low.velocity)
        row["gap"] = tip.displacement - low.displacement
        contact = self._contact[0]
        if self._compliant:
            contact = compliance_force(-row["gap"], law.stiffness, law.exponent)
        joined = self.phase.joint is not Joint.FREE
        row["contact_force"] = contact
        row["contact_force_smoothed"] = self._smoothed if joined and not self._compliant else contact
        if self._joinable:
            psi = self.scene.spring.equilibrium  # type: ignore[union-attr]
            inside = 0.0 if self._compliant else compliance_force(psi - tip.displacement, law.stiffness, law.exponent)
            row["compliance_force"] = contact if self._compliant else inside
            row["tie_reaction"] = contact - row["compliance_force"]
            row["velocity_mismatch"] = tip.velocity - low.velocity if joined else 0.0
            if joined and not self._compliant:
                self._largest_mismatch = max(self._largest_mismatch, abs(row["velocity_mismatch"]))
        row["foundation_force"] = self._foundation[0]
        self._largest_speed = max(self._largest_speed, abs(tip.velocity), abs(low.velocity))
        row.update(self._ledger.book(*self._energies()))
        try:
            self.recorder.row(row)
        except NonFiniteValue as error:
            raise RunStopped(str(error), self.time) from error
        self._record_shape(joined)
        if self._lossy and self._ledger.relative > _ENERGY_STOPS:
            raise RunStopped(self._energy_cause(), self.time)

    def _energy_cause(self) -> str:
        coupling, percent = self.scene.coupling, 100.0 * self._ledger.relative
        return (
            f"{coupling.scheme} of degree {coupling.degree} has changed the energy by {percent:.2g} %: the "
            f"macro step {self.H:g} s is too large for it; take a smaller one, or coupling.scheme = 'energy'"
        )

    def _record_shape(self, joined: bool) -> None:
        if self._beam is None:
            return
        early = joined and self._shapes_left > 0
        if not early and self.time < self._next_shape:
            return
        self._shapes_left -= early
        span = self.scene.time.t_end / _SHAPES_OVER_RUN
        while self._next_shape <= self.time:
            self._next_shape += span
        self.recorder.shape(self.time, self._beam.shape())

    def summary(self) -> dict[str, Any]:
        """Counts, residuals and warnings, as they go into ``summary.json``."""
        warnings = []
        if self._lossy and self._ledger.relative > _ENERGY_WARNS:
            warnings.append(self._energy_cause())
        if self._largest_mismatch > _UNRESOLVED * self._largest_speed:
            warnings.append(
                f"not resolved: the joined ends' velocities differ by up to {self._largest_mismatch:.3g} m/s of "
                f"{self._largest_speed:.3g} m/s; velocities and forces alternate from step to step. A smaller "
                f"coupling.macro_step (now {self.H:g} s) or fewer beam.n_modes resolves the motion"
            )
        return {
            "time": self.time,
            "macro_steps": self.counts.macro_steps,
            "events": self.counts.events,
            "halved_steps": self.counts.halvings,
            "iterations": self._tie.iterations + self._compliance.iterations,
            "max_energy_residual": self._ledger.relative,
            "max_energy_residual_joule": self._ledger.largest_residual,
            "max_velocity_mismatch": self._largest_mismatch,
            "warnings": warnings,
        }
