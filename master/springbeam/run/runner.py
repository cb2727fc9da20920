"""From a scene to a result: load what the scene contains, run it, sum up."""

from __future__ import annotations

import traceback
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from time import perf_counter
from typing import Any

from ..bodies.factory import findings, load_bodies
from ..bodies.protocol import Abilities, Body
from ..results.recording import MemoryRecorder, Recorder
from ..results.trajectory import Trajectory
from ..scene import Scene, SceneError, as_scene
from ..scene.frequencies import fastest_frequency, shear_frequency, slowest_frequency
from ..scene.plausibility import warnings_of
from ..version import __version__
from .master import Master
from .outcome import Progress, RunStopped
from .setup import set_up
from .stepping import State
from .summary import summary
from .validation import tried, validate


class Simulation(AbstractContextManager["Simulation"]):
    """One run of a scene, a step at a time.

    Parameters
    ----------
    scene
        What is simulated, as for `springbeam.simulate`; it asks for no accuracy.
    recorder
        Where the results go; default: kept in memory.
    upper, lower
        Bodies that take the places of the beam and the spring, which the scene then describes as far as the master
        asks; they are the caller's to close.

    Raises
    ------
    SceneError
        If the scene asks for what its bodies cannot do, or for an accuracy.
    FmuError
        If an FMU cannot be found or loaded.
    """

    def __init__(
        self,
        scene: Scene | Mapping[str, Any] | str | Path,
        recorder: Recorder | None = None,
        *,
        upper: Body | None = None,
        lower: Body | None = None,
    ) -> None:
        began = perf_counter()
        scene = as_scene(scene)
        _refuse_accuracy(scene)
        of_scene = _without_own(scene, upper=upper, lower=lower)
        if upper is not None and scene.beam is not None:  # it moves from the start on, as an elastic approach does
            scene = scene.model_copy(update={"upper": scene.beam.model_copy(update={"approach": "elastic"})})
        self.scene = scene
        self.recorder = recorder or MemoryRecorder(scene)
        able = abilities(scene, upper=upper, lower=lower)
        setup = set_up(scene, *able.values())
        #: The slowest frequency of our beam and the fastest wave that an impact excites in it [rad/s]; 0 without one.
        self._frequencies = _frequencies(of_scene)
        beam, spring, contact_force = load_bodies(of_scene, setup.start, setup.degree)
        self._bodies = beam, spring
        try:
            validate(setup, upper or beam, lower or spring, able)
            self._master = Master(setup, upper or beam, lower or spring, self.recorder, contact_force)
        except BaseException:
            self.close()
            raise
        self._loaded = perf_counter()
        self._setup_time = self._loaded - began
        self._summary: dict[str, Any] = {}  #: of the run when it has ended
        self._closed = False

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Release the FMUs; what was computed stays, and no step can be made any more."""
        self._closed = True
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
            self._master.flush()
        run = self.recorder.trajectory()
        run.summary = run.summary if self._summary else self._summed_up({"status": "running"})
        return run

    def step(self) -> bool:
        """Make one step, to the next macro point or event, and return whether there are more to come.

        Raises
        ------
        RunStopped
            If the run ends early; what was computed is in its ``run``.
        ValueError
            After `close`.
        """
        self._refuse_closed()
        with self._ending():
            self._master.step()
        if self.done:
            self._end({"status": "done"})
        return not self.done

    def finish(self, progress: Progress | None = None) -> dict[str, Any]:
        """Make all steps that are left and return the summary; parameters as of `run`, errors as of `step`."""
        self._refuse_closed()
        master = self._master
        with self._ending():
            while not master.done:
                master.step()
                if progress is not None:
                    progress(master.state.time, master.state.phase.name, master.state.macro_steps)
        return self._end({"status": "done"})

    def reach(self, time: float) -> Trajectory:
        """Make the steps up to ``time`` [s], or to the end of the run; return the trajectory, without its summary.

        The last step may end later. Raises the same errors as `step`.
        """
        self._refuse_closed()
        with self._ending():
            while not self.done and not (self.state.begun and self.state.time >= time):
                self._master.step()
            self._master.flush()
        return self.recorder.trajectory()

    def _refuse_closed(self) -> None:
        if self._closed:
            raise ValueError("the simulation is closed, and its bodies with it; make another one")

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
                self._master.flush()
            self._summary = self._summed_up(status)
            self.recorder.finish(self._summary)
        return self._summary

    def _summed_up(self, status: dict[str, Any]) -> dict[str, Any]:
        wall_time = perf_counter() - self._loaded
        amounts = summary(self._master, self.recorder, *self._frequencies)
        bodies = zip(("beam", "spring"), self._bodies, strict=True)
        counting = {name: body for name, body in bodies if body is not None and body.steps_made is not None}
        return {
            **status,
            "version": __version__,
            **amounts,
            **{f"{name}_steps": body.steps_made for name, body in counting.items()},
            **{f"{name}_rollbacks": body.rewinds for name, body in counting.items()},
            "setup_time": self._setup_time,
            "wall_time": wall_time,
            "warnings": [*warnings_of(self.scene), *amounts["warnings"]],
        }


def abilities(scene: Scene, *, upper: Body | None = None, lower: Body | None = None) -> dict[str, Abilities]:
    """Return the measured abilities of bodies that are not our own, by table. Parameters, errors: `Simulation`."""
    checked = findings(_without_own(scene, upper=upper, lower=lower))
    able = {table: finding.abilities for table, finding in checked.items()}
    H = scene.coupling.macro_step or 1e-3 * scene.time.t_end
    for table, body in (("beam", upper), ("spring", lower)):
        if body is not None:
            able[table] = tried(body, scene.contact_time or 0.0, H)
    return able


def run(
    scene: Scene,
    recorder: Recorder,
    progress: Progress | None = None,
    *,
    upper: Body | None = None,
    lower: Body | None = None,
) -> dict[str, Any]:
    """Co-simulate ``scene`` into ``recorder`` and return the summary.

    Parameters
    ----------
    scene, recorder, upper, lower
        As of `Simulation`, which raises the same errors.
    progress
        Called after each step.

    Raises
    ------
    RunStopped
        If the run ends early, for whatever reason but those below; what was computed has been recorded and the
        summary written. If the reason was not foreseen, it is the error's ``__cause__`` and the summary has its
        ``traceback``.
    OSError
        If the results cannot be written.
    """
    with Simulation(scene, recorder, upper=upper, lower=lower) as simulation:
        return simulation.finish(progress)


def run_in_memory(
    scene: Scene, progress: Progress | None = None, *, upper: Body | None = None, lower: Body | None = None
) -> Trajectory:
    """Co-simulate ``scene``, which asks for no accuracy, and return the trajectory; see `run`."""
    with Simulation(scene, upper=upper, lower=lower) as simulation:
        simulation.finish(progress)
        return simulation.run


def _frequencies(scene: Scene) -> tuple[float, float]:
    """Return the lowest frequency of our beam, and that of the fastest wave that an impact excites in it [rad/s]."""
    if scene.beam is None or scene.massless:
        return 0.0, 0.0
    return slowest_frequency(scene.beam), min(shear_frequency(scene.beam), fastest_frequency(scene.beam))


def _refuse_accuracy(scene: Scene) -> None:
    """Raise SceneError if ``scene`` asks for an accuracy, which is kept by settings that are picked before."""
    if scene.accuracy is not None:
        raise SceneError(
            f"accuracy = {scene.accuracy:g}: is kept by settings that pilot runs pick, and a body of your own can be "
            "run once; run springbeam.simulate(scene).scene, or give coupling.scheme, degree and "
            "macro_step instead"
        )


def _without_own(scene: Scene, **own: Body | None) -> Scene:
    """Return ``scene`` without the tables whose places bodies of the caller's take; see `run`."""
    given = [place for place, body in own.items() if body is not None]
    if not given:
        return scene
    for place in given:
        name = {"upper": "beam", "lower": "spring"}[place]
        body = own[place]
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
        'beam.fidelity = "quasi_static"': scene.massless,
    }
    for what in (what for what, is_so in asked.items() if is_so):
        raise SceneError(f"{what}: takes the bodies from the scene, and cannot be used with a body of your own")
    return scene.model_copy(update=dict.fromkeys(given))
