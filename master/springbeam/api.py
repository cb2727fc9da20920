"""What Python programs call; ``springbeam.simulate`` and the others are these."""

from __future__ import annotations

from .results.trajectory import Trajectory
from .run import runner
from .run.outcome import Progress
from .scene import Scene
from .studies.accuracy import pick


def simulate(scene: Scene, progress: Progress | None = None) -> Trajectory:
    """Co-simulate ``scene``, with settings that keep its ``accuracy`` if it asks for one, and return the trajectory.

    Parameters
    ----------
    scene
        What is simulated.
    progress
        Called with time [s], phase and number of macro steps once per accepted step; not while settings are searched.

    Raises
    ------
    RunStopped
        If the run ends early.
    SceneError
        If the accuracy cannot be reached.
    FmuError
        If an FMU cannot be found or loaded.
    """
    return runner.simulate(scene, progress) if scene.accuracy is None else pick(scene).trajectory()
