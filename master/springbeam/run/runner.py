"""From a scene to a result: load what the scene contains, run it, sum up."""

from __future__ import annotations

import traceback
from contextlib import suppress
from pathlib import Path
from time import perf_counter
from typing import Any

from .. import __version__
from ..bodies.checkpointed import Checkpointed
from ..bodies.factory import findings, fingerprints, load_bodies
from ..bodies.fmu_bodies import FmuBeam, FmuBody, FmuSpring
from ..bodies.isolated import IsolatedBody
from ..bodies.protocol import Body, FmuError
from ..contact.laws import stiffest
from ..results.directory import RunDirectory
from ..results.file_recorder import FileRecorder
from ..results.reading import load_summary, load_trajectory
from ..results.recording import MemoryRecorder, Recorder
from ..results.totals import totals
from ..results.trajectory import Trajectory
from ..scene import Scene, SceneError, scene_from_dict, suspicions, with_changes
from ..scene.resolution import force_window
from .checkpoint import Checkpoint, CheckpointRefused, Checkpoints
from .outcome import Progress, RunStopped
from .paper_law import PaperLaw
from .simulation import Simulation


def run(
    scene: Scene,
    recorder: Recorder,
    progress: Progress | None = None,
    *,
    seconds: float | None = None,
    start: Checkpoint | None = None,
    upper: Body | None = None,
    lower: Body | None = None,
) -> dict[str, Any]:
    """Co-simulate ``scene`` into ``recorder`` and return the summary.

    Parameters
    ----------
    scene
        What is simulated.
    recorder
        Receives the results.
    progress
        Called once per accepted step.
    seconds
        Take a checkpoint into the directory of ``recorder``, which is then a `FileRecorder`, after the first step and
        whenever so much time of the clock has passed [s].
    start
        Go on from here, `last_checkpoint` of the directory of ``recorder``, instead of from the start.
    upper, lower
        Bodies that take the places of the beam and the spring, which the scene then describes as far as the master
        asks; they are the caller's to close.

    Raises
    ------
    RunStopped
        If the run ends early, for whatever reason but those below; what was computed has been recorded and the
        summary written. If the reason was not foreseen, it is the error's ``__cause__`` and the summary has its
        ``traceback``.
    OSError
        If the results cannot be written.
    FmuError
        If an FMU cannot be found or loaded.
    ResultsUnreadable, ResultsInUse
        If the results do not belong to ``start``, or another process is writing them.
    """
    if scene.accuracy is not None:
        if (upper or lower) is not None:
            raise SceneError(
                f"accuracy = {scene.accuracy:g}: is kept by pilot runs, and a body of your own can be run once; give "
                "coupling.scheme, degree and macro_step instead"
            )
        raise SceneError(
            f"accuracy = {scene.accuracy:g}: the settings that keep it are not picked yet; run "
            "springbeam.studies.accuracy.pick(scene).scene, or take accuracy out"
        )
    began = perf_counter()
    before = 0.0 if start is None else start.wall_time
    after_step = progress
    if seconds is not None:
        if not isinstance(recorder, FileRecorder):
            raise TypeError("checkpoints belong to results in a directory")
        _refuse_checkpoints(scene)
        checkpoints = Checkpoints(recorder, seconds, __version__, fingerprints(scene), before)

        def after_step(time: float, phase: str, macro_steps: int) -> None:
            if progress is not None:
                progress(time, phase, macro_steps)
            checkpoints.take_when_due(simulation)

    of_scene = _without_own(scene, upper=upper, lower=lower)
    start_time = 0.0 if upper is not None else scene.contact_time or 0.0
    paper = scene.contact.algorithm
    beam, spring = load_bodies(_as_in_paper(scene) if paper else of_scene, start_time)
    try:
        simulation: Simulation | PaperLaw
        if paper:
            assert isinstance(beam, FmuBeam)
            assert isinstance(spring, FmuSpring)
            simulation = PaperLaw(scene, start_time, beam, spring, recorder, after_step)
        else:
            simulation = Simulation(scene, start_time, upper or beam, lower or spring, recorder, after_step)
        if start is not None:
            _go_on(simulation, recorder, start)
        loaded = perf_counter()
        status: dict[str, Any] = {"status": "done"}
        try:
            simulation.run()
        except RunStopped as stopped:
            status = {"status": "stopped", "cause": stopped.cause, "residual": stopped.residual}
            raise
        except OSError as error:
            status = {"status": "stopped", "cause": f"{type(error).__name__}: {error}"}
            raise
        except Exception as error:
            cause = "".join(traceback.format_exception_only(error)).strip()
            status = {"status": "stopped", "cause": cause, "residual": None, "traceback": traceback.format_exc()}
            raise RunStopped(cause, simulation.time) from error
        except BaseException as error:
            status = {"status": "interrupted", "cause": type(error).__name__}
            raise
        finally:
            ended = perf_counter()
            summary = {
                **status,
                "version": __version__,
                **simulation.summary(),
                **_totals(simulation, scene, recorder),
                **_calls(beam=beam, spring=spring),
                "setup_time": loaded - began,
                "wall_time": before + ended - loaded,
            }
            summary["warnings"] = [*suspicions(scene), *summary["warnings"]]
            recorder.finish(summary)
        return summary
    finally:
        for body in (beam, spring):
            if body is not None:
                body.close()


