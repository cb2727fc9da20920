"""An accuracy instead of a scheme, a macro step and tolerances: they are picked by pilot runs.

The error is that of the coupling and the time integration, for the scene's own mesh and modes: these are the model.
(Impacts on the foundation converge only slowly with the mesh, since what they meet is the mass of its tip.)

Two runs of equal macro steps are compared: if the finer one is q times as accurate, its error is their difference over
q − 1. With ρ times as many steps q is ρᵖ; `hermite` tells p itself: its energy residual is an error of the same order,
summed up over the run, so ρᵖ is the ratio of the two residuals. Soft laws are coupled by `energy` 2, whose order is 6
while the contact lasts and lower where it opens and closes inside steps; of that, 2 is relied on. A first run is as
fine as the fastest waves at the tip, or the contact itself, or the accuracy ask for, each one after it as fine as those
before let expect, until two agree (``docs/accuracy.md``).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..bodies.protocol import Body
from ..results.contact_times import contact_changes, contact_time_difference, impulse_difference
from ..results.recording import MemoryRecorder
from ..results.trajectory import Trajectory
from ..run import runner
from ..run.outcome import Progress, RunStopped
from ..scene import Scene, SceneError, with_changes
from ..scene.automatic import choice
from ..scene.linearised import spring_frequency
from ..scene.resolution import impact_frequency
from ..scene.statics import tip_compliance
from .stability.predict import contact_frequency

#: Most macro steps of a run; pilot runs in a row that may stop early.
_MOST, _MOST_STOPPED = 50_000, 6
#: An estimate of the error is to be so many times smaller than the accuracy.
_SAFETY = 1.5
#: A tip that moves by a smaller share of the deflection that the energy of the beam could cause is at rest.
_AT_REST = 1e-9
#: Runs that differ by more, relative to the motion, are both unresolved, whatever their order.
_UNRESOLVED = 0.02
#: The coupling's and IDA's relative tolerance over the accuracy, and the least of them; IDA's absolute one [m].
_SHARE, _TIGHTEST, _ABSOLUTE = 1e-3, 1e-12, 1e-30

#: Fewest macro steps, and those of a first run with bodies whose motion nobody knows.
_FEWEST, _PARTNERS = 8, 64
#: Growth of their number from run to run: at least, at most, and after a run that tells nothing of its error.
_LEAST_GROWTH, _MOST_GROWTH, _BLIND_GROWTH = 1.2, 4.0, 2.0
#: Order of the error of `hermite`; the lowest that is relied on, and the highest of the time of an event.
_ORDER, _LOWEST, _OF_EVENTS = 6.0, 1.0, 2.5
#: Order by which a third run and any after it are made finer.
_EXPECTED = 3.5
#: What the first macro step turns the fastest wave by [rad], over accuracy^(1/order); what it turns a body alone by,
#: which errs only where it misses a contact.
_TURN, _ALONE = 26.0, 2.0
#: Displacement error over energy residual of `hermite`, in runs with changes of contact after the first.
_AMPLIFIED = 10.0
#: doStep calls per macro step of a run that pays for its events rather than its steps: more steps cost hardly more.
_CALLS_PER_STEP = 8.0

# Soft laws, by `energy` 2.
#: What the first macro step turns the contact by [rad], over accuracy^(1/4), and the order that is relied on
#: (docs/accuracy.md has those measured).
_CONTACT_TURN, _SOFT_ORDER = 16.0, 2.0


def simulate(
    scene: Scene, progress: Progress | None = None, *, upper: Body | None = None, lower: Body | None = None
) -> Trajectory:
    """Co-simulate ``scene``, with settings that keep its ``accuracy`` if it asks for one, and return the trajectory.

    Parameters
    ----------
    scene
        What is simulated.
    progress
        Called with time [s], phase and number of macro steps once per accepted step; not while settings are searched.
    upper, lower
        Bodies of one's own at the start of the run, in place of the beam and of the spring: `springbeam.Body`.

    Raises
    ------
    RunStopped
        If the run ends early.
    SceneError
        If the accuracy cannot be reached, or the scene asks for what is known of its own bodies alone.
    TypeError
        If ``upper`` or ``lower`` is no `springbeam.Body`.
    FmuError
        If an FMU cannot be found or loaded.
    """
    if scene.accuracy is None or upper is not None or lower is not None:
        return runner.simulate(scene, progress, upper=upper, lower=lower)
    return pick(scene)


def pick(scene: Scene) -> Trajectory:
    """Return a run of ``scene`` that keeps its ``accuracy``; its scene has the settings that were picked.

    ``accuracy`` of its summary says what was asked and picked, with estimates of the errors: of the displacement,
    relative to the largest change of the tip (or spring top), and of the events, the larger of the latest change of
    contact, relative to the time that is run, and of the impacts' impulses, relative to their sum. Compared are changes
    of contact further apart than two steps of the coarser one of the last two runs.

    Raises
    ------
    SceneError
        If the scene asks for none, or it cannot be reached; the message says how far it was.
    RunStopped
        If the run with these settings would stop early.
    """
    if scene.accuracy is None:
        raise SceneError("accuracy: the scene asks for none")
    if scene.contact.algorithm:
        raise SceneError(
            f'accuracy: [contact] law = "{scene.contact.law}" is defined by its macro step; take another law'
        )
    return _Search(scene, scene.accuracy).run()


@dataclass(frozen=True)
class _Pilot:
    """A run, and its number of macro steps where no event cuts them."""

    steps: float
    run: Trajectory

    @property
    def residual(self) -> float:
        return float(self.run.summary["max_energy_residual"])


@dataclass(frozen=True)
class _Estimate:
    """Errors of the finer one of two runs, relative as `pick` tells them."""

    displacement: float
    expected: float  #: ``displacement`` if the order of convergence holds
    event: float
    events: int
    apart: float  #: by how much the two differ in the larger of both


class _Search:
    def __init__(self, scene: Scene, accuracy: float) -> None:
        self._scene, self._accuracy = scene, accuracy
        self._span = scene.duration
        changes = {"scheme": "auto", "degree": 0, "macro_step": 1e-9 * self._span}
        taken = choice(with_changes(scene, accuracy=None, coupling=changes))  # where everything is resolved
        self._scheme, self._degree = taken.scheme, taken.degree
        self._softly = scene.coupled and not scene.contact.rigid and self._degree == 2
        self._spent: list[tuple[int, float]] = []  #: doStep calls and time [s] of each pilot run
        self._stopped = 0  #: pilot runs in a row that stopped early

    def run(self) -> Trajectory:
        coarse, estimate = None, None
        steps = self._first()
        while steps <= _MOST:
            fine = self._pilot(steps)
            if fine.run.summary["status"] != "done":
                steps = _rung(steps * _BLIND_GROWTH)
                continue
            if coarse is None:
                steps = self._second(fine)
            else:
                estimate = self._estimate(coarse, fine)
                worst = _SAFETY * max(estimate.displacement, estimate.event)
                if worst <= self._accuracy and estimate.apart <= _UNRESOLVED:
                    return self._told(fine.run, estimate)
                steps = self._next(fine, estimate)
            coarse = fine
        if estimate is None:
            found = f"a run that may do takes some {steps:.1g}"
        else:
            found = f"runs still differ by {estimate.apart:.1e}"
        beam, easier = self._scene.beam, ""
        if beam is not None and beam.fidelity == "dynamic":
            easier = ", take a coarser mesh" if beam.integrator == "modal" else ', take [beam] integrator = "modal"'
        raise SceneError(
            f"accuracy = {self._accuracy:g}: not reached with {_MOST} steps, {found}; ask for less{easier}, or shorten "
            "[time] t_end"
        )

    def _told(self, run: Trajectory, estimate: _Estimate) -> Trajectory:
        """Return ``run`` with what was picked and found in its summary."""
        coupling, spring = run.scene.coupling, run.scene.spring
        picked: dict[str, Any] = {"scheme": coupling.scheme, "degree": coupling.degree, "macro_step": coupling.H}
        if spring is not None:
            picked["ida_relative_tolerance"] = spring.relative_tolerance
        calls, times = zip(*self._spent[:-1], strict=True)
        accuracy = {
            "asked": self._accuracy,
            "picked": picked,
            "estimated_displacement_error": estimate.displacement,
            "estimated_event_error": estimate.event,
            "events_compared": estimate.events,
            "pilot_runs": len(calls),
            "pilot_steps": sum(calls),
            "pilot_time": sum(times),
        }
        # What a run says of its steps is a guess; two runs that agree know better.
        warnings = [warning for warning in run.summary["warnings"] if not warning.startswith("not resolved")]
        return replace(run, summary={**run.summary, "resolved": True, "warnings": warnings, "accuracy": accuracy})

    # -- how many steps ---------------------------------------------------------------------------------------------

    def _first(self) -> float:
        """Return the number of macro steps of the first run."""
        beam, spring, span = self._scene.beam, self._scene.spring, self._span
        if not self._scene.coupled and self._scene.stop is None and not self._scene.loads:
            return _FEWEST  # exact but for IDA
        of_load = max((load.rate for load in self._scene.loads), default=0.0)
        of_spring = max(of_load, 0.0 if spring is None else spring_frequency(self._scene))
        if beam is None:
            return _rung(max(of_spring * span / _ALONE, _PARTNERS if self._scene.partners else 0.0))
        if self._softly and not self._scene.partners:
            return _rung(max(contact_frequency(self._scene), of_spring) * span / (_CONTACT_TURN * self._accuracy**0.25))
        if beam.fidelity == "quasi_static":
            assert spring is not None
            return _rung(math.hypot(of_spring, 1.0 / math.sqrt(tip_compliance(beam) * spring.mass)) * span)
        turn = _ALONE if self._scene.lower is None else _TURN * self._accuracy ** (1.0 / _ORDER)
        return _rung(max(impact_frequency(beam), of_spring) * span / turn)

    def _second(self, first: _Pilot) -> float:
        growth = _BLIND_GROWTH if self._softly else _LEAST_GROWTH
        if self._scheme == "hermite":
            amplified = _AMPLIFIED if _parts(first.run) else 1.0
            growth = math.pow(amplified * first.residual / self._accuracy, 1.0 / _ORDER)
        return self._grown(first, growth)

    def _next(self, fine: _Pilot, estimate: _Estimate) -> float:
        """Return the number of steps of a run whose estimate, after ``estimate``, is expected to hold."""
        margin = _SAFETY**2 / self._accuracy
        return self._grown(fine, math.pow(margin * max(estimate.expected, estimate.event), 1.0 / _EXPECTED))

    def _grown(self, last: _Pilot, growth: float) -> float:
        return _rung(
            max(last.steps * min(max(growth, _LEAST_GROWTH), _MOST_GROWTH), last.run.do_steps / _CALLS_PER_STEP)
        )

    # -- runs ---------------------------------------------------------------------------------------------------------

    def _pilot(self, steps: float) -> _Pilot:
        """Run once. A pilot may stop early, since a finer one may not; raises RunStopped if that goes on."""
        coupling = {"scheme": self._scheme, "degree": self._degree, "macro_step": self._span / steps}
        tolerance = max(_SHARE * self._accuracy, _TIGHTEST)
        tables: dict[str, dict[str, Any]] = {"coupling": {**coupling, "tolerance": tolerance}}
        if self._scene.spring is not None:
            tables["spring"] = {"relative_tolerance": tolerance, "absolute_tolerance": _ABSOLUTE}
        scene = with_changes(self._scene, accuracy=None, **tables)
        recorder = MemoryRecorder(scene)
        try:
            runner.run(scene, recorder)
            self._stopped = 0
        except RunStopped:
            self._stopped += 1
            if self._stopped == _MOST_STOPPED:
                raise
        pilot = _Pilot(steps, recorder.trajectory())
        self._spent.append((pilot.run.do_steps, float(pilot.run.summary["wall_time"])))
        return pilot

    # -- how accurate they are ----------------------------------------------------------------------------------------

    def _estimate(self, coarse: _Pilot, fine: _Pilot) -> _Estimate:
        displacement = self._difference(coarse, fine)
        late, events = contact_time_difference(coarse.run, fine.run, 2.0 * self._span / coarse.steps)
        event = max(late / self._span, float(np.nan_to_num(impulse_difference(coarse.run, fine.run))))
        better, of_event = self._better(coarse, fine)
        if not self._softly and _parts(fine.run):  # what follows has the errors of the times at which ends part
            better = of_event
        expected = displacement / (better - 1.0)
        kinds, others = ([e.kind for e in pilot.run.events] for pilot in (coarse, fine))
        doubted = expected
        if kinds != others:  # no order holds through an event that only one of the two has
            doubted = max(expected, displacement / (fine.steps / coarse.steps - 1.0))
        return _Estimate(doubted, expected, event / (of_event - 1.0), events, max(displacement, event))

    def _better(self, coarse: _Pilot, fine: _Pilot) -> tuple[float, float]:
        """Return how many times as accurate ``fine`` is, in displacements and in times of events."""
        ratio, order = fine.steps / coarse.steps, _SOFT_ORDER if self._softly else _LOWEST
        if self._scheme == "hermite" and fine.residual > 0.0 < coarse.residual:
            seen = math.log(coarse.residual / fine.residual) / math.log(ratio)
            order = min(max(seen, _LOWEST), _ORDER)
        return ratio**order, ratio ** min(order, _OF_EVENTS)

    def _difference(self, coarse: _Pilot, fine: _Pilot) -> float:
        """Return the largest difference of tip or spring top, each relative to its own largest change.

        Compared are the rows of both, with soft laws all rows of ``coarse``: no step ends on an event, so that the
        dense output of ``fine`` is as smooth as the motion.
        """
        times, wanted = fine.run.time, coarse.run.time
        index = np.clip(np.searchsorted(times, wanted, "right") - 1, 0, len(times) - 2)
        index += np.abs(times[index + 1] - wanted) < np.abs(times[index] - wanted)
        common = np.abs(times[index] - wanted) <= 1e-9 * self._span
        common &= np.append(np.diff(wanted) > 0.0, True)  # of rows at one time the last: a massless tip may have jumped
        values, others = fine.run.columns, coarse.run.columns
        if self._softly:
            values, index = fine.run.at(np.clip(wanted, times[0], times[-1])).columns, np.arange(len(wanted))
            common = np.full(len(wanted), True)
        worst = 0.0
        for name in ("u_tip", "y"):
            if name not in fine.run.columns:
                continue
            scale = float(np.abs(fine.run[name] - fine.run[name][0]).max())
            if name == "u_tip" and self._scene.beam is not None:  # a tip held by the stop moves by rounding alone
                energy = float(np.abs(values["e_beam"]).max())
                scale = max(scale, _AT_REST * math.sqrt(2.0 * energy * tip_compliance(self._scene.beam)))
            scale = scale or 1.0
            difference = np.abs(others[name][common] - values[name][index[common]])
            worst = max(worst, float(difference.max(initial=0.0)) / scale)
        return worst


def _parts(run: Trajectory) -> bool:
    """Whether anything happens after the first contact."""
    return len({change.time for change in contact_changes(run, 0.0)}) > 1


def _rung(steps: float) -> float:
    """Round a number of macro steps up: four sizes an octave, so that any two runs have many times in common."""
    steps = max(steps, _FEWEST)
    unit = max(2.0 ** (math.floor(math.log2(steps)) - 2), 4.0)
    return unit * math.ceil(steps / unit * (1.0 - 1e-9))
