"""One attempted step: both bodies from their marks, by any size, under the law of the phase."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from ..bodies import force
from ..bodies.memory import Memory
from ..bodies.protocol import NO_FORCE, BeamBody, Body, Energies, Force, Held, Motion
from ..bodies.quasi_static import QuasiStaticBeam
from ..contact.phases import Joint, Phase, spring_force
from ..coupling import conditions
from ..coupling.compliance import Compliance, compliance_energy
from ..coupling.exchange import Exchange
from ..coupling.one_way import OneWay
from ..coupling.tie import Tie
from ..scene import Scene
from ..scene.statics import tip_reach
from ..scene.tables import ORDINARY_SCHEMES

#: The force of a step is continued over at most this many times its size; beyond, its end value is held.
_REACH_OF_FORCE = 4.0

#: The interface ends (tip, lower end): the spring top, or without a spring the foundation.
Ends = tuple[Motion, Motion]

_AT_REST = Motion(0.0, 0.0, 0.0, 0.0)
_NOTHING = Energies(0.0, 0.0, 0.0, 0.0)


def _at_rest() -> Motion:
    return _AT_REST


class Step(NamedTuple):
    """An attempted step and what the bodies' ends did on it."""

    time: float
    size: float
    contact: Force  #: C on the step
    foundation: Force  #: N on the step
    start: Ends  #: at the mark
    end: Ends


@dataclass
class State(Memory):
    """Where the run is, and what of the last steps the next one needs."""

    time: float
    phase: Phase = field(default_factory=Phase)
    contact: Force = NO_FORCE  #: C of the last step, continued
    last_size: float = 0.0  #: of the last step [s]
    foundation: Force = NO_FORCE  #: N of the last step, continued
    smoothed: float = 0.0  #: mean of C's two limits at the start of the last step [N]
    steps_in_phase: int = 0
    #: (middle, C, N) of the last two steps of this phase.
    middles: list[tuple[float, float, float]] = field(default_factory=list)
    reclosed: bool = False  #: the contact had opened and closed at once: its next step does not open it again

    def accept(self, step: Step, time: float) -> None:
        """The step that ends at ``time`` is made."""
        self.middles = [*self.middles[-1:], (self.time + 0.5 * step.size, step.contact[0], step.foundation[0])]
        self.time, self.last_size = time, step.size
        first = self.steps_in_phase == 0
        # At the macro point between two steps both forces are wrong by nearly the same, one up, one down.
        self.smoothed = step.contact[0] if first else 0.5 * (step.contact[0] + self.contact[0])
        self.contact = force.shifted(step.contact, step.size)
        self.foundation = force.shifted(step.foundation, step.size)
        self.steps_in_phase += 1

    def guess(self, size: float) -> Force:
        """C over a step of ``size`` [s], as far as the last step tells."""
        return self.contact if size <= _REACH_OF_FORCE * self.last_size else (self.contact[0], 0.0, 0.0)

    def enter(self, phase: Phase) -> None:
        """Another phase begins: what was known of the forces holds no longer."""
        if phase == self.phase:
            return
        self.phase = phase
        self.steps_in_phase = 0
        self.middles.clear()
        if phase.joint is Joint.FREE:
            self.contact = NO_FORCE
        if not phase.seated:
            self.foundation = NO_FORCE


