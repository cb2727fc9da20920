"""The loop of a run: macro steps from event to event, each of which leaves one record.

One step is *mark* (the bodies remember their state), *attempt* (advance under the phase's law; may be repeated with
any size, each time from the mark; `springbeam.run.stepping`), *detect* (which event comes first inside the step?
`springbeam.run.detection`) and *accept*. An event shortens the step to itself, acts (`springbeam.contact.phases`), and
the run continues from there. The records are checked a thousand at a time, or each second.
"""

from __future__ import annotations

from math import inf
from time import monotonic

import numpy as np

from ..bodies.protocol import NO_FORCE, Body, BodyFailed, Ends, StepRefused
from ..contact.impacts import NO_IMPACT, Impact
from ..contact.phases import Instant, Phase, joins
from ..coupling.protocol import NotConverged, Step
from ..motion.events import Event, EventKind, Joint
from ..results.columns import ledger
from ..results.recording import Recorder
from ..results.records import BEAM_REPORTS, SPRING_REPORTS, STEP, packed
from .detection import Detector
from .ledger import Balance
from .log import TOGETHER, Log
from .macro_steps import AdaptiveSteps, MacroGrid
from .outcome import RunStopped, cause_of
from .setup import SAME, Setup
from .stepping import Pair, Present, State

#: A step that is refused is halved this often before the run stops.
_MAX_HALVINGS = 20
_NO_INNER_FORCES = (0.0, 0.0, 0.0, 0.0)
#: Steps after first contact whose beam shape is kept.
_SHAPES_AFTER_CONTACT = 20
#: Shapes kept evenly over the run.
_SHAPES_OVER_RUN = 400


