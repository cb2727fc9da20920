"""From a scene to a result: load what the scene contains, run it, sum up."""

from __future__ import annotations

import traceback
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from time import perf_counter
from typing import Any

from .. import __version__
from ..bodies.factory import findings, fingerprints, load_bodies
from ..bodies.fmu_bodies import FmuBody
from ..bodies.protocol import Body
from ..results.directory import RunDirectory
from ..results.files import load_summary, load_trajectory
from ..results.recording import FileRecorder, MemoryRecorder, Recorder
from ..results.trajectory import Trajectory
from ..scene import ArgumentError, Scene, SceneError, as_scene, scene_from_dict, suspicions
from .checkpoint import Checkpoint, CheckpointRefused
from .equilibrium import contact_at_rest
from .master import Master
from .outcome import Progress, RunStopped
from .stepping import State


class Simulation(AbstractContextManager["Simulation"]):
    """One run of a scene, a step at a time.

    Parameters
    ----------
    scene
        What is simulated, as for `springbeam.simulate`; it asks for no accuracy.
    recorder
        Where the results go; default: kept in memory.
    start
        Go on from here, `last_checkpoint` of the directory of ``recorder``, instead of from the start.
    upper, lower
        Bodies that take the places of the beam and the spring, which the scene then describes as far as the master
        asks; they are the caller's to close.

    Raises
    ------
    SceneError
        If the scene asks for what its bodies cannot do, or for an accuracy.
    FmuError
        If an FMU cannot be found or loaded.
    ResultsUnreadable, ResultsInUse
        If the results do not belong to ``start``, or another process is writing them.
    """

    def __init__(
        self,
        scene: Scene | Mapping[str, Any] | str | Path,
        recorder: Recorder | None = None,
        *,
        start: Checkpoint | None = None,
        upper: Body | None = None,
        lower: Body | None = None,
    ) -> None:
        began = perf_counter()
        scene = as_scene(scene)
        _refuse_accuracy(scene)
        self.scene, self.recorder = scene, recorder or MemoryRecorder(scene)
        of_scene = _without_own(scene, upper=upper, lower=lower)
        start_time = 0.0 if upper is not None else scene.contact_time or 0.0
        contact = contact_at_rest(of_scene)
        self._bodies = beam, spring = load_bodies(of_scene, start_time, contact)
        try:
            self._master = Master(scene, start_time, upper or beam, lower or spring, self.recorder, contact)
            if start is not None:
                self._go_on(start)
        except BaseException:
            self.close()
            raise
        self._loaded = perf_counter()
        self._setup_time, self._before = self._loaded - began, 0.0 if start is None else start.wall_time
        self._summary: dict[str, Any] = {}  #: of the run when it has ended

    def _go_on(self, start: Checkpoint) -> None:
        assert isinstance(self.recorder, FileRecorder), "the results of a checkpoint are in its directory"
        try:
            self._master.go_on(start.state)
        except ValueError as error:
            path = self.recorder.directory.checkpoint
            raise CheckpointRefused(f"{path}: written by another version: {error}") from error
        self.recorder.restore(start.results)

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Release the FMUs; what was computed stays."""
        for body in self._bodies:
            if body is not None:
                body.close()

    @property
    def done(self) -> bool:
        """Whether the run has reached t_end."""
        return self._master.done

    @property
    def state(self) -> State:
        """Where the run is: its time, phase and forces, and the size of its last step."""
        return self._master.state

    @property
    def run(self) -> Trajectory:
        """The trajectory so far; its summary has the ``status`` "running" until the run has ended.

        Raises RunStopped if the steps since the last check have gone wrong, which ends the run.
        """
        with self._ending():
            self._master.hand_over()
        found = self.recorder.trajectory()
        found.summary = found.summary if self._summary else self._summed_up({"status": "running"})
        return found

    def step(self) -> bool:
        """Make one step, to the next macro point or event, and return whether there are more to come.

        Raises RunStopped if the run ends early; what was computed is in its ``run``.
        """
        with self._ending():
            self._master.step()
        if self.done:
            self._end({"status": "done"})
        return not self.done

    def finish(self, progress: Progress | None = None, seconds: float | None = None) -> dict[str, Any]:
        """Make all steps that are left and return the summary. Raises RunStopped; parameters as of `run`."""
        master, recorder, due = self._master, self.recorder, 0.0
        if seconds is not None:
            assert isinstance(recorder, FileRecorder), "a run with checkpoints has its results in a directory"
            _refuse_checkpoints(self.scene)
            files = fingerprints(self.scene)
        with self._ending():
            while not master.done:
                master.step()
                if progress is not None:
                    progress(master.state.time, master.state.phase.name, master.state.macro_steps)
                if isinstance(recorder, FileRecorder) and seconds is not None and perf_counter() >= due:
                    master.hand_over()
                    kept, state = recorder.save(), master.run_state()
                    begun = self.scene, __version__, files, seconds, self._wall_time(), recorder.interval
                    Checkpoint(*begun, kept, state).write(recorder.directory.checkpoint)
                    due = perf_counter() + seconds
        return self._end({"status": "done"})

    def _wall_time(self) -> float:
        return self._before + perf_counter() - self._loaded

    @contextmanager
    def _ending(self) -> Iterator[None]:
        """End the run with its summary if an error ends it, as RunStopped unless the disk or the user does."""
        try:
            yield
        except RunStopped as stopped:
            self._stopped(stopped, {})
            raise
        except OSError as error:
            self._end({"status": "stopped", "cause": f"{type(error).__name__}: {error}"})
            raise
        except Exception as error:
            cause = "".join(traceback.format_exception_only(error)).strip()
            unforeseen = RunStopped(cause, self.state.time)
            self._stopped(unforeseen, {"traceback": traceback.format_exc()})
            raise unforeseen from error
        except BaseException as error:
            self._end({"status": "interrupted", "cause": type(error).__name__})
            raise

    def _stopped(self, stopped: RunStopped, more: dict[str, Any]) -> None:
        self._end({"status": "stopped", "cause": stopped.cause, "residual": stopped.residual, **more})
        if isinstance(self.recorder, MemoryRecorder):
            stopped.run = self.recorder.trajectory()

    def _end(self, status: dict[str, Any]) -> dict[str, Any]:
        if not self._summary:
            with suppress(RunStopped):  # the run ends for another reason
                self._master.hand_over()
            self._summary = self._summed_up(status)
            self.recorder.finish(self._summary)
        return self._summary

    def _summed_up(self, status: dict[str, Any]) -> dict[str, Any]:
        wall_time, summary = self._wall_time(), self._master.summary()
        told = zip(("beam", "spring"), self._bodies, strict=True)
        counting = {name: body for name, body in told if isinstance(body, FmuBody)}
        return {
            **status,
            "version": __version__,
            **summary,
            **{f"{name}_steps": body.steps for name, body in counting.items()},
            **{f"{name}_rollbacks": body.rewinds for name, body in counting.items()},
            "setup_time": self._setup_time,
            "wall_time": wall_time,
            "warnings": [*suspicions(self.scene), *summary["warnings"]],
        }


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
    scene, recorder, start, upper, lower
        As of `Simulation`, which raises the same errors.
    progress
        Called after each step.
    seconds
        Take a checkpoint into the directory of ``recorder``, which is then a `FileRecorder`, after the first step and
        whenever so much time of the clock has passed [s].

    Raises
    ------
    RunStopped
        If the run ends early, for whatever reason but those below; what was computed has been recorded and the
        summary written. If the reason was not foreseen, it is the error's ``__cause__`` and the summary has its
        ``traceback``.
    OSError
        If the results cannot be written.
    """
    with Simulation(scene, recorder, start=start, upper=upper, lower=lower) as simulation:
        return simulation.finish(progress, seconds)


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
    with FileRecorder(start.scene, RunDirectory(directory), start.interval) as recorder:
        run(start.scene, recorder, progress, seconds=start.seconds, start=start)
    return load_trajectory(directory)