class Pair(Memory):
    """Beam and spring of a scene, one of them possibly missing, and the law between them.

    Parameters
    ----------
    scene
        Whose contact law and coupling scheme hold.
    beam, spring
        The bodies; ``None`` where the scene has none.
    """

    REMEMBERED = ("beam", "spring", "_held", "_tie", "_compliance", "one_way")

    def __init__(self, scene: Scene, beam: BeamBody | None, spring: Body | None) -> None:
        self._scene = scene
        self.beam, self.spring = beam, spring
        self.stop = None if scene.stop is None else scene.stop.position
        self._held = None if self.stop is None else Held(self.stop)
        self.lower: Body | None = self._held if spring is None else spring
        self._bodies: list[Body] = [body for body in (beam, self.lower) if body is not None]
        #: Where the ends are.
        self._tip, self._low = (_at_rest if body is None else body.motion for body in (beam, self.lower))
        self._last: Step | None = None  #: at whose end the bodies are
        self.joinable = beam is not None and spring is not None
        self.compliant = scene.contact.law == "compliance" and self.joinable
        coupling, law = scene.coupling, (scene.contact.stiffness, scene.contact.exponent)
        self._exchange: Exchange | None = None
        if coupling.scheme in ORDINARY_SCHEMES:
            self._exchange = Exchange(coupling.scheme == "gauss_seidel", coupling.degree, *law)
        scheme = "energy" if self._exchange is not None else coupling.scheme
        expected = 0.0 if scene.beam is None else tip_reach(scene.beam)
        self._tie = Tie(conditions(scheme, coupling.degree), coupling.degree, coupling.tolerance, expected)
        self._compliance = Compliance(*law, coupling.tolerance)
        self.one_way: OneWay | None = None
        if coupling.feedback != "two_way":
            stiffness = scene.driver_stiffness
            assert stiffness is not None
            self.one_way = OneWay(self._compliance, *law, coupling.feedback == "beam_drives", stiffness)
        #: A tip without inertia: C follows from where it is held.
        self.massless = isinstance(beam, QuasiStaticBeam)
        #: Of the contact force over a step.
        self.degree = 0 if self.compliant else coupling.degree
        #: Whether the coupling may create energy, so that its residual is watched.
        self.lossy = scheme == "hermite" or self._exchange is not None

    @property
    def iterations(self) -> int:
        return self._tie.iterations + self._compliance.iterations

    def mark(self) -> None:
        """Remember the bodies' states as those that steps start from."""
        for body in self._bodies:
            body.mark()

    def rewind(self) -> None:
        self._last = None
        for body in self._bodies:
            body.rewind()

    def attempt(self, state: State, size: float, start: Ends, phase: Phase | None = None) -> Step:
        """From the mark by ``size`` [s] under the law of the phase (``phase`` instead of the state's own).

        Raises StepRefused.
        """
        phase = state.phase if phase is None else phase
        contact = foundation = NO_FORCE
        upper, lower, spring = self.beam, self.lower, self.spring
        partner = self._held if phase.seated else lower
        if self.compliant:
            assert upper is not None
            assert partner is not None
            if self._exchange is not None:
                contact = self._exchange.solve(upper, partner, state.time, size, start)
            else:
                solver = self._compliance if self.one_way is None else self.one_way
                penetration = start[1].displacement - start[0].displacement
                contact = solver.solve(upper, partner, state.time, size, state.contact, penetration)
        elif phase.joint is Joint.FREE:
            if upper is not None:
                upper.rewind()
                upper.advance(state.time, size, NO_FORCE)
            if lower is not None and not phase.seated:
                lower.rewind()
                lower.advance(state.time, size, NO_FORCE)
        else:
            assert upper is not None
            assert partner is not None
            contact = self._tie.solve(upper, partner, state.time, size, state.guess(size), start[0])
        if phase.seated:
            foundation = contact
            if spring is not None:
                static = spring_force(self._scene.spring, self.stop)  # type: ignore[arg-type]
                foundation = (contact[0] + static, contact[1], contact[2])
                spring.rewind()
                # C and the part of N that bears it cancel: together, rounding of a large C would move a light top.
                spring.advance(state.time, size, NO_FORCE, (static, 0.0, 0.0))
        self._last = step = Step(state.time, size, contact, foundation, start, (self._tip(), self._low()))
        return step

    def accept(self, step: Step) -> None:
        """``step`` is made; of a one-way coupling, what it neglects counts from now on."""
        if self.one_way is not None:
            driver = 0 if self.one_way.beam_drives else 1
            moved = step.end[driver].displacement - step.start[driver].displacement
            self.one_way.accept(step.contact[0], moved, step.end[1].displacement - step.end[0].displacement)

    def settled(self, state: State, step: Step) -> Step:
        """Leave the bodies at the end of ``step`` (a look inside it may have moved them)."""
        return step if step is self._last else self.attempt(state, step.size, step.start)

    def apply_impulses(self, on_beam: float, on_spring: float) -> None:
        """Upward impulses [N·s]."""
        if self.beam is not None and on_beam != 0.0:
            self.beam.apply_impulse(on_beam)
        if self.spring is not None and on_spring != 0.0:
            self.spring.apply_impulse(on_spring)

    def massless_tip(self, phase: Phase) -> float:
        """A massless tip takes the velocity of what ``phase`` joins it to, or springs back; the energy it loses [J]."""
        if not isinstance(self.beam, QuasiStaticBeam):
            return 0.0
        if phase.joint is Joint.FREE:
            return self.beam.release()
        assert self.lower is not None
        self.beam.join(self.lower.motion().velocity)
        return 0.0

    def ends(self) -> Ends:
        """(tip, lower end); the one that is missing is at rest at 0."""
        return self._tip(), self._low()

    def energies(self) -> tuple[Energies, Energies, float]:
        """Of the beam, of the spring, and of the contact law [J].

        The work on an end that drives without feeling it counts as a load's on that body.
        """
        contact = 0.0
        beam = _NOTHING if self.beam is None else self.beam.energies()
        spring = _NOTHING if self.spring is None else self.spring.energies()
        if self.compliant:
            tip, low = self.ends()
            law = self._scene.contact
            contact = compliance_energy(low.displacement - tip.displacement, law.stiffness, law.exponent)
        if self.one_way is not None:
            beam = beam._replace(load_potential=beam.load_potential + self.one_way.work)
        return beam, spring, contact

    def end_force(self, state: State, step: Step) -> float:
        """C at the end of the step as well as the degree tells; exactly, where the tip has no mass [N]."""
        if isinstance(self.beam, QuasiStaticBeam):
            return self.beam.holding_force(*self.ends()[1][:2])
        return force.end_value(step.contact, step.size) if self.degree > 0 else state.smoothed
