"""An accuracy instead of a scheme, a macro step and tolerances: steps become shorter until two runs agree.

Each run has steps 2.3 times as short as the one before, which is its companion (`springbeam.run.companion`). The error
is that of the coupling and the time integration, for the scene's own mesh and modes: these are the model. (Impacts on
the foundation converge only slowly with the mesh, since what they meet is the mass of its tip.)
"""

from __future__ import annotations

from math import inf
from typing import Any

from ..results.judged import WORDS
from ..results.trajectory import Trajectory
from ..scene import Scene, SceneError, with_changes
from .companion import LIMITS, LONGER, Check, compared
from .outcome import Progress, RunStopped
from .runner import run_in_memory

#: Macro steps of the first run, and the most.
_FEWEST = 8.0
_MOST = 50_000.0
#: The parts of a `Distance` that an accuracy bounds.
KEPT = ("motion", "times", "impulses", "force")
#: The coupling's and IDA's relative tolerance over the accuracy.
_TOLERANCE = 1e-3


def pick(scene: Scene, progress: Progress | None = None) -> Check:
    """Return a run of ``scene`` that keeps its ``accuracy``, judged; its scene has the settings that were picked.

    ``progress``: as of `springbeam.simulate`. ``accuracy`` of the summary has the settings and the cost of the others.

    Raises
    ------
    SceneError
        If the accuracy cannot be reached; the message says what failed, and how far it was.
    RunStopped
        If the run with these settings would stop early.
    """
    assert scene.accuracy is not None
    asked = scene.accuracy
    steps = _FEWEST
    pilots: list[Trajectory] = []
    coarse: Trajectory | None = None
    check: Check | None = None
    agreed = False
    while steps <= _MOST:
        try:
            fine = run_in_memory(prepared(scene, scene.duration / steps), progress)
        except RunStopped as error:
            if steps * LONGER > _MOST or error.run is None:
                raise
            pilots.append(error.run)
            coarse = None
            check = None
            agreed = False
            steps *= LONGER
            continue
        if coarse is not None:
            check = compared(fine, coarse, LONGER, float(coarse.summary["wall_time"]))
            # Runs that are far too coarse may agree by chance, so that those before it have to be near each other, too.
            if agreed and _worst(check)[1] <= asked and fine.summary["resolved"] is not False:
                return _with_settings(check, asked, pilots)
            agreed = all(check.errors[name] <= getattr(LIMITS, name) for name in KEPT if name in check.errors)
        pilots.append(fine)
        coarse = fine
        steps *= LONGER
    if check is None:
        reached = f"runs in up to {steps / LONGER:.0f} steps stop early"
    else:
        name, least = _worst(check)
        reached = f"the error of {WORDS[name]} is up to {least:.1e}"
        if least <= asked:
            reached = "; ".join(text for text in check.run.summary["warnings"] if text.startswith("not resolved"))
    undamped = scene.beam is not None and not scene.massless and scene.beam.alpha_b == 0.0
    damped = ", damp the beam ([beam] alpha_b)" * undamped
    raise SceneError(
        f"accuracy = {asked:g}: not reached with {_MOST:.0f} steps: {reached}; ask for less{damped}, take a coarser "
        "mesh or fewer modes, or shorten [time] t_end"
    )


def _worst(check: Check) -> tuple[str, float]:
    """Return the largest error that an accuracy bounds, and its name."""
    return max(((name, check.errors.get(name, -inf)) for name in KEPT), key=lambda pair: pair[1])


def prepared(scene: Scene, macro_step: float) -> Scene:
    """Return ``scene`` with a macro step [s] and the scheme and tolerances that go with its accuracy."""
    assert scene.accuracy is not None
    tolerance = _TOLERANCE * scene.accuracy
    coupling = {"macro_step": macro_step} | ({} if scene.coupling.exchanges else {"tolerance": tolerance})
    if scene.spring is None:
        return with_changes(scene, accuracy=None, coupling=coupling)
    ida = {"relative_tolerance": tolerance, "absolute_tolerance": 1e-30}
    return with_changes(scene, accuracy=None, coupling=coupling, spring=ida)


def _with_settings(check: Check, asked: float, pilots: list[Trajectory]) -> Check:
    """Return ``check``, whose run has in its summary what was picked and what it has cost."""
    run = check.run
    coupling = run.scene.coupling
    spring = run.scene.spring
    picked: dict[str, Any] = {"scheme": coupling.scheme, "degree": run.summary["degree"], "macro_step": coupling.H}
    if spring is not None:
        picked["ida_relative_tolerance"] = spring.relative_tolerance
    run.summary["accuracy"] = {
        "asked": asked,
        "picked": picked,
        "pilot_runs": len(pilots),
        "pilot_steps": sum(pilot.do_steps for pilot in pilots),
        "pilot_time": sum(float(pilot.summary["wall_time"]) for pilot in pilots),
    }
    return check
