"""The master's run: macro steps from event to event.

One step is *mark* (the bodies remember their state), *attempt* (advance under the phase's law; may be repeated with
any size, each time from the mark; `springbeam.run.stepping`), *detect* (which event comes first inside the step?
`springbeam.run.detection`) and *accept*. An event shortens the step to itself, acts (`springbeam.contact.phases`), and
the run goes on from there. Every row closes the ledger (`springbeam.run.rows`, `springbeam.run.ledger`).
"""

from __future__ import annotations

from typing import Any

from ..bodies.checkpointed import Checkpointed
from ..bodies.gate import admit
from ..bodies.protocol import NO_FORCE, Body, BodyFailed, StepRefused
from ..contact.phases import Joint, Phase, Transitions
from ..coupling.protocol import NotConverged, Step
from ..results.recording import NonFiniteValue, Recorder
from ..results.totals import pace, shortest_contact
from ..results.trajectory import Event
from ..scene import Scene
from ..scene.automatic import with_scheme_chosen
from ..scene.resolution import CONTACT_STEPS, not_resolved, peak_force_doubt
from .crowd import SIMULTANEOUS, Crowd
from .detection import Detector
from .ledger import Balance
from .local_error import LocalError
from .macro_steps import AdaptiveSteps, MacroGrid, StepTooShort
from .outcome import OVERFLOW, Progress, RunStopped, raised_here
from .rows import NOT_SHOWN, Rows
from .stepping import Pair

#: A load that jumps or bends within this fraction of H has done so.
_SAME_TIME = 1e-9
#: A step that is refused is halved this often before the run stops.
_MAX_HALVINGS = 20


