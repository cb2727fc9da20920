"""An accuracy instead of a scheme, a macro step and tolerances: they are picked by pilot runs.

The error is that of the coupling and the time integration, for the scene's own mesh and modes: these are the model.
(Impacts on the foundation converge only slowly with the mesh, since what they meet is the mass of its tip.)

Two runs are compared: if the finer one has ρ times the steps and its error is of order p, that error is the
difference over ρᵖ − 1. `hermite`, and `jacobi` with law "compliance", tell p themselves: their energy residual is an
error of the same order, summed up over the run, so ρᵖ is the ratio of the two residuals. The first run has the macro
step that the fastest waves at the tip ask for, the second what the residual of the first lets expect, a third what the
difference of these two does; each agrees with the one before or gives way to a finer one (``docs/accuracy.md``).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .automatic import choice
from .contact_times import apart, changes_of_contact
from .linearised import spring_frequency
from .recording import MemoryRecorder
from .resolution import fastest_frequency, shear_frequency
from .runner import RunStopped, run
from .scene import Scene, SceneError, scene_from_dict, with_changes
from .statics import tip_compliance
from .trajectory import Event, Trajectory

#: Fewest macro steps where bodies are coupled and where not, and the largest number tried; pilot runs in a row that
#: may stop early.
_FEWEST, _UNCOUPLED, _MOST, _MOST_STOPPED = 8, 4, 50_000, 6
#: Growth of the number of macro steps from run to run: at least, at most, after a run that gained energy, and after
#: one that stopped for another reason, which may be gone at the next size.
_LEAST_GROWTH, _MOST_GROWTH = 1.2, 4.0
_AFTER_GAIN, _AFTER_STOP = {"energy": 1.4, "hermite": 1.4, "jacobi": 2.0}, 1.01
#: Energy residual above which it was too large a macro step that stopped a run.
_GAIN = 0.05
#: An estimate of the error is to be so many times smaller than the accuracy.
_SAFETY = 1.5
#: Runs that differ by more are both unresolved, whatever their order [of the motion].
_UNRESOLVED = 0.02
#: By how much the finer one of two runs of different events is trusted to be better.
_DOUBTED = 30.0
#: Orders of the error, by the schemes whose energy residual has the same; the lowest that is relied on, and the highest
#: of the time of an event.
_ORDERS = {"hermite": 6.0, "jacobi": 2.0}
_LOWEST, _OF_EVENTS = 1.0, 3.0
#: What the first macro step turns the fastest wave by [rad], over accuracy^(1/order); what it turns a body alone by;
#: and the part of a mode's retardation time within which it dies out and needs no resolution.
_TURN = {"hermite": 26.0, "jacobi": 150.0}
_ALONE, _DIES_OUT = 2.0, 0.3
#: Displacement error over energy residual of `hermite`, in runs with changes of contact after the first.
_AMPLIFIED = 10.0
#: doStep calls per macro step of a run that pays for its events rather than its steps: more steps cost hardly more.
_CALLS_PER_STEP = 8.0
#: The coupling's and IDA's tolerance over the accuracy, and the bounds of the latter.
_COUPLING_SHARE, _IDA_SHARE, _TIGHTEST, _LOOSEST = 1e-3, 1e-4, 1e-12, 1e-8


@dataclass(frozen=True)
class Picked:
    """A scene that keeps the accuracy, and what is known about it."""

    asked: float
    run: Trajectory  #: the last pilot run, which keeps it
    displacement_error: float  #: estimate, relative to the largest change of the tip (or spring top)
    event_error: float  #: estimate of the largest error of a change of contact, relative to the time that is run
    events: int  #: changes of contact that this is about, those further apart than two steps of the coarser run
    pilot_runs: int
    pilot_steps: int  #: doStep calls of the pilot runs before the last
    pilot_time: float  #: [s]

    @property
    def scene(self) -> Scene:
        """Asks for no accuracy: it says how it is run."""
        return self.run.scene

    def trajectory(self) -> Trajectory:
        """The run, what was picked and found in its summary."""
        return replace(self.run, summary={**self.run.summary, "accuracy": self.summary()})

    def summary(self) -> dict[str, Any]:
        """As it goes into ``summary.json``."""
        coupling, spring = self.scene.coupling, self.scene.spring
        picked: dict[str, Any] = {"scheme": coupling.scheme, "degree": coupling.degree, "macro_step": coupling.H}
        if spring is not None:
            picked["ida_relative_tolerance"] = spring.relative_tolerance
        return {
            "asked": self.asked,
            "picked": picked,
            "estimated_displacement_error": self.displacement_error,
            "estimated_event_error": self.event_error,
            "events_compared": self.events,
            "pilot_runs": self.pilot_runs,
            "pilot_steps": self.pilot_steps,
            "pilot_time": self.pilot_time,
        }


def pick(scene: Scene) -> Picked:
    """Settings with which ``scene`` keeps its ``accuracy``, and the run with them.

    Raises
    ------
    SceneError
        If the scene asks for none, or it cannot be reached; the message says how far it was.
    RunStopped
        If the run with these settings would stop early.
    """
    if scene.accuracy is None:
        raise SceneError("accuracy: the scene asks for none")
    if scene.contact.law == "paper":
        raise SceneError('accuracy: [contact] law = "paper" is defined by its macro step; take another law')
    return _Search(scene, scene.accuracy).run()


@dataclass(frozen=True)
class _Pilot:
    """A run, and its macro steps where no event cuts them."""

    steps: float
    run: Trajectory

    @property
    def residual(self) -> float:
        return float(self.run.summary["max_energy_residual"])

    @property
    def calls(self) -> int:
        """doStep calls of both FMUs."""
        return sum(int(self.run.summary.get(f"{body}_steps", 0)) for body in ("beam", "spring"))

    @property
    def spent(self) -> float:
        """[s]"""
        return float(self.run.summary["wall_time"])


@dataclass(frozen=True)
class _Estimate:
    """Of the finer one of two runs, relative to the largest change of the tip, and to the time that is run."""

    displacement: float
    expected: float  #: the same, if the order of convergence holds
    event: float
    events: int
    apart: float  #: by how much the two differ in the larger of both


class _Disturbed(Exception):
    """There is more than the first event."""


class _UndisturbedRecorder(MemoryRecorder):
    """Of a run that has but one event. Raises _Disturbed."""

    def event(self, event: Event) -> None:
        if self._events:
            raise _Disturbed
        super().event(event)


class _Search:
    def __init__(self, scene: Scene, accuracy: float) -> None:
        data = scene.model_dump(exclude={"accuracy"}, exclude_none=True)
        self._scene, self._accuracy = scene_from_dict(data), accuracy
        self._span = scene.time.t_end - (scene.contact_time or 0.0)
        fine = with_changes(self._scene, coupling={"macro_step": 1e-9 * self._span})
        taken = choice(fine)  # of schemes, the one where everything is resolved
        self._scheme, self._degree = taken.scheme, taken.degree
        exchanged = scene.contact.law == "compliance" and scene.coupling.feedback == "two_way"
        if exchanged and scene.spring is not None and scene.beam is not None and scene.beam.integrator == "modal":
            self._scheme, self._degree = "jacobi", 1  # as accurate as `energy`, for half the calls
        self._runs, self._calls, self._spent, self._stopped, self._after_stop = 0, 0, 0.0, 0, 1.0

    def run(self) -> Picked:
        steps, coarse, estimate = self._first(), None, None
        if self._scene.spring is not None and self._scheme == "hermite" and steps >= 2.0 * _FEWEST:
            coarse = self._pilot(_FEWEST, undisturbed=True)
            if coarse is not None:
                steps = self._rung(_FEWEST * self._second(coarse))
        while steps <= _MOST:
            fine = self._pilot(steps)
            if fine is None:
                growth = self._after_stop
            elif coarse is None:
                growth, coarse = self._second(fine), fine
            else:
                estimate = self._estimate(coarse, fine)
                worst = _SAFETY * max(estimate.displacement, estimate.event)
                if worst <= self._accuracy and estimate.apart <= _UNRESOLVED:
                    return Picked(
                        self._accuracy, fine.run, estimate.displacement, estimate.event, estimate.events,
                        self._runs - 1, self._calls - fine.calls, self._spent - fine.spent,
                    )  # fmt: skip
                growth, coarse = self._growth(estimate), fine
            least = 0.0 if fine is None else fine.calls / _CALLS_PER_STEP
            steps = self._rung(max(steps * growth, least))
        if estimate is None:
            found = f"the fastest waves of its mesh take some {steps:.1g}"
        else:
            found = f"runs still differ by {estimate.apart:.1e}"
        raise SceneError(
            f"accuracy = {self._accuracy:g}: not reached with {_MOST} steps, {found}; ask for less, shorten [time] "
            "t_end, or take a coarser mesh"
        )

    # -- how fine ---------------------------------------------------------------------------------------------------

    def _first(self) -> float:
        beam, spring = self._scene.beam, self._scene.spring
        if (beam is None or spring is None) and self._scene.stop is None:
            return _UNCOUPLED  # exact but for IDA
        of_spring = 0.0 if spring is None else spring_frequency(self._scene)
        if beam is None:
            return self._rung(of_spring * self._span / _ALONE)
        if beam.fidelity == "quasi_static":
            assert spring is not None
            return self._rung(math.hypot(of_spring, 1.0 / math.sqrt(tip_compliance(beam) * spring.mass)) * self._span)
        waves = min(shear_frequency(beam), fastest_frequency(beam))
        if beam.alpha_b > 0.0:
            waves = min(waves, _DIES_OUT / beam.alpha_b)
        turn = _ALONE
        if spring is not None:
            like = "jacobi" if self._scheme == "jacobi" else "hermite"
            turn = _TURN[like] * self._accuracy ** (1.0 / _ORDERS[like])
        return self._rung(max(waves, of_spring) * self._span / turn)

    def _second(self, first: _Pilot) -> float:
        if self._scheme not in _ORDERS:
            return _LEAST_GROWTH
        amplified = _AMPLIFIED if self._scheme == "hermite" and changes_of_contact(first.run) else 1.0
        growth = math.pow(amplified * first.residual / self._accuracy, 1.0 / _ORDERS[self._scheme])
        return min(max(growth, _LEAST_GROWTH), _MOST_GROWTH)

    def _growth(self, estimate: _Estimate) -> float:
        """What makes the next estimate hold, with a margin, by the orders of convergence expected."""
        margin = 1.5 * _SAFETY / self._accuracy
        displacement, event = margin * estimate.expected, margin * estimate.event
        of_displacement, of_event = (2.0, 2.0) if self._scheme == "jacobi" else (5.0, 3.5)
        growth = max(math.pow(displacement, 1.0 / of_displacement), math.pow(event, 1.0 / of_event))
        return min(max(growth, _LEAST_GROWTH), _MOST_GROWTH)

    def _rung(self, steps: float) -> float:
        """Macro steps, at least these: four sizes an octave, so that any two runs have many times in common."""
        steps = max(steps, _FEWEST)
        unit = max(2.0 ** (math.floor(math.log2(steps)) - 2), 4.0)
        return unit * math.ceil(steps / unit * (1.0 - 1e-9))

    # -- runs -------------------------------------------------------------------------------------------------------

    def _pilot(self, steps: float, *, undisturbed: bool = False) -> _Pilot | None:
        """``None`` if it stops early, which a finer one may not. Raises RunStopped if that goes on.

        If it is to be ``undisturbed``, a second event stops it.
        """
        tables: dict[str, dict[str, Any]] = {
            "coupling": {
                "scheme": self._scheme,
                "degree": self._degree,
                "macro_step": self._span / steps,
                "tolerance": max(_COUPLING_SHARE * self._accuracy, _TIGHTEST),
            }
        }
        if self._scene.spring is not None:
            tolerance = min(max(_IDA_SHARE * self._accuracy, _TIGHTEST), _LOOSEST)
            tables["spring"] = {"relative_tolerance": tolerance, "absolute_tolerance": 1e-2 * tolerance}
        scene = with_changes(self._scene, **tables)
        recorder = _UndisturbedRecorder(scene) if undisturbed else MemoryRecorder(scene)
        try:
            run(scene, recorder)
            self._stopped = 0
        except RunStopped as stopped:
            self._stopped += not isinstance(stopped.__cause__, _Disturbed)
            if self._stopped == _MOST_STOPPED:
                raise
        pilot = _Pilot(steps, recorder.trajectory())
        self._runs, self._calls, self._spent = self._runs + 1, self._calls + pilot.calls, self._spent + pilot.spent
        if pilot.run.summary["status"] == "done":
            return pilot
        self._after_stop = _AFTER_GAIN[self._scheme] if pilot.residual > _GAIN else _AFTER_STOP
        return None

    def _estimate(self, coarse: _Pilot, fine: _Pilot) -> _Estimate:
        displacement = self._displacement(coarse.run, fine.run)
        event, events = apart(coarse.run, fine.run, 2.0 * self._span / coarse.steps)
        event /= self._span
        ratio, order = fine.steps / coarse.steps, _LOWEST
        if self._scheme in _ORDERS and fine.residual > 0.0 < coarse.residual:
            seen = math.log(coarse.residual / fine.residual) / math.log(ratio)
            order = min(max(seen, _LOWEST), _ORDERS[self._scheme])
        of_event = min(order, _OF_EVENTS)
        expected, of_event = displacement / (ratio**order - 1.0), event / (ratio**of_event - 1.0)
        kinds, others = ([e.kind for e in pilot.run.events] for pilot in (coarse, fine))
        # No order holds through an event that only one of the two has.
        doubted = expected if kinds == others else max(expected, displacement / _DOUBTED)
        return _Estimate(doubted, expected, of_event, events, max(displacement, event))

    def _displacement(self, coarse: Trajectory, fine: Trajectory) -> float:
        """The largest difference, relative to the largest change."""
        name = "u_tip" if "u_tip" in fine.columns else "y"
        values = fine[name]
        scale = float(np.abs(values - values[0]).max()) or 1.0
        at, rows = _common(coarse.time, fine.time)
        return float(np.abs(coarse[name][at] - values[rows]).max(initial=0.0)) / scale


def _common(coarse: np.ndarray, fine: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows of both at the same time, but for rounding."""
    index = np.clip(np.searchsorted(fine, coarse), 1, len(fine) - 1)
    index -= np.abs(fine[index - 1] - coarse) < np.abs(fine[index] - coarse)
    close = np.abs(fine[index] - coarse) <= 1e-9 * float(fine[-1] - fine[0])
    return np.flatnonzero(close), index[close]
