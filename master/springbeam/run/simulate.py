"""Run a scene and judge the run: what programs and commands call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..bodies.protocol import Body
from ..results.trajectory import Trajectory
from ..scene import Scene, as_scene, with_changes
from . import companion, runner
from .accuracy import pick
from .companion import Check
from .outcome import Progress


def simulate(
    scene: Scene | Mapping[str, Any] | str | Path,
    progress: Progress | None = None,
    *,
    accuracy: float | None = None,
    times: Sequence[float] | np.ndarray | None = None,
    upper: Body | None = None,
    lower: Body | None = None,
    check: bool = True,
) -> Trajectory:
    """Co-simulate ``scene``, with settings that keep its ``accuracy`` if it asks for one, and return the trajectory.

    Parameters
    ----------
    scene
        What is simulated: a scene, its tables as dictionaries, a file, or the name of a shipped scene.
    progress
        Called with time [s], phase and number of macro steps once per accepted step; also in the companion run, and
        with an accuracy in each of the runs that are made for it.
    accuracy
        Takes the place of the scene's own.
    times
        Times of the rows [s], as of `Trajectory.at`. Default: those of the steps.
    upper, lower
        Bodies of the caller at the start of the run, in place of the beam and of the spring: `springbeam.Body`. They
        are at its end afterwards.
    check
        Whether to judge the run by a companion in longer steps (`springbeam.check`): 1.4 times the time. Without,
        ``resolved`` of its summary is ``None``.

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
    if accuracy is not None:
        scene = with_changes(scene, accuracy=accuracy)
    run = _run(scene, progress, upper, lower, check=check)
    return run if times is None else run.at(times)


def _run(scene: Scene, progress: Progress | None, upper: Body | None, lower: Body | None, *, check: bool) -> Trajectory:
    if scene.accuracy is not None and upper is None and lower is None:
        return pick(scene, progress).judged_run()
    own = {"beam": upper, "spring": lower}
    starts = {table: body.state for table, body in own.items() if isinstance(body, Body)}
    run = runner.run_in_memory(scene, progress, upper=upper, lower=lower)
    if not check:
        return run
    if stuck := [table for table, state in starts.items() if state is None]:
        why = f"the body in place of the {' and the '.join(stuck)} has no state to which it could return"
        return Check(run, None, {}, 0.0, 0.0, f"not judged: {why}").judged_run()
    return _check_from(starts, run, progress, upper=upper, lower=lower).judged_run()


def _check_from(
    starts: Mapping[str, Any], run: Trajectory, progress: Progress | None, *, upper: Body | None, lower: Body | None
) -> Check:
    """Check a run whose bodies of the caller's return to their states at its start, and then to those at its end."""
    bodies = [body for body in (upper, lower) if body is not None]
    ends = [body.state for body in bodies]
    for body, state in zip(bodies, starts.values(), strict=True):
        body.state = state
    try:
        return companion.check(run, progress, upper=upper, lower=lower)
    finally:
        for body, state in zip(bodies, ends, strict=True):
            body.state = state


def checked(scene: Scene) -> Check:
    """Co-simulate ``scene`` and judge the run; raises the same errors as `simulate`."""
    return companion.check(runner.run_in_memory(scene)) if scene.accuracy is None else pick(scene)


def simulate_to(scene: Scene, time: float) -> Trajectory:
    """Co-simulate ``scene`` at least up to ``time`` [s], or to its end; return the trajectory, maybe without summary.

    With an ``accuracy`` the run is whole. Raises the same errors as `simulate`; the run is not judged.
    """
    if scene.accuracy is not None:
        return pick(scene).run
    with runner.Simulation(scene) as simulation:
        return simulation.reach(time)
