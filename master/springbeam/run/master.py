"""The loop of a run: macro steps from event to event, each of which leaves one record.

One step is *mark* (the bodies remember their state), *attempt* (advance under the phase's law; may be repeated with
any size, each time from the mark; `springbeam.run.stepping`), *detect* (which event comes first inside the step?
`springbeam.run.detection`) and *accept*. An event shortens the step to itself, acts (`springbeam.contact.phases`), and
the run goes on from there. The records are checked a thousand at a time, or each second.
"""

from __future__ import annotations

from math import inf
from time import monotonic
from typing import Any

import numpy as np

from ..bodies.gate import admit, with_degree
from ..bodies.protocol import NO_FORCE, BeamBody, Body, BodyFailed, Ends, StepRefused
from ..contact.phases import Impact, Joint, Phase, Transitions
from ..coupling.protocol import NotConverged, Step
from ..results.columns import ledger
from ..results.contradictions import contradictions
from ..results.recording import Recorder
from ..results.steps import BEAM_TELLS, SPRING_TELLS, STEP, packed
from ..results.totals import totals
from ..results.trajectory import Event, EventKind
from ..scene import SAME, Scene
from ..scene.resolution import peak_force_doubt
from .detection import Detector
from .ledger import Balance
from .log import TOGETHER, Log
from .macro_steps import AdaptiveSteps, MacroGrid
from .misplaced import misplaced
from .observed import coarse_force, force_window, not_shown, unknown, why_not_resolved
from .outcome import RunStopped, cause_of
from .stepping import Pair, Present, State

#: A step that is refused is halved this often before the run stops.
_MAX_HALVINGS = 20
_SHORTER = "take a shorter macro step that is not a whole period of a body"
_NOTHING_FELT = (0.0, 0.0, 0.0, 0.0)
#: Steps after first contact whose beam shape is kept, and shapes kept evenly over the run.
_SHAPES_AFTER_CONTACT, _SHAPES_OVER_RUN = 20, 400