def simulate(
    scene: Scene, progress: Progress | None = None, *, upper: Body | None = None, lower: Body | None = None
) -> Trajectory:
    """Co-simulate ``scene``, which asks for no accuracy, and return the trajectory; see `run`."""
    with Simulation(scene, upper=upper, lower=lower) as simulation:
        simulation.finish(progress)
        return simulation.run


def _refuse_accuracy(scene: Scene) -> None:
    """Raise SceneError if ``scene`` asks for an accuracy, which is kept by settings that are picked before."""
    if scene.accuracy is not None:
        raise SceneError(
            f"accuracy = {scene.accuracy:g}: is kept by settings that pilot runs pick, and a body of your own can be "
            "run once; run springbeam.run.accuracy.pick(scene).scene, or give coupling.scheme, degree and "
            "macro_step instead"
        )


def _refuse_checkpoints(scene: Scene) -> None:
    """Raise SceneError if a foreign FMU of ``scene`` cannot write its state."""
    for table, found in findings(scene).items():
        if not found.abilities.serialized:
            raise ArgumentError(
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
        'time.initial_state = "static"': scene.static,
        'coupling.scheme = "auto"': scene.coupling.scheme == "auto",
        'beam.fidelity = "quasi_static"': scene.massless,
    }
    for what in (what for what, is_so in asked.items() if is_so):
        raise SceneError(f"{what}: takes the bodies from the scene, and cannot be used with a body of your own")
    return scene.model_copy(update=dict.fromkeys(given))
