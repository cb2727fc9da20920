"""An accuracy instead of a scheme, a macro step and tolerances: the macro step is halved until two runs agree.

The error is that of the coupling and the time integration, for the scene's own mesh and modes: these are the model.
(Impacts on the foundation converge only slowly with the mesh, since what they meet is the mass of its tip.)
What is compared, and what two runs that agree cannot know, is in ``docs/choose.md``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..bodies.factory import load_bodies
from ..bodies.protocol import Body
from ..results.distance import distance
from ..results.trajectory import Trajectory
from ..run import runner
from ..run.ledger import CHANGED
from ..run.outcome import Progress, RunStopped
from ..run.resolution import LAW_MISSED, NOT_RESOLVED
from ..run.setup import Setup, set_up
from ..scene import Scene, SceneError, as_scene, with_changes
from ..scene.frequencies import DIES_OUT
from ..scene.laws import stiffest

#: Fewest and most macro steps of a run.
_FEWEST, _MOST = 8.0, 50_000
#: Accuracy that a run in the largest resolved steps has, about, and the order of its error, both at degree 2.
_SHARP, _ORDER = 1e-6, 6.0
#: Angle that a soft contact may turn in a macro step of degree 2 [rad].
_CONTACT_TURN = 2.0
#: Angle that the fastest lasting wave may turn in a macro step of the first run that may do [rad].
_WAVE_TURN = 3.0
#: An estimate of the error is to be so many times smaller than the accuracy.
_SAFETY = 1.5
#: The coupling's and IDA's relative tolerance over the accuracy.
_TOLERANCE = 1e-3


def simulate(
    scene: Scene | Mapping[str, Any] | str | Path,
    progress: Progress | None = None,
    *,
    upper: Body | None = None,
    lower: Body | None = None,
) -> Trajectory:
    """Co-simulate ``scene``, with settings that keep its ``accuracy`` if it asks for one, and return the trajectory.

    Parameters
    ----------
    scene
        What is simulated: a scene, its tables as dictionaries, a file, or the name of a shipped scene.
    progress
        Called with time [s], phase and number of macro steps once per accepted step; with an accuracy, in each of the
        runs that are made for it.
    upper, lower
        Bodies of the caller at the start of the run, in place of the beam and of the spring: `springbeam.Body`.

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
    scene = as_scene(scene)
    if scene.accuracy is None or upper is not None or lower is not None:
        return runner.run_in_memory(scene, progress, upper=upper, lower=lower)
    return pick(scene, progress)


def simulate_to(scene: Scene, time: float) -> Trajectory:
    """Co-simulate ``scene`` at least up to ``time`` [s], or to its end; return the trajectory, maybe without summary.

    With an ``accuracy`` the run is whole. Raises the same errors as `simulate`.
    """
    if scene.accuracy is not None:
        return pick(scene)
    with runner.Simulation(scene) as simulation:
        return simulation.reach(time)


def pick(scene: Scene, progress: Progress | None = None) -> Trajectory:
    """Return a run of ``scene`` that keeps its ``accuracy``; its scene has the settings that were picked.

    ``progress``: as of `simulate`.

    ``accuracy`` of its summary has the settings, with an estimate of each part of the `distance`; that of
    the motion is at least how far the run misplaces its ends (`springbeam.run.misplaced`).

    Raises
    ------
    SceneError
        If it cannot be reached; the message says how far it was.
    RunStopped
        If the run with these settings would stop early.
    """
    assert scene.accuracy is not None
    asked = scene.accuracy
    steps = _first(scene)
    pilots: list[Trajectory] = []
    coarse: Trajectory | None = None
    before: dict[str, float] = {}
    errors: dict[str, float] = {}
    agreed = False
    while steps <= _MOST:
        pilot = prepared(scene, scene.duration / steps)
        steps *= 2.0
        try:
            fine = runner.run_in_memory(pilot, progress)
        except RunStopped as error:
            if steps > _MOST or error.run is None:
                raise
            pilots.append(error.run)
            coarse = None
            before = {}
            errors = {}
            agreed = False
            continue
        if coarse is not None:
            before, errors = _estimated(coarse, fine, asked, before)
            agrees = _SAFETY * max(errors.values()) <= asked
            # A run with doubts that are not in the estimate needs one more halving: the runs may agree by chance.
            if agrees and (agreed or not _doubts(fine)):
                return _coarsest(scene, coarse, fine, errors, pilots, progress)
            agreed = agrees
        pilots.append(fine)
        coarse = fine
    worst = max(errors, key=lambda name: errors[name], default="")
    reached = f"the error of {worst} is about {errors[worst]:.1e}" if worst else f"a run that may do takes {steps:.1g}"
    raise SceneError(
        f"accuracy = {asked:g}: not reached with {_MOST} steps, {reached}; ask for less, take a coarser mesh or fewer "
        "modes, or shorten [time] t_end"
    )


