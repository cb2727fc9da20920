"""An accuracy instead of a scheme, a macro step and IDA's tolerance: they are picked by pilot runs.

The error is that of the coupling and the time integration, for the scene's own mesh and modes: these are the model.
(Impacts on the foundation converge only slowly with the mesh, since what they meet is the mass of its tip.)

Runs with more and more macro steps follow each other until two agree in the order of their events, and in their
displacements and event times: if the finer one has ρ times the steps and its error is of order 2 in H or more, that
error is at most the difference over ρ² − 1. Each takes the scheme that `springbeam.automatic` takes for its macro step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .automatic import choice
from .crosscheck import contact_changes
from .runner import simulate
from .scene import Scene, SceneError, scene_from_dict, with_changes
from .trajectory import Trajectory

#: Macro steps of the first run, and the largest number tried.
_FEWEST, _MOST = 16, 50_000
#: Growth of the number of macro steps from run to run.
_LEAST_GROWTH, _MOST_GROWTH = 1.5, 8.0
_SAFETY = 1.5
#: Order of the error that is relied on, and orders expected where contact opens and closes.
_TRUSTED, _EXPECTED = 2.0, {"compliance": 2.0, "transmission": 4.0}
#: IDA's tolerance over the accuracy, and its bounds.
_IDA_SHARE, _TIGHTEST, _LOOSEST = 1e-4, 1e-12, 1e-8


@dataclass(frozen=True)
class Picked:
    """A scene that keeps the accuracy, and what is known about it."""

    asked: float
    run: Trajectory  #: the last pilot run, which keeps it
    displacement_error: float  #: estimate, relative to the largest change of the tip (or spring top)
    event_error: float  #: estimate of the largest error of a change of contact, relative to the time that is run
    events: int  #: changes of contact that this is about, those longer than four macro steps
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
        picked: dict[str, Any] = {
            "scheme": coupling.scheme,
            "degree": coupling.degree,
            "macro_step": coupling.H,
        }
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


class _Search:
    def __init__(self, scene: Scene, accuracy: float) -> None:
        data = scene.model_dump(exclude={"accuracy"}, exclude_none=True)
        self._scene, self._accuracy = scene_from_dict(data), accuracy
        self._span = scene.time.t_end - (scene.contact_time or 0.0)
        self._order = _EXPECTED["compliance" if scene.contact.law == "compliance" else "transmission"]

    def run(self) -> Picked:
        steps = _FEWEST
        coarse, spent, calls, runs, growth, worst = self._with(steps), 0.0, 0, 1, 2.0, 1.0
        while True:
            steps = math.ceil(growth * steps)
            if steps > _MOST:
                found = (
                    "the events still change from run to run" if worst >= 1.0 else f"runs still differ by {worst:.1e}"
                )
                raise SceneError(
                    f"accuracy = {self._accuracy:g}: not reached with {len(coarse) - 1} steps, {found}; ask for "
                    "less, or shorten [time] t_end"
                )
            spent += float(coarse.summary["wall_time"])
            calls += _calls(coarse)
            fine, runs = self._with(steps), runs + 1
            ratio = coarse.scene.coupling.H / fine.scene.coupling.H
            error, event_error, events = self._difference(coarse, fine)
            worst = max(error, event_error)
            share = 1.0 / (ratio**_TRUSTED - 1.0)
            if share * worst <= self._accuracy / _SAFETY:
                return Picked(self._accuracy, fine, share * error, share * event_error, events, runs - 1, calls, spent)
            # What the expected order makes of the difference; other events tell nothing about it.
            expected = worst / (ratio**self._order - 1.0)
            growth = 1.2 * (_SAFETY * expected / self._accuracy) ** (1.0 / self._order) if worst < 1.0 else 2.0
            growth = min(max(growth, _LEAST_GROWTH), _MOST_GROWTH)
            coarse = fine

    def _with(self, steps: int) -> Trajectory:
        tables: dict[str, dict[str, Any]] = {"coupling": {**self._scheme(steps), "macro_step": self._span / steps}}
        if self._scene.spring is not None:
            tolerance = min(max(_IDA_SHARE * self._accuracy, _TIGHTEST), _LOOSEST)
            tables["spring"] = {"relative_tolerance": tolerance, "absolute_tolerance": 1e-2 * tolerance}
        return simulate(with_changes(self._scene, **tables))

    def _scheme(self, steps: int) -> dict[str, Any]:
        taken = choice(with_changes(self._scene, coupling={"macro_step": self._span / steps}))
        return {"scheme": taken.scheme, "degree": taken.degree}

    def _difference(self, coarse: Trajectory, fine: Trajectory) -> tuple[float, float, int]:
        """Of displacement, relative to its change; of event times, relative to the span; the number of events.

        Where the events come in another order, that of their times is 1.
        """
        name = "u_tip" if "u_tip" in fine.columns else "y"
        at, rows = _common(coarse.time, fine.time)
        values = fine[name]
        scale = float(np.abs(values - values[0]).max()) or 1.0
        displacement = float(np.abs(coarse[name][at] - values[rows]).max(initial=0.0)) / scale
        window = 2.0 * coarse.scene.coupling.H
        ours, theirs = contact_changes(fine.events, window), contact_changes(coarse.events, window)
        if [kind for kind, _ in ours] != [kind for kind, _ in theirs]:
            return displacement, 1.0, 0
        apart = [abs(a - b) for (_, a), (_, b) in zip(ours, theirs, strict=True)]
        return displacement, max(apart, default=0.0) / self._span, len(ours)


def _calls(run: Trajectory) -> int:
    return sum(int(run.summary.get(f"{body}_steps", 0)) for body in ("beam", "spring"))


def _common(coarse: np.ndarray, fine: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows of both at the same time, but for rounding."""
    index = np.clip(np.searchsorted(fine, coarse), 1, len(fine) - 1)
    index -= np.abs(fine[index - 1] - coarse) < np.abs(fine[index] - coarse)
    close = np.abs(fine[index] - coarse) <= 1e-9 * float(fine[-1] - fine[0])
    return np.flatnonzero(close), index[close]