def _go_on(simulation: Checkpointed, recorder: Recorder, start: Checkpoint) -> None:
    if not isinstance(recorder, FileRecorder):
        raise TypeError("a run goes on in the directory of its results")
    try:
        simulation.restore(start.simulation)
    except ValueError as error:
        raise CheckpointRefused(f"{recorder.directory.checkpoint}: written by another version: {error}") from error
    recorder.restore(start.results)


def last_checkpoint(directory: str | Path) -> Checkpoint:
    """The checkpoint of a run that is not done.

    Raises
    ------
    CheckpointRefused
        If the run is done, has no checkpoint, or would not go on as it began: another version of springbeam, another
        FMU, another scene.
    ResultsUnreadable
        If ``directory`` holds no run.
    FmuError
        If an FMU is missing.
    """
    results = RunDirectory(directory)
    summary = load_summary(results.path)
    if summary.get("status") == "done":
        raise CheckpointRefused(f"{results.path}: the run is done, nothing to resume")
    if not results.checkpoint.exists():
        raise CheckpointRefused(f"{results.path}: no checkpoint; springbeam run --checkpoint SECONDS takes them")
    start = Checkpoint.read(results.checkpoint)
    if start.version != __version__:
        raise CheckpointRefused(f"{results.checkpoint}: written by springbeam {start.version}, this is {__version__}")
    if start.scene != scene_from_dict(summary["scene"], source=f"{results.summary}: scene"):
        raise CheckpointRefused(f"{results.summary}: its scene is not the one that was run")
    found = fingerprints(start.scene)
    changed = [name for name in found if found[name] != start.files.get(name)]
    if changed:
        raise CheckpointRefused(f"{results.checkpoint}: the run began with another {' and another '.join(changed)}")
    return start


def resume(directory: str | Path, progress: Progress | None = None) -> Trajectory:
    """Go on with a run that was killed or stopped, from its last checkpoint to its end, and return all of it.

    The files in ``directory`` then are those of a run that was never stopped, to the last bit. Raises as
    `last_checkpoint` and `run` do.
    """
    start = last_checkpoint(directory)
    with FileRecorder(start.scene, RunDirectory(directory)) as recorder:
        run(start.scene, recorder, progress, seconds=start.seconds, start=start)
    return load_trajectory(directory)


def simulate(
    scene: Scene, progress: Progress | None = None, *, upper: Body | None = None, lower: Body | None = None
) -> Trajectory:
    """Co-simulate ``scene``, which asks for no accuracy, and return the trajectory; see `run`."""
    recorder = MemoryRecorder(scene)
    run(scene, recorder, progress, upper=upper, lower=lower)
    return recorder.trajectory()


def _refuse_checkpoints(scene: Scene) -> None:
    """Raise SceneError if a foreign FMU of ``scene`` cannot write its state."""
    for table, found in findings(scene).items():
        if not found.abilities.serialized:
            raise SceneError(
                f"[{table}] fmu: its state cannot be written to a file (canSerializeFMUstate = false), which "
                "--checkpoint needs; leave it out"
            )


def _without_own(scene: Scene, **own: Body | None) -> Scene:
    """Return ``scene`` without the tables whose places bodies of the caller's take; see `run`."""
    given = [place for place, body in own.items() if body is not None]
    if not given:
        return scene
    for place in given:
        name, body = {"upper": "beam", "lower": "spring"}[place], own[place]
        if not isinstance(body, Body):
            raise TypeError(f"the body in place of the {name} is a {type(body).__name__}, not a springbeam.Body")
        if not body.mass >= 0.0:
            raise SceneError(
                f"the body in place of the {name}: mass = {body.mass}; give its end a mass of 0 or more [kg]"
            )
        if getattr(scene, place) is None:
            raise SceneError(f"[{name}]: missing; a body of your own takes the place of one that the scene has")
    asked = {
        f'contact.law = "{scene.contact.law}"': scene.contact.algorithm,
        'coupling.scheme = "auto"': scene.coupling.scheme == "auto",
        'beam.fidelity = "quasi_static"': scene.massless,
    }
    for what in (what for what, is_so in asked.items() if is_so):
        raise SceneError(f"{what}: takes the bodies from the scene, and cannot be used with a body of your own")
    return scene.model_copy(update=dict.fromkeys(given))


def _as_in_paper(scene: Scene) -> Scene:
    """The scene with the beam on its full mesh, stepped by the midpoint rule (62)."""
    return with_changes(
        scene,
        beam={"integrator": "generalized_alpha", "rho_inf": 1.0, "n_modes": 0},
        coupling={"scheme": "energy", "degree": 0},
    )


def _totals(simulation: Simulation | PaperLaw, scene: Scene, recorder: Recorder) -> dict[str, float | int]:
    steps = recorder.steps()
    if steps is None or isinstance(simulation, PaperLaw):
        return {}
    window = force_window(scene, stiffest(scene) if scene.contact.facts.opens else 0.0)
    return totals(scene, steps, recorder.events(), window, free_at_end=simulation.free_at_end)


def _calls(**bodies: Body | None) -> dict[str, int]:
    counts = {}
    for name, body in bodies.items():
        if isinstance(body, (FmuBody, IsolatedBody)):
            counts[f"{name}_steps"] = body.steps
            counts[f"{name}_rollbacks"] = body.rewinds
        if isinstance(body, FmuSpring):
            with suppress(FmuError):  # why it fails to tell is the cause that the run stopped for
                counts["spring_internal_steps"] = body.internal_steps
    return counts