class Master:
    """One run of a scene with given bodies, a step at a time.

    Parameters
    ----------
    scene
        What is simulated.
    start_time
        Where the run starts [s], `springbeam.scene.Scene.contact_time` or 0.
    beam, spring
        The bodies at the start time; ``None`` where the scene has none. A beam that is no `BeamBody` leaves no shapes.
    recorder
        Receives records, events and shapes.
    contact
        Force between the ends at the start [N], where the scene starts at rest.

    Raises SceneError if the scene cannot be run with these bodies.
    """

    state: State

    def __init__(
        self,
        scene: Scene,
        start_time: float,
        beam: Body | None,
        spring: Body | None,
        recorder: Recorder,
        contact: float = 0.0,
    ) -> None:
        scene = with_degree(scene, beam, spring)
        self._scene, self._recorder = scene, recorder
        admit(scene, start_time, beam, spring)
        self._pair = Pair(scene, beam, spring)
        self.state = self._pair.initial_state(start_time, contact)
        end, self._adaptive = scene.time.t_end, None
        if scene.coupling.adaptive:
            self._adaptive = AdaptiveSteps(scene, self._pair, start_time, end)
        self._steps = self._adaptive or MacroGrid(start_time, end, scene.coupling.H)
        self._detector = Detector(scene, self._pair, self._steps)
        self._transitions = Transitions(
            scene,
            self._pair.law,
            self._pair.upper.mass,
            self._pair.lower.mass,
            lambda: self.state.fastest,
            self._pair.equilibrium,
        )
        self._balance = Balance(scene, self._pair)
        self._log = Log(scene, recorder, self._balance.check)
        self._told = BEAM_TELLS * self._pair.upper.tells + SPRING_TELLS * self._pair.lower.tells
        self._pictured = beam if isinstance(beam, BeamBody) else None
        self.state.shapes_left, self.state.next_shape = _SHAPES_AFTER_CONTACT, start_time
        length = scene.time.t_end - start_time or 1.0  # 0 where contact is at t_end: the one shape is that of the start
        self._shape_every = length / _SHAPES_OVER_RUN

    @property
    def done(self) -> bool:
        """Whether the run has reached t_end."""
        return self.state.begun and self.state.time >= self._scene.time.t_end

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
                self.hand_over()
        except (BodyFailed, OverflowError, RunStopped) as failed:
            cause = cause_of(failed)
            self.hand_over()  # where an earlier step was wrong, that is why it stops
            if isinstance(failed, RunStopped):
                raise
            raise RunStopped(cause, self.state.time) from failed

    def hand_over(self) -> None:
        """Give the recorder the records that it does not have yet; see `Log.hand_over`."""
        self._log.hand_over()

    def _step(self) -> None:
        state, steps, pair = self.state, self._steps, self._pair
        kink = pair.loads.next_kink(state.time + SAME * steps.size, steps.size) if pair.loads.any else inf
        target, size = steps.next(state.time, kink, struck=state.struck == state.time)
        step, event = self._advance(size, to_kink=target == kink)
        whole = event is None and abs(step.size - size) <= SAME * steps.size
        end = target if whole else state.time + step.size
        if event is not None:
            state.count_event(end, steps.size)
        if step.size > 0.0:
            if self._adaptive is not None:
                self._adaptive.accept(step)
            pair.joined.accept(step)
            state.accept(step, end)
            state.macro_steps += 1
            if pair.opens_softly:
                self._note_soft_contact(step)
        before = pair.present(state.phase, step, steps.size) if step.size > 0.0 else state.present
        if event is not None:
            self._act(event, step, before.contact)
        self._record(step, pair.ends(), before, changed=event is not None or (whole and target == kink))

    def _advance(self, size: float, *, to_kink: bool) -> tuple[Step, EventKind | None]:
        """The next step and the event it ends on, the bodies left at its end."""
        state, pair = self.state, self._pair
        pair.mark()
        start = state.ends
        halvings, cause = 0, ""
        while True:
            try:
                at_start = self._detector.at_start(state, start)
                if at_start is not None:
                    return Step(state.time, 0.0, state.contact, state.foundation, start, start), at_start
                step = pair.attempt(state, size, start)
                if self._adaptive is None or self._adaptive.holds(state, step, cause, to_kink=to_kink):
                    return self._detector.first_event(state, step)
                pair.rewind()
                size = self._steps.size
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
        state, pair = self.state, self._pair
        start = pair.ends()
        step = Step(state.time, 0.0, NO_FORCE, NO_FORCE, start, start)
        # The ledger starts with the bodies as they arrive, before an impact.
        arriving = np.frombuffer(self._packed(step, start, state.present), STEP)
        state.energy_at_start = float(ledger(self._scene, arriving)["e_total"][0])
        if self._adaptive is not None:
            self._adaptive.note(abs(state.energy_at_start))
        if pair.opens_softly and start[1].displacement - start[0].displacement > self._detector.tolerance(start):
            state.phase = Phase(Joint.TOUCH)
            self._happened(EventKind.IMPACT, Impact(), 0.0)
        if self._in_contact(start) or (pair.law is None and state.contact[0] != 0.0):
            pair.mark()
            self._act(EventKind.IMPACT if self._scene.coupled else EventKind.STOP_IMPACT, step, state.contact[0])
        self._record(step, pair.ends(), state.present, changed=True)
        state.begun = True

    def _in_contact(self, start: Ends) -> bool:
        """Is the tip on the spring top (or the stop), moving down or at rest?"""
        pair = self._pair
        if self._scene.upper is None or pair.law is not None or (pair.alone and pair.stop is None):
            return False
        tip, low = start
        tolerance = self._detector.tolerance(start) + 1e-12 * abs(low.displacement)
        parting = tip.velocity - low.velocity > 0.0 and not pair.lasting
        return abs(tip.displacement - low.displacement) <= tolerance and not parting

    def _act(self, kind: EventKind, step: Step, contact: float) -> None:
        """The event at the end of ``step`` happens, where the contact force is ``contact`` [N]."""
        state, pair = self.state, self._pair
        ends = pair.ends()
        meets = kind in (EventKind.IMPACT, EventKind.SEPARATION)  # at Ψ, where it means something else
        tolerance = self._detector.simultaneity_tolerance(ends) if meets else self._detector.tolerance(ends)
        kind, phase, impact = self._transitions.after(
            kind, state.phase, step.start, step.size, ends, contact, tolerance
        )
        # Another event at the time of an impact settles what that has begun.
        state.struck = state.time if kind.collision and pair.divides else -inf
        if kind.collision and state.parted == state.time:
            state.met_again = state.time
        state.parted = state.time if kind.opens else -inf
        pair.apply_impulses(impact.on_beam, impact.on_spring)
        lost = impact.energy_loss + pair.follow_phase(phase)
        state.lost += lost
        state.enter(phase)
        self._happened(kind, Impact() if kind.opens else impact, lost)  # nothing strikes where ends part

    def _happened(self, kind: EventKind, impact: Impact, lost: float) -> None:
        tip, low = self._pair.ends_together(self.state.phase)
        y, z = (None, None) if self._scene.lower is None else low[:2]
        u, v = (None, None) if self._scene.upper is None else tip[:2]
        self.state.events += 1
        self._log.events.append(Event(self.state.time, kind, y, z, u, v, impact.on_beam, impact.of_foundation, lost))

    def _note_soft_contact(self, step: Step) -> None:
        state = self.state
        for joint, change in self._detector.soft_changes(state, step):
            state.phase = Phase(joint, state.phase.seated)
            state.events += 1
            self._log.events.append(change)

    # -- what is left of a step ---------------------------------------------------------------------------------------

    def _record(self, step: Step, ends: Ends, before: Present, *, changed: bool) -> None:
        """Leave the record of ``step``, and now and then the beam's shape.

        ``ends`` are those after its event, ``before`` the forces before it; ``changed`` says whether others are next.
        """
        state, (tip, low) = self.state, step.end  # no event makes an end faster than both were
        state.ends = ends
        state.present = before
        if changed:
            state.present = self._pair.present(state.phase, step, self._steps.size, changed=True)
        speed = max(tip[1], -tip[1], low[1], -low[1])
        if speed > state.fastest:
            state.fastest = speed
        self._log.records.append(self._packed(step, ends, before))
        if self._pictured is not None:
            early = state.shapes_left > 0 and state.phase.joint is not Joint.FREE
            if early or state.time >= state.next_shape:
                self._shape(self._pictured, early)

    def _packed(self, step: Step, ends: Ends, forces: Present) -> bytes:
        state, pair = self.state, self._pair
        _, size, contact, foundation, _, before = step
        if size == 0.0:
            contact, foundation = state.contact, state.foundation
        (u, v, _, _), (y, z, _, _) = ends
        of_upper, of_lower, booked = pair.upper.energies(), pair.lower.energies(), pair.joined.booking(ends)
        if self._adaptive is not None:
            energies = abs(of_upper.kinetic + of_upper.potential) + abs(of_lower.kinetic + of_lower.potential)
            self._adaptive.note(energies + booked.stored)
        return packed(
            *(state.time, size, *before[0], *before[1], *contact, *foundation),
            *(*forces, u, v, y, z, *state.present, state.phase.number, state.events),
            *(
                *of_upper,
                *of_lower,
                *booked,
                state.lost,
                pair.upper.received,
                pair.lower.received,
                state.energy_at_start,
            ),
            *(pair.upper.felt() if self._told & BEAM_TELLS else _NOTHING_FELT),
            *(self._told, pair.joined.degree, pair.tip_share, pair.turned_mass),
        )

    def _shape(self, beam: BeamBody, early: bool) -> None:
        state, every = self.state, self._shape_every
        time = state.time
        state.shapes_left -= early
        if time >= state.next_shape:
            state.next_shape += every * ((time - state.next_shape) // every + 1.0)
        self._log.shapes.append(np.array([time, *beam.shape()]))

    # -- what it amounts to -------------------------------------------------------------------------------------------

    def summary(self) -> dict[str, Any]:
        """Counts, residuals, warnings and results, as they go into ``summary.json``: of what the recorder has."""
        scene, steps = self._scene, self._recorder.steps()
        known = int(steps["events"][-1]) if len(steps) else 0  # a full disk may have events without their records
        events = self._recorder.events()[:known]
        made = int(np.count_nonzero(np.diff(steps["time"])))
        energies, warnings, changed = self._balance.report(steps)
        off = misplaced(scene, self._pair, steps, events)
        unresolved = why_not_resolved(scene, self._pair, self._steps.size, steps, events, off)
        warnings += filter(None, [unresolved or peak_force_doubt(scene), not_shown(scene, self._pair, steps)])
        warnings += filter(None, [unknown(scene, self._pair), coarse_force(self._pair)])
        window = force_window(scene, self._pair, steps)
        amounts = totals(scene, steps, events, window) if len(steps) else {}
        ruled_out = contradictions(scene, steps, events, amounts.get("contact_duration_total", 0.0))
        warnings += [f"not resolved: {what}: an event was missed; {_SHORTER}" for what in ruled_out]
        return {
            "degree": scene.degree,
            "time": float(steps["time"][-1]) if len(steps) else self.state.time,
            "macro_steps": made,
            "events": len(events),
            "halved_steps": self.state.halvings,
            "iterations": self._pair.joined.state.iterations,
            **energies,
            "resolved": unresolved is None and not changed and not ruled_out,
            **({} if off is None else {"misplaced_ends": off}),
            "warnings": warnings,
            **amounts,
        }
