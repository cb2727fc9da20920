"""An accuracy instead of a scheme, a macro step and tolerances: the macro step is halved until two runs agree.

The error is that of the coupling and the time integration, for the scene's own mesh and modes: these are the model.
(Impacts on the foundation converge only slowly with the mesh, since what they meet is the mass of its tip.)
What is compared, and what two runs that agree cannot know, is in ``docs/accuracy.md``.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from ..bodies.protocol import Body
from ..results.contact_times import contact_time_difference, impulse_difference
from ..results.trajectory import Trajectory
from ..run import runner
from ..run.ledger import CHANGED
from ..run.misplaced import HELD
from ..run.outcome import Progress, RunStopped
from ..scene import Scene, SceneError, with_changes
from ..scene.resolution import STABLE, TURN, choice, joined_frequency, lasting_frequency, slow_oscillations
from .metrics import motion_errors, worst

#: Fewest and most macro steps of a run.
_FEWEST, _MOST = 8.0, 50_000
#: Angle that a soft contact may turn in a macro step of degree 2 [rad].
_CONTACT_TURN = 2.0
#: An estimate of the error is to be so many times smaller than the accuracy.
_SAFETY = 1.5
#: The coupling's and IDA's relative tolerance over the accuracy.
_TOLERANCE = 1e-3
#: Shares of the time from one row to the next, of either run, at which two runs are compared.
_BETWEEN = np.arange(4.0) / 4.0


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

    ``accuracy`` of its summary says what was asked and picked, with an estimate of each error of `differences`; that of
    the motion is at least how far the run misplaces its ends (`springbeam.run.misplaced`).

    Raises
    ------
    SceneError
        If it cannot be reached; the message says how far it was.
    RunStopped
        If the run with these settings would stop early.
    """
    assert scene.accuracy is not None
    asked, steps = scene.accuracy, _first(scene)
    pilots: list[Trajectory] = []
    coarse: Trajectory | None = None
    before: dict[str, float] = {}
    while steps <= _MOST:
        prepared = _prepared(scene, scene.duration / steps)
        steps *= 2.0
        try:
            fine = runner.simulate(prepared)
        except RunStopped as error:
            if steps > _MOST or error.run is None:
                raise
            pilots.append(error.run)
            coarse, before = None, {}
            continue
        if coarse is not None:
            before, errors = _estimated(coarse, fine, asked, before)
            # Runs that share a step, as from an event to a macro point, agree on its curve whether it is right or not.
            errors["motion"] = max(errors["motion"], fine.summary["misplaced_ends"])
            if _SAFETY * max(errors.values()) <= asked:
                return _told(fine, asked, errors, pilots)
        pilots.append(fine)
        coarse = fine
    reached = f"runs still differ by {max(before.values()):.1e}" if before else f"a run that may do takes {steps:.1g}"
    raise SceneError(
        f"accuracy = {asked:g}: not reached with {_MOST} steps, {reached}; ask for less, take a coarser mesh or fewer "
        "modes, or shorten [time] t_end"
    )


def differences(coarse: Trajectory, fine: Trajectory, short: float) -> dict[str, float]:
    """Return how far two runs of a scene are apart, relatively.

    ``motion``: u_tip or y at any time, over its largest change; ``times``: of contacts, over the time that is run;
    ``impulses``: of all impacts, over their sum; ``force``: the peak of a soft contact force, a mean over its window.
    Contacts and flights shorter than the share ``short`` of that time are no evidence.
    """
    span = float(fine.time[-1] - fine.time[0])
    rows = np.union1d(coarse.time, fine.time)
    times = np.append((rows[:-1, None] + _BETWEEN * np.diff(rows)[:, None]).ravel(), rows[-1])
    held = 0.0 if fine.shapes is None else HELD * float(np.abs(fine.shapes[1]).max(initial=0.0))
    impulses = [impulse_difference(coarse, fine), impulse_difference(fine, coarse)]
    found = {
        "motion": worst(motion_errors(coarse.at(times).columns, fine.at(times), held)),
        "times": contact_time_difference(coarse, fine, short * span) / span,
        "impulses": max(np.nan_to_num(impulses).tolist()),
    }
    if not fine.scene.contact.rigid and "contact_force_max" in fine.summary:
        peak, other = (float(run.summary["contact_force_max"]) for run in (fine, coarse))
        found["force"] = abs(peak - other) / (max(peak, other) or 1.0)
    return found