def _coarsest(
    scene: Scene,
    coarse: Trajectory,
    fine: Trajectory,
    errors: dict[str, float],
    pilots: list[Trajectory],
    progress: Progress | None,
) -> Trajectory:
    """Return the run with the fewest steps that keeps the accuracy of ``scene``, ``fine`` or a coarser one.

    ``fine`` keeps it with these ``errors``, ``coarse`` is the last of the ``pilots``. The error of a coarser run is its
    distance from ``fine`` and the error of that.
    """
    assert scene.accuracy is not None
    asked = scene.accuracy
    known = {run.scene.coupling.H: run for run in pilots if run.summary["status"] == "done"}
    others = [*pilots]
    found = fine
    found_errors = errors
    while True:
        apart = _apart(coarse, fine, asked)
        beside = _with_own({name: part + errors[name] for name, part in apart.items()}, coarse)
        if _SAFETY * max(beside.values()) > asked or _doubts(coarse):
            break
        found = coarse
        found_errors = beside
        H = 2.0 * coarse.scene.coupling.H
        if scene.duration < _FEWEST * H:
            break
        try:
            coarse = known.get(H) or runner.run_in_memory(prepared(scene, H), progress)
        except RunStopped:
            break
        if H not in known:
            others.append(coarse)
    if found is not fine:
        others = [fine, *(run for run in others if run is not found)]
    return _with_errors(found, asked, found_errors, others)


def _apart(run: Trajectory, fine: Trajectory, short: float) -> dict[str, float]:
    """Return the `distance` of two runs by its parts; ``short`` as of `_estimated`."""
    parts = distance(run, fine, short * float(fine.time[-1] - fine.time[0]))._asdict()
    return {name: part for name, part in parts.items() if part is not None}


def _with_own(errors: dict[str, float], run: Trajectory) -> dict[str, float]:
    """Return ``errors`` of ``run`` that are at least those which it shows alone.

    Runs that share a step, as from an event to a macro point, agree on its curve whether it is right or not.
    """
    found = {**errors, "motion": max(errors["motion"], run.summary.get("misplaced_ends", 0.0))}
    if "force" in errors:
        found["force"] = max(errors["force"], run.summary.get("contact_force_max_error", 0.0))
    return found


def _estimated(
    coarse: Trajectory, fine: Trajectory, short: float, before: dict[str, float]
) -> tuple[dict[str, float], dict[str, float]]:
    """Return the `distance` of two runs by its parts, and with it the error of the finer one: D/(2ᵖ − 1).

    The order p is what this distance and that ``before`` show, 1 … 2; 1 where there is none. Times of contacts that
    agree better than at order 2 after those ``before`` may agree by chance: their error is that at order 2. Contacts
    shorter than the share ``short`` of the run are no evidence. The error of a peak force is at least that which a run
    shows beside its law.
    """
    apart = _apart(coarse, fine, short)
    errors = {}
    for name, now in apart.items():
        then = before.get(name)
        order = min(max(math.log2(then / now), 1.0), 2.0) if then and now else 1.0
        errors[name] = now / (2.0**order - 1.0)
    errors["times"] = max(errors["times"], before.get("times", 0.0) / 12.0)  # D/(2² − 1), and four times less
    return apart, _with_own(errors, fine)


