"""From a scene to a result: load what the scene contains, run it, sum up."""

from __future__ import annotations

from importlib.metadata import version
from time import perf_counter
from typing import Any

from .fmu import FmuBeam, FmuSpring, load_bodies
from .paper_law import PaperLaw
from .recording import MemoryRecorder, Recorder
from .scene import Scene, suspicions, with_changes
from .simulation import Progress, RunStopped, Simulation
from .trajectory import Trajectory

__all__ = ["RunStopped", "run", "simulate"]


def run(scene: Scene, recorder: Recorder, progress: Progress | None = None) -> dict[str, Any]:
    """Co-simulate ``scene`` into ``recorder`` and return the summary.

    Raises
    ------
    RunStopped
        If the run ends early; what was computed has been recorded and the summary written.
    FmuError
        If an FMU cannot be found or loaded.
    """
    began = perf_counter()
    start_time = scene.contact_time or 0.0
    paper = scene.contact.law == "paper"
    beam, spring = load_bodies(_as_in_paper(scene) if paper else scene, start_time)
    try:
        simulation: Simulation | PaperLaw
        if paper:
            assert beam is not None
            assert spring is not None
            simulation = PaperLaw(scene, start_time, beam, spring, recorder, progress)
        else:
            simulation = Simulation(scene, start_time, beam, spring, recorder, progress)
        loaded = perf_counter()
        status: dict[str, Any] = {"status": "done"}
        try:
            simulation.run()
        except RunStopped as stopped:
            status = {"status": "stopped", "cause": stopped.cause, "residual": stopped.residual}
            raise
        except BaseException as error:
            status = {"status": "interrupted", "cause": type(error).__name__}
            raise
        finally:
            summary = {
                **status,
                "version": version("springbeam"),
                **simulation.summary(),
                **_calls(beam, spring),
                "setup_time": loaded - began,
                "wall_time": perf_counter() - loaded,
            }
            summary["warnings"] = [*suspicions(scene), *summary["warnings"]]
            recorder.finish(summary)
        return summary
    finally:
        for body in (beam, spring):
            if body is not None:
                body.close()


def simulate(scene: Scene, progress: Progress | None = None) -> Trajectory:
    """Co-simulate ``scene`` and return the trajectory. Raises as `run` does."""
    recorder = MemoryRecorder(scene)
    run(scene, recorder, progress)
    return recorder.trajectory()


def _as_in_paper(scene: Scene) -> Scene:
    """The scene with the beam on its full mesh, stepped by the midpoint rule (62)."""
    return with_changes(scene, beam={"integrator": "generalized_alpha", "rho_inf": 1.0, "n_modes": 0})


def _calls(beam: FmuBeam | None, spring: FmuSpring | None) -> dict[str, int]:
    bodies = {"beam": beam, "spring": spring}
    counts = {}
    for name, body in bodies.items():
        if body is not None:
            counts[f"{name}_steps"] = body.steps
            counts[f"{name}_rollbacks"] = body.rewinds
    return counts