class Simulation(Checkpointed):
    """One run of a scene with given bodies.

    Parameters
    ----------
    scene
        What is simulated.
    start_time
        Where the run starts [s], `springbeam.scene.Scene.contact_time` or 0.
    beam, spring
        The bodies at the start time; ``None`` where the scene has none. A beam that is no `BeamBody` leaves no shapes.
    recorder
        Receives rows, events and shapes.
    progress
        Called once per accepted step.

    Raises SceneError if the scene cannot be run with these bodies.
    """

    CHECKPOINTED = (
        "_pair",
        "_state",
        "_steps",
        "_error",
        "_transitions",
        "_balance",
        "_rows",
        "_begun",
        "_last_opening",
        "_crowd",
        "_macro_steps",
        "_events",
        "_halvings",
    )

    def __init__(
        self,
        scene: Scene,
        start_time: float,
        beam: Body | None,
        spring: Body | None,
        recorder: Recorder,
        progress: Progress | None = None,
    ) -> None:
        scene, self._choice = with_scheme_chosen(scene)
        self._scene, self._recorder, self._progress = scene, recorder, progress
        admit(scene, start_time, beam, spring)
        self._pair = Pair(scene, beam, spring)
        self._state = self._pair.initial_state(start_time)
        self._steps: MacroGrid | AdaptiveSteps
        if scene.coupling.adaptive:
            self._steps = AdaptiveSteps(start_time, scene.time.t_end)
        else:
            self._steps = MacroGrid(start_time, scene.time.t_end, scene.coupling.H)
        self._error = LocalError(scene, self._pair) if scene.coupling.adaptive else None
        self._detector = Detector(scene, self._pair, self._steps, self._fastest)
        self._transitions = Transitions(
            scene,
            self._pair.law,
            None if beam is None else beam.mass,
            None if spring is None else spring.mass,
            self._fastest,
            self._pair.equilibrium,
        )
        self._balance = Balance(scene, self._pair)
        self._rows = Rows(scene, self._pair, self._balance, recorder, start_time)
        self._begun = False
        self._last_opening = -float("inf")
        self._crowd = Crowd(start_time)
        self._macro_steps = self._events = self._halvings = 0

    def run(self) -> None:
        """Until t_end, from the start or from where `restore` has put it.

        Raises RunStopped; what was computed is with the recorder.
        """
        try:
            self._run()
        except (BodyFailed, NonFiniteValue) as failed:
            raise RunStopped(str(failed), self.time) from failed
        except OverflowError as error:
            if not raised_here(error):
                raise
            raise RunStopped(OVERFLOW, self.time) from error

    @property
    def time(self) -> float:
        """Reached so far [s]."""
        return self._state.time

    def _fastest(self) -> float:
        """The largest speed of an end so far [m/s]."""
        return self._rows.largest_speed

    def _run(self) -> None:
        state, steps, loads, t_end = self._state, self._steps, self._pair.loads, self._scene.time.t_end
        if not self._begun:
            self._settle_start()
            self._record(None)
            self._begun = True
        while state.time < t_end:
            target, size = steps.next(state.time, loads.next_kink(state.time + _SAME_TIME * steps.size))
            step, event = self._advance(size)
            whole = event is None and abs(step.size - size) <= 1e-9 * steps.size
            end = target if whole else state.time + step.size
            self._crowd.count(end, step.size, steps.size)
            if step.size > 0.0:
                if self._error is not None:
                    self._error.accept(step)
                self._pair.coupling(state.phase).accept(step)
                state.accept(step, end)
                self._macro_steps += 1
                if self._pair.law.soft:
                    self._rows.note_penetration(step)
                if self._pair.opens_softly:
                    self._note_soft_contact(step)
            steps.reached(state.time)
            if event is not None:
                self._act(event, step)
            self._record(step)
            if self._progress is not None:
                self._progress(state.time, state.phase.name, self._macro_steps)

    def _advance(self, size: float) -> tuple[Step, str | None]:
        """The next step and the event it ends on, the bodies left at its end."""
        state, pair = self._state, self._pair
        pair.mark()
        start = pair.ends()
        halvings, cause = 0, ""
        while True:
            try:
                at_start = self._detector.at_start(state, start)
                if at_start is not None:
                    return Step(state.time, 0.0, state.contact, state.foundation, start, start), at_start
                step = pair.attempt(state, size, start)
                if self._error is None or self._holds(step, self._error, cause):
                    return self._detector.first_event(state, step)
                pair.rewind()
                size = self._steps.size
            except (StepRefused, OverflowError) as refused:
                if isinstance(refused, OverflowError) and not raised_here(refused):
                    raise  # a body of the caller's has failed: it would do so at any size
                if pair.repeatable:
                    pair.rewind()
                cause = OVERFLOW if isinstance(refused, OverflowError) else str(refused)
                if halvings == _MAX_HALVINGS or not pair.divides:
                    residual = refused.residual if isinstance(refused, NotConverged) else None
                    raise RunStopped(cause, state.time, residual) from refused
                halvings += 1
                self._halvings += 1
                size *= 0.5

    def _holds(self, step: Step, local_error: LocalError, refused: str) -> bool:
        """Is the step as accurate as the scene asks? If not, the next one to try has the size that is then set.

        ``refused`` says why longer ones were, or nothing: none that is too short for its tolerance hides that.
        """
        assert isinstance(self._steps, AdaptiveSteps)
        error, order = local_error.estimate(self._state, step, self._balance.ledger.scale)
        try:
            return self._steps.judge(step.size, error, order)
        except StepTooShort as too_short:
            cause = refused or f"{too_short}, where it is {error:.3g} of it"
            raise RunStopped(cause, step.time) from too_short

    # -- events -----------------------------------------------------------------------------------------------------

    def _settle_start(self) -> None:
        """First contact at the start: the tip on the spring top (or the stop), moving down or at rest."""
        state, pair = self._state, self._pair
        if pair.beam is None or pair.law.soft or (pair.spring is None and pair.stop is None):
            return
        tip, low = start = pair.ends()
        tolerance = self._detector.tolerance(start) + 1e-12 * abs(low.displacement)
        parting = tip.velocity - low.velocity > 0.0 and not pair.law.lasting
        if abs(tip.displacement - low.displacement) > tolerance or parting:
            return
        pair.mark()
        # The bodies are recorded as they arrive: the ledger starts before the impact.
        self._balance.book(start)
        at_start = Step(state.time, 0.0, NO_FORCE, NO_FORCE, start, start)
        self._act("impact" if pair.joinable else "stop_impact", at_start)

    def _act(self, kind: str, step: Step) -> None:
        """The event at the end of ``step`` happens."""
        state, pair = self._state, self._pair
        if kind in ("separation", "release"):
            self._last_opening = state.time
        if kind == "impact":
            state.reclosed = state.time - self._last_opening <= SIMULTANEOUS * self._steps.size
        if kind in ("separation", "release", "stop_impact"):
            self._rows.note_mismatch(state, kind, self._steps.size)
        ends = pair.ends()
        meets = kind in ("impact", "separation")  # at Ψ, where it means something else
        tolerance = self._detector.simultaneity_tolerance(ends) if meets else self._detector.tolerance(ends)
        kind, phase, impact = self._transitions.after(
            kind, state.phase, step.start, step.size, ends, pair.end_force(state, step), tolerance
        )
        if kind in ("impact", "stop_impact") and pair.divides:
            self._steps.shorten_after_impact()
        pair.apply_impulses(impact.on_beam, impact.on_spring)
        lost = impact.energy_loss + pair.follow_phase(phase)
        self._balance.lose(lost)
        state.enter(phase)
        tip, low = pair.ends()
        beam, spring = pair.beam is not None, pair.spring is not None
        self._events += 1
        self._recorder.event(
            Event(
                state.time,
                kind,
                low.displacement if spring else None,
                low.velocity if spring else None,
                tip.displacement if beam else None,
                tip.velocity if beam else None,
                impact.on_beam,
                impact.of_foundation,
                lost,
            )
        )

    def _note_soft_contact(self, step: Step) -> None:
        state = self._state
        for joint, change in self._detector.soft_changes(state, step):
            state.phase = Phase(joint, state.phase.seated)
            self._events += 1
            self._recorder.event(change)

    # -- what is reported -------------------------------------------------------------------------------------------

    def _record(self, step: Step | None) -> None:
        self._rows.write(self._state, step)
        self._balance.refuse_change(self._state.time, self._steps.size)
        if self._scene.coupling.feedback != "two_way":
            self._refuse_neglect()

    def _refuse_neglect(self) -> None:
        """Raise RunStopped where a one-way coupling neglects more than the scene allows."""
        neglected, allowed = self._pair.joined.neglected(), self._scene.coupling.feedback_tolerance
        if neglected is not None and neglected.share > allowed:
            raise RunStopped(
                f"coupling.feedback = {self._scene.coupling.feedback!r} may by now neglect {neglected.motion:.3g} m "
                f"of the driving end's motion, {neglected.share:.2g} of the largest penetration; allowed is "
                f"coupling.feedback_tolerance = {allowed:g}. Take 'two_way', or allow more",
                self._state.time,
            )

    def summary(self) -> dict[str, Any]:
        """Counts, residuals and warnings, as they go into ``summary.json``."""
        rows, warnings = self._rows, self._balance.warnings(self._steps.size)
        if reduced := self._pair.joined.reduced:
            warnings.append(
                f"the contact force of {reduced} of {self._macro_steps} macro steps was not found at coupling.degree = "
                f"{self._pair.joined.degree}; they were made at degree 0, which keeps the energy but has order 2. The "
                "contact is stiffer than the macro step follows: take a smaller coupling.macro_step"
            )
        unresolved = not_resolved(
            self._scene,
            rows.mismatch_at_events,
            shortest_contact=shortest_contact(
                self._recorder.steps(),
                self._recorder.events(),
                CONTACT_STEPS * self._steps.size,
                free_at_end=self.free_at_end,
            ),
            contact_frequency=rows.contact_frequency,
            contact_steps=rows.contact_steps,
            pace=pace(self._recorder.steps()),
            strokes=any(event.kind in ("stop_impact", "seated") for event in self._recorder.events()),
        )
        doubt = unresolved or peak_force_doubt(self._scene)
        if doubt is not None:
            warnings.append(doubt)
        if rows.not_shown:
            warnings.append(NOT_SHOWN)
        bound = self._pair.joined.neglected()
        neglected = {} if bound is None else {"neglected_motion": bound.motion, "neglected_share": bound.share}
        coupling = {} if self._choice is None else {"coupling": self._choice._asdict()}
        return {
            **neglected,
            **coupling,
            "time": self._state.time,
            "macro_steps": self._macro_steps,
            "events": self._events,
            "halved_steps": self._halvings,
            **({"rejected_steps": self._steps.rejections} if isinstance(self._steps, AdaptiveSteps) else {}),
            "iterations": self._pair.joined.iterations,
            **({"reduced_steps": reduced} if reduced else {}),
            **self._balance.summary(),
            "max_velocity_mismatch": rows.largest_mismatch,
            "resolved": unresolved is None and not self._balance.changed,
            "warnings": warnings,
        }

    @property
    def free_at_end(self) -> bool:
        """Whether no contact joins tip and lower end by now."""
        return self._state.phase.joint is Joint.FREE
