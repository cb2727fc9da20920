"""Run a cell of the grid of extreme scenes, and put its outcome into a class.

===========  ==========================================================================================================
conserved    done, energy constant to `ledger.EXACT`, nothing lost
dissipative  done, energy plus booked losses constant to `ledger.EXACT`; or a numerically damped beam (``rho_inf`` < 1)
             that has only lost energy
approximate  done, energy changed by more: within the bound of its scheme (`ledger.bounds`), or the run says so
refused      a scene that cannot be run, with the reason
stopped      ended early, with the cause
garbage      anything else: a run that calls itself resolved and is far from the event-driven reference; a coupling that
             changes no energy and has changed it; energy changed without a warning, numbers that are not finite, bodies
             that overlap, damping that returns energy, a crash
===========  ==========================================================================================================
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from itertools import chain, count
from typing import Any

import numpy as np

from ...bodies.protocol import FmuError
from ...monolithic import event_driven
from ...results.recording import MemoryRecorder
from ...results.trajectory import Trajectory
from ...run.ledger import EXACT, bounds
from ...run.outcome import RunStopped
from ...run.runner import run
from ...scene import Scene, SceneError, scene_from_dict, with_changes
from ...scene.automatic import with_scheme_chosen
from ..comparison import PERTURBATION, initial_speed
from ..metrics import motion_errors, worst
from ..study import Row
from .cells import scene_dict

#: In the order in which pictures and tables show them; the last must stay empty.
CLASSES = ("conserved", "dissipative", "approximate", "refused", "stopped", "garbage")
#: A run is cut after this many accepted steps: a contact that opens and closes in every macro step.
_MOST_STEPS = 600
#: Bodies may overlap or, joined, part by so much of their motion.
_OVERLAP = 1e-9
#: A coupling that changes no energy, at whatever step, may change it by so much of the largest before it is wrong: what
#: rounding leaves of a gap costs energy where the force of a step is very large.
_GUARANTEED = 1e-6
#: What is resolved may be off by so much of its motion, unless a change of the initial velocity changes the motion by
#: more than so many times as much.
_RESOLVED, _WELL_CONDITIONED = 0.05, 100.0
#: Times at which a resolved cell is compared with the reference, and how long that may take [s].
_COMPARED, _PATIENCE = 60, 60.0
#: Rounding of a sum of energies, of the largest so far.
_SLACK = 1e-10


class _Enough(BaseException):
    """The cell has taken all the steps that it may; no error, which a run would turn into a stop."""


def ended(kind: str, reason: str = "") -> Row:
    """Return the record of a cell that ended as one of `CLASSES`.

    ``reason``: refused, stopped, garbage: why; approximate: the run's warnings. ``residual``: the largest energy
    residual over the largest energy until then; ``overlap`` of bodies, or the gap of joined ones, over the largest
    motion; ``resolved``: whether the run calls itself so; ``error_motion`` of u_tip and y beside the reference, over
    their largest changes, of what is resolved and well-conditioned.
    """
    told: Row = dict.fromkeys(("residual", "overlap", "error_motion"))
    return {"kind": kind, "reason": reason, **told, "resolved": False, "macro_steps": 0, "events": 0}


def run_cell(cell: dict[str, Any]) -> Row:
    """Run a cell and return how it ended."""
    try:
        scene = scene_from_dict(scene_dict(cell), source="cell")
    except SceneError as error:
        return ended("refused", str(error))
    recorder, accepted, cause = MemoryRecorder(scene), count(1), ""

    def enough(*_: object) -> None:
        if next(accepted) >= _MOST_STEPS:
            raise _Enough

    try:
        run(scene, recorder, enough)
    except FmuError as error:
        return ended("refused", str(error))
    except RunStopped as stopped:
        cause = stopped.cause
    except _Enough:
        pass
    found = recorder.trajectory()
    if "traceback" in found.summary:  # an error that nobody foresaw
        return ended("garbage", f"crashed: {cause}")
    outcome = judged(found, cause)
    if outcome["resolved"] and outcome["kind"] not in ("stopped", "garbage"):
        outcome["error_motion"] = off = _error(found)
        if off is not None and off > _RESOLVED:
            why = f"calls itself resolved, and is {off:.1e} of its motion off the reference"
            outcome |= {"kind": "garbage", "reason": why}
    return outcome


def _error(run: Trajectory) -> float | None:
    """Return the error of ``run``; ``None`` without a reference, or if it is large and the motion ill-conditioned."""
    scene, end = run.scene, float(run.time[-1])
    times = np.linspace(float(run.time[0]), end, _COMPARED)
    if end <= times[0]:
        return None

    def solved(scene: Scene, change: float = 0.0) -> Trajectory:
        return event_driven.simulate(
            scene, sample_times=times, t_end=end, time_limit=_PATIENCE, velocity_perturbation=change
        )

    try:
        exact = solved(scene)
        error = worst(motion_errors(run.at(exact.time).columns, exact))
        if error <= _RESOLVED:
            return error
        change = PERTURBATION * initial_speed(scene)
        moved = chain([solved(scene, change)], map(solved, _spring_pushed(scene, change)))
        few = _WELL_CONDITIONED * PERTURBATION
        return error if all(worst(motion_errors(other.columns, exact)) <= few for other in moved) else None
    except (ValueError, event_driven.ReferenceFailure):
        return None


def _spring_pushed(scene: Scene, change: float) -> Iterator[Scene]:
    """Yield a pair whose spring starts with a little less and more velocity, where it may have any.

    A spring that the tip meets a little above Ψ is met a little below it, where another phase follows.
    """
    if scene.spring is None or scene.beam is None:
        return
    start, speed = scene.spring.initial_velocity, change * scene.beam.length
    for velocity in (start - speed, start + speed):
        with suppress(SceneError):  # a spring that is kept still until the tip has come
            yield with_changes(scene, spring={"initial_velocity": velocity})


def judged(run: Trajectory, cause: str = "") -> Row:
    """Return the class of a run that is done, or has stopped for ``cause``, from what it recorded."""
    counts = {name: run.summary[name] for name in ("macro_steps", "events")}
    if len(run.time) == 0:
        return ended("stopped", cause) | counts
    scale, overlap = _energy_scale(run), _overlap(run)
    relative = np.divide(run.energy_residual, scale, out=np.zeros_like(scale), where=scale > 0.0)
    measured = {
        "residual": float(np.abs(relative).max()),
        "overlap": overlap,
        "resolved": bool(run.summary["resolved"]),
    }
    return ended(*_class(run, cause, relative, scale, overlap)) | counts | measured


def _class(run: Trajectory, cause: str, relative: np.ndarray, scale: np.ndarray, overlap: float) -> tuple[str, str]:
    """Return the class of a run and why, by its relative residuals, the scale of its energy and its overlap."""
    scene, _ = with_scheme_chosen(run.scene)
    residual = float(np.abs(relative).max())
    damped = scene.beam is not None and scene.beam.damped_numerically
    keeps = scene.coupling.scheme == "energy" and not scene.contact.algorithm
    if keeps and not damped and residual > _GUARANTEED:
        return "garbage", f"energy residual {residual:.1e} of a coupling that changes none; {cause}"
    if cause:
        return "stopped", cause
    if faults := list(_faults(run, overlap, scale)):
        return "garbage", "; ".join(faults)
    if residual <= EXACT:
        lost = run.e_dissipated[-1] + run.e_impact_loss[-1]
        return "dissipative" if lost > EXACT * scale[-1] else "conserved", ""
    if keeps and damped and relative.max() <= EXACT:
        return "dissipative", ""
    said = [text for text in run.summary["warnings"] if "energy" in text]
    if said or residual <= bounds(scene)[0]:
        return "approximate", "; ".join(said)
    return "garbage", f"energy residual {residual:.1e}, and nothing says so"


def _energy_scale(run: Trajectory) -> np.ndarray:
    """Return the largest energy until each row [J], as in `springbeam.run.ledger.errors`."""
    mechanical = sum(np.abs(run[name]) for name in ("e_beam", "e_spring", "e_contact") if name in run.columns)
    return np.maximum.accumulate(np.maximum(mechanical, abs(run.e_total[0])))


def _faults(run: Trajectory, overlap: float, scale: np.ndarray) -> Iterator[str]:
    """Yield what must not be, whatever the scene."""
    for name, values in run.columns.items():
        if name != "phase" and not np.all(np.isfinite(values)):
            yield f"{name} is not finite"
    beam, booked = run.scene.beam, {"damping": run.e_dissipated, "impacts": run.e_impact_loss}
    if beam is not None and beam.damped_numerically:
        del booked["damping"]  # what it takes over an unresolved generalized-α step is exact, but of no sign
    if run.scene.contact.impact == "tip":
        del booked["impacts"]
    for what, energy in booked.items():
        change = np.diff(energy)
        if np.any(change < -_SLACK * scale[1:]):
            gives = "gives" if what == "damping" else "give"
            yield f"{what} {gives} energy back: {change.min() / scale[-1]:.1e} of the largest"
    if np.any(np.diff(run.time) < 0.0):
        yield "time runs backwards"
    if overlap > _OVERLAP:
        yield f"the bodies overlap or part by {overlap:.1e} of their motion"


def _overlap(run: Trajectory) -> float:
    """Return the largest overlap of bodies that may not, over the largest deflection or motion in a step."""
    scene, overlap = run.scene, 0.0
    positions = [run[name] for name in ("u_tip", "y") if name in run.columns]
    if run.shapes is not None and len(run.shapes[0]):
        positions.append(run.shapes[1])  # the tip is as exact as the largest deflection, however little it moves
    speeds = [run[name] for name in ("v_tip", "z") if name in run.columns]
    motion, moved = (max(float(np.abs(values).max()) for values in several) for several in (positions, speeds))
    motion += scene.coupling.H * moved
    if scene.contact.rigid and scene.coupled:
        joined = np.isin(run.phase, ("tied", "touch"))
        overlap = float(np.max(np.where(joined, np.abs(run.gap), np.where(run.phase == "free", -run.gap, 0.0))))
    if scene.stop is not None and not scene.contact.algorithm and not scene.elastic_stop:
        low = run.y if "y" in run.columns else run.u_tip
        overlap = max(overlap, float(np.max(scene.stop.position - low)))
    return max(overlap, 0.0) / motion if motion > 0.0 else 0.0