def _first(scene: Scene) -> float:
    """Return the number of macro steps of the first run.

    It is half as many as a run needs that calls itself resolved; with joined ends fewer for a loose accuracy, by the
    order of their error: else the first run would have steps far smaller than it needs.
    """
    setup = set_up(scene)
    bodies = [body for body in load_bodies(scene, setup.start, setup.degree)[:2] if body is not None]
    try:
        fastest = max([*_rates(setup, bodies), *(load.rate for load in setup.loads)], default=0.0)
    finally:
        for body in bodies:
            body.close()
    steps = 0.5 * fastest * (setup.end - setup.start)
    assert scene.accuracy is not None
    if setup.law is not None:
        steps *= float(_SHARP / max(scene.accuracy, _SHARP)) ** (1.0 / _ORDER)
    return max(_FEWEST, math.ceil(steps))


def _rates(setup: Setup, bodies: Sequence[Body]) -> Iterator[float]:
    """Yield the frequencies that macro steps follow [rad/s], each over the angle that it may turn in one."""
    for body in bodies:
        omega, ratio = body.oscillation() or (0.0, 0.0)
        if ratio < 1.0:
            yield omega
    known = [body.stiffness(body.motion().displacement) for body in bodies]
    if None in known:
        return
    if setup.soft is not None:
        stored = sum(sum(body.energies()[:2]) for body in bodies)
        yield math.sqrt(stiffest(setup.soft, stored) * sum(1.0 / body.inertia for body in bodies)) / _CONTACT_TURN
    elif bodies[0].massless:
        yield math.sqrt(sum(known) / bodies[-1].mass) / _CONTACT_TURN if len(bodies) > 1 else 0.0
    elif setup.law is not None or setup.floor is not None:
        yield _lasting(bodies[0]) / _WAVE_TURN


def _lasting(body: Body) -> float:
    """Return the highest frequency of a body whose waves do not die out at once [rad/s]."""
    stiffness, damping, _ = body.modes() or (np.zeros(1), np.zeros(1), None)
    omega = np.sqrt(np.maximum(stiffness, 0.0))
    return float(np.max(omega[damping <= DIES_OUT * omega], initial=0.0))


def prepared(scene: Scene, macro_step: float) -> Scene:
    """Return ``scene`` with a macro step [s] and the scheme and tolerances that go with its accuracy."""
    assert scene.accuracy is not None
    tolerance = _TOLERANCE * scene.accuracy
    coupling = {"macro_step": macro_step} | ({} if scene.coupling.exchanges else {"tolerance": tolerance})
    if scene.spring is None:
        return with_changes(scene, accuracy=None, coupling=coupling)
    ida = {"relative_tolerance": tolerance, "absolute_tolerance": 1e-30}
    return with_changes(scene, accuracy=None, coupling=coupling, spring=ida)


def _with_errors(run: Trajectory, asked: float, errors: dict[str, float], pilots: list[Trajectory]) -> Trajectory:
    """Return ``run`` with what was picked and found in its summary.

    What a scheme has changed of the energy is a doubt about the motion; runs that agree have settled it.
    """
    coupling = run.scene.coupling
    spring = run.scene.spring
    picked: dict[str, Any] = {"scheme": coupling.scheme, "degree": run.summary["degree"], "macro_step": coupling.H}
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
    warnings = [warning for warning in run.summary["warnings"] if not _settled(warning)]
    return replace(
        run, summary={**run.summary, "accuracy": accuracy, "warnings": warnings, "resolved": not _doubts(run)}
    )


def _doubts(run: Trajectory) -> list[str]:
    """Return why ``run`` is not resolved, without what runs that agree settle."""
    unresolved = (warning for warning in run.summary["warnings"] if warning.startswith(NOT_RESOLVED))
    return [warning for warning in unresolved if not _settled(warning)]


def _settled(warning: str) -> bool:
    """Return whether runs that agree settle ``warning``: of changed energy, and of forces that differ from the law.

    How far these misplace an end is part of the estimate of the error.
    """
    return CHANGED in warning or LAW_MISSED in warning