def _estimated(
    coarse: Trajectory, fine: Trajectory, short: float, before: dict[str, float]
) -> tuple[dict[str, float], dict[str, float]]:
    """Return the `differences` of two runs, and with them the error of the finer one: D/(2ᵖ − 1).

    The order p is what these differences and those ``before`` show, 1 … 2; 1 where there are none.
    """
    apart, errors = differences(coarse, fine, short), {}
    for name, now in apart.items():
        then = before.get(name)
        order = min(max(math.log2(then / now), 1.0), 2.0) if then and now else 1.0
        errors[name] = now / (2.0**order - 1.0)
    return apart, errors


def _first(scene: Scene) -> float:
    """Return the number of macro steps of the first run: half as many as one needs that calls itself resolved."""
    rates = [omega / TURN for _, omega, _ in slow_oscillations(scene)]
    if scene.beam is not None and not scene.partners:
        if scene.coupled and not scene.contact.rigid:
            from .stability.predict import contact_frequency  # takes a second to load: only for who has a soft contact

            rates.append(contact_frequency(scene) / _CONTACT_TURN)
        elif scene.massless:
            rates.append(joined_frequency(scene) / _CONTACT_TURN)
        elif scene.coupled or scene.stop is not None:
            rates.append(lasting_frequency(scene.beam) / STABLE)
    return max(_FEWEST, math.ceil(0.5 * max(rates, default=0.0) * scene.duration))


def _prepared(scene: Scene, macro_step: float) -> Scene:
    """Return ``scene`` with a macro step [s] and the scheme and tolerances that go with its accuracy."""
    assert scene.accuracy is not None
    resolved = {"scheme": "auto", "degree": 0, "macro_step": 1e-9 * scene.duration}
    taken, tolerance = choice(with_changes(scene, accuracy=None, coupling=resolved)), _TOLERANCE * scene.accuracy
    coupling = {"scheme": taken.scheme, "degree": taken.degree, "macro_step": macro_step, "tolerance": tolerance}
    if scene.spring is None:
        return with_changes(scene, accuracy=None, coupling=coupling)
    ida = {"relative_tolerance": tolerance, "absolute_tolerance": 1e-30}
    return with_changes(scene, accuracy=None, coupling=coupling, spring=ida)


def _told(run: Trajectory, asked: float, errors: dict[str, float], pilots: list[Trajectory]) -> Trajectory:
    """Return ``run`` with what was picked and found in its summary.

    What a scheme has changed of the energy is a doubt about the motion; runs that agree have settled it.
    """
    coupling, spring = run.scene.coupling, run.scene.spring
    picked: dict[str, Any] = {"scheme": coupling.scheme, "degree": coupling.degree, "macro_step": coupling.H}
    if spring is not None:
        picked["ida_relative_tolerance"] = spring.relative_tolerance
    accuracy = {
        "asked": asked,
        "picked": picked,
        "estimated_errors": errors,
        "pilot_runs": len(pilots),
        "pilot_steps": sum(pilot.do_steps for pilot in pilots),
        "pilot_time": sum(float(pilot.summary["wall_time"]) for pilot in pilots),
    }
    warnings = [warning for warning in run.summary["warnings"] if CHANGED not in warning]
    resolved = not any(warning.startswith("not resolved") for warning in warnings)
    return replace(run, summary={**run.summary, "accuracy": accuracy, "warnings": warnings, "resolved": resolved})