class Master:
    """One run with given bodies, a step at a time.

    Parameters
    ----------
    setup
        What is run.
    upper, lower
        The bodies at the start time; ``None`` where there is none. An upper one without a shape leaves none.
    recorder
        Receives records, events and shapes.
    contact_force
        Force between the ends at the start [N], where the run starts at rest.

    Raises SceneError if a body does not take a load.
    """

    state: State

    def __init__(
        self,
        setup: Setup,
        upper: Body | None,
        lower: Body | None,
        recorder: Recorder,
        contact_force: float = 0.0,
    ) -> None:
        self._setup = setup
        self.pair = Pair(setup, upper, lower)
        self.state = self.pair.initial_state(setup.start, contact_force)
        self.controller: MacroGrid | AdaptiveSteps
        self._adaptive = None
        if setup.macro_step is None:
            self.controller = self._adaptive = AdaptiveSteps(setup, self.pair)
        else:
            self.controller = MacroGrid(setup.start, setup.end, setup.macro_step)
        self._detector = Detector(self.pair, self.controller)
        self.balance = Balance(self.pair)
        self._log = Log(recorder, self.balance.check)
        self._reports = BEAM_REPORTS * self.pair.upper.reports + SPRING_REPORTS * self.pair.lower.reports
        self.state.shapes_left = _SHAPES_AFTER_CONTACT
        self.state.next_shape = setup.start
        length = setup.end - setup.start or 1.0  # 0 where contact is at t_end: the one shape is that of the start
        self._shape_every = length / _SHAPES_OVER_RUN

    @property
    def done(self) -> bool:
        """Whether the run has reached t_end."""
        return self.state.begun and self.state.time >= self._setup.end

    def step(self) -> None:
        """Make the next step, up to an event if there is one. The first call begins the run.

        Raises RunStopped; what was computed up to its time is with the recorder.
        """
        try:
            if not self.state.begun:
                self._begin()
            if not self.done:
                self._step()
            if len(self._log.records) >= TOGETHER or monotonic() >= self._log.due or self.done:
                self.flush()
        except (BodyFailed, OverflowError, RunStopped) as failed:
            cause = cause_of(failed)
            self.flush()  # where an earlier step was wrong, that is why it stops
            if isinstance(failed, RunStopped):
                raise
            raise RunStopped(cause, self.state.time) from failed

    def flush(self) -> None:
        """Give the recorder the records that it does not have yet; see `Log.flush`."""
        self._log.flush()

    def _step(self) -> None:
        state = self.state
        controller = self.controller
        pair = self.pair
        kink = pair.loads.next_kink(state.time + SAME * controller.size, controller.size) if pair.loads.any else inf
        target, size = controller.next(state.time, kink, after_impact=state.collided == state.time)
        step, event = self._advance(size, to_kink=target == kink)
        whole = event is None and abs(step.size - size) <= SAME * controller.size
        end = target if whole else state.time + step.size
        if event is not None:
            state.count_event(end, controller.size)
        if step.size > 0.0:
            if self._adaptive is not None:
                self._adaptive.accept(step)
            pair.joined.accept(step)
            state.accept(step, end)
            state.macro_steps += 1
            if pair.opens_softly:
                self._note_soft_contact(step)
        before = pair.present(state.phase, step, controller.size) if step.size > 0.0 else state.present
        mass = pair.tied_mass(state.phase) if step.size > 0.0 else 0.0
        if event is not None:
            self._act(event, step, before.contact)
        self._record(step, pair.ends(), before, mass, changed=event is not None or (whole and target == kink))

    def _advance(self, size: float, *, to_kink: bool) -> tuple[Step, EventKind | None]:
        """The next step and the event it ends on, the bodies left at its end."""
        state = self.state
        pair = self.pair
        pair.mark()
        start = state.ends
        halvings = 0
        cause = ""
        while True:
            try:
                at_start = self._detector.at_start(state, start)
                if at_start is not None:
                    return Step(state.time, 0.0, state.contact, state.foundation, start, start), at_start
                step = pair.attempt(state, size, start)
                if self._adaptive is None or self._adaptive.holds(state, step, cause, to_kink=to_kink):
                    return self._detector.first_event(state, step)
                pair.rewind()
                size = self.controller.size
            except (StepRefused, OverflowError) as refused:
                cause = cause_of(refused)
                if pair.repeatable:
                    pair.rewind()
                nothing = state.time + 0.5 * size == state.time  # a step that rounding of the time swallows
                if halvings == _MAX_HALVINGS or nothing or not pair.divides:
                    residual = refused.residual if isinstance(refused, NotConverged) else None
                    raise RunStopped(cause, state.time, residual) from refused
                halvings += 1
                state.halvings += 1
                size *= 0.5

    # -- events -----------------------------------------------------------------------------------------------------

    def _begin(self) -> None:
        """Record the start, after an event that is due there."""
        state = self.state
        pair = self.pair
        start = pair.ends()
        if pair.loads.any or state.contact[0] != 0.0:
            pair.loads.act(state.time, SAME * self.controller.size)  # as at an instant
            pair.upper.start_under(state.contact[0])
        step = Step(state.time, 0.0, NO_FORCE, NO_FORCE, start, start)
        # The ledger starts with the bodies as they arrive, before an impact.
        arriving = np.frombuffer(self._packed(step, start, state.present), STEP)
        state.energy_at_start = float(ledger(arriving)["e_total"][0])
        if self._adaptive is not None:
            self._adaptive.note(abs(state.energy_at_start))
        if pair.opens_softly and start[1].displacement - start[0].displacement > self._detector.tolerance(start):
            state.phase = Phase(Joint.TOUCH, state.phase.seated)
            self._happened(EventKind.IMPACT, NO_IMPACT, 0.0)
        if self._in_contact(start) or (pair.law is None and state.contact[0] != 0.0):
            pair.mark()
            self._act(EventKind.STOP_IMPACT if self._setup.law is None else EventKind.IMPACT, step, state.contact[0])
        self._record(step, pair.ends(), state.present, changed=True)
        state.begun = True

    def _in_contact(self, start: Ends) -> bool:
        """Is the tip on the spring top (or the stop), moving down or at rest?"""
        pair = self.pair
        if not joins(pair.interface) and (not pair.alone or self._setup.floor is None):
            return False
        tip, low = start
        tolerance = self._detector.tolerance(start) + 1e-12 * abs(low.displacement)
        parting = tip.velocity - low.velocity > 0.0 and not self._setup.lasting
        return abs(tip.displacement - low.displacement) <= tolerance and not parting

    def _act(self, kind: EventKind, step: Step, contact_force: float) -> None:
        """The event at the end of ``step`` happens, where the contact force is ``contact_force`` [N]."""
        state = self.state
        pair = self.pair
        ends = pair.ends()
        at = Instant(
            state.phase,
            ends,
            step.start,
            step.size,
            contact_force,
            self._detector.tolerance(ends),
            self._detector.simultaneity_tolerance(ends),
            state.fastest,
        )
        kind, phase, impact = pair.automaton.after(kind, at)
        # Another event at the time of an impact settles what that has begun.
        state.collided = state.time if kind.collision and pair.divides else -inf
        if kind.collision and state.parted == state.time:
            state.met_again = state.time
        state.parted = state.time if kind.opens else -inf
        pair.apply_impulses(impact.on_beam, impact.on_spring)
        lost = impact.energy_loss + pair.follow_phase(phase)
        state.lost += lost
        state.enter(phase)
        self._happened(kind, NO_IMPACT if kind.opens else impact, lost)  # nothing strikes where ends part

    def _happened(self, kind: EventKind, impact: Impact, lost: float) -> None:
        tip, low = self.pair.ends_together(self.state.phase)
        y, z = low[:2] if self._setup.lower else (None, None)
        u, v = tip[:2] if self._setup.upper else (None, None)
        state = self.state
        state.events += 1
        impulses = (impact.on_beam, impact.of_foundation)
        happened = Event(state.time, kind, y, z, u, v, *impulses, lost, state.phase.joint, state.phase.seated)
        self._log.events.append(happened)

    def _note_soft_contact(self, step: Step) -> None:
        state = self.state
        for change in self._detector.soft_changes(state, step):
            state.phase = Phase(change.joint, change.seated)
            state.events += 1
            self._log.events.append(change)

    # -- what is left of a step ---------------------------------------------------------------------------------------

    def _record(self, step: Step, ends: Ends, before: Present, mass: float = 0.0, *, changed: bool) -> None:
        """Leave the record of ``step``, and now and then the beam's shape.

        ``ends`` are those after its event; ``before``, the forces, and ``mass``, `Pair.tied_mass`, before it;
        ``changed`` says whether other forces act next.
        """
        state = self.state
        tip, low = step.end  # no event makes an end faster than both were
        state.ends = ends
        state.present = before
        if changed:
            state.present = self.pair.present(state.phase, step, self.controller.size, changed=True)
        speed = max(tip[1], -tip[1], low[1], -low[1])
        if speed > state.fastest:
            state.fastest = speed
        self._log.records.append(self._packed(step, ends, before, mass))
        early = state.shapes_left > 0 and state.phase.joined
        if early or state.time >= state.next_shape:
            self._shape(early)

    def _packed(self, step: Step, ends: Ends, forces: Present, mass: float = 0.0) -> bytes:
        state = self.state
        pair = self.pair
        _, size, contact, foundation, _, before = step
        if size == 0.0:
            contact = state.contact
            foundation = state.foundation
        tip, low = ends
        of_upper = pair.upper.energies()
        of_lower = pair.lower.energies()
        in_law = pair.joined.energies(ends)
        if self._adaptive is not None:
            energies = abs(of_upper.kinetic + of_upper.potential) + abs(of_lower.kinetic + of_lower.potential)
            self._adaptive.note(energies + in_law.stored)
        return packed(
            time=(state.time, size),
            tip=before[0],
            low=before[1],
            contact=contact,
            foundation=foundation,
            forces=forces,
            tip_after=tip[:2],
            low_after=low[:2],
            forces_after=state.present,
            phase=(state.phase.number, state.events),
            upper_energies=of_upper,
            lower_energies=of_lower,
            law_energies=in_law,
            lost=(state.lost,),
            received=(pair.upper.received or 0.0, pair.lower.received or 0.0),
            energy_at_start=(state.energy_at_start,),
            inner_forces=pair.upper.inner_forces() if self._reports & BEAM_REPORTS else _NO_INNER_FORCES,
            reports=(self._reports,),
            joined=(pair.joined.degree, pair.interface.tip_share, mass),
        )

    def _shape(self, early: bool) -> None:
        state = self.state
        every = self._shape_every
        time = state.time
        state.shapes_left -= early
        if time >= state.next_shape:
            state.next_shape += every * ((time - state.next_shape) // every + 1.0)
        shape = self.pair.upper.shape()
        if shape is None:
            return
        if not np.isfinite(shape).all():
            raise RunStopped("the beam's shape is not finite", time)
        self._log.shapes.append(np.array([time, *shape]))
