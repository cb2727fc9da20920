"""Where a run leaves its records, events and shapes, some hundred steps at a time: `MemoryRecorder` keeps them.

``file_recorder`` writes them into a directory instead.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ..scene import Scene
from .columns import blocks
from .steps import STEP
from .trajectory import SHAPE_COLUMNS, Event, Trajectory


class Recorder(ABC):
    """What a run reports to: any number of blocks, then ``finish``.

    Parameters
    ----------
    scene
        The scene as run.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene

    @abstractmethod
    def keep(self, steps: np.ndarray, events: Sequence[Event], shapes: np.ndarray) -> None:
        """Keep the next steps of the run.

        Parameters
        ----------
        steps
            Their records, of dtype `springbeam.results.steps.STEP`, shape (n,); all numbers are finite.
        events
            That happened on them.
        shapes
            The beam's shapes at some of them: the numbers of `SHAPE_COLUMNS`, shape (m, 64).
        """

    @abstractmethod
    def steps(self) -> np.ndarray:
        """Return the records kept so far, shape (n,)."""

    @abstractmethod
    def events(self) -> Iterable[Event]:
        """Return the events kept so far."""

    @abstractmethod
    def trajectory(self) -> Trajectory:
        """Return everything kept so far."""

    @abstractmethod
    def finish(self, summary: Mapping[str, Any]) -> None:
        """End the record with ``summary``, which is JSON-like; the scene as run is added.

        The command line reports ``status`` (``done``, ``stopped``, ``interrupted``), ``macro_steps``, ``wall_time``
        [s], ``max_energy_residual`` (relative) and ``warnings`` (list of str), those that are there.
        """


class MemoryRecorder(Recorder):
    """Keeps everything in memory."""

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self._steps, self._shapes = [np.empty(0, STEP)], [np.empty((0, len(SHAPE_COLUMNS)))]
        self._events: list[Event] = []
        self._summary: dict[str, Any] = {}

    def keep(self, steps: np.ndarray, events: Sequence[Event], shapes: np.ndarray) -> None:
        self._steps.append(steps)
        self._events += events
        self._shapes.append(shapes)

    def steps(self) -> np.ndarray:
        self._steps = [np.concatenate(self._steps)]
        return self._steps[0]

    def events(self) -> list[Event]:
        return self._events

    def finish(self, summary: Mapping[str, Any]) -> None:
        self._summary = with_scene(summary, self.scene)

    def trajectory(self) -> Trajectory:
        shapes = None if self.scene.beam is None else np.concatenate(self._shapes)
        return trajectory_of(self.scene, self.steps(), list(self._events), shapes, dict(self._summary))


def trajectory_of(
    scene: Scene, steps: np.ndarray, events: list[Event], shapes: np.ndarray | None, summary: dict[str, Any]
) -> Trajectory:
    """Return the run that records, events and shapes amount to; parameters as of `Recorder`."""
    made = list(blocks(scene, steps))
    columns = {name: np.concatenate([block[name] for block in made]) for name in made[0]}
    inside = steps if steps["size"].any() else None
    return Trajectory(scene, columns, events, summary=summary, steps=inside, shape_table=shapes)


def with_scene(summary: Mapping[str, Any], scene: Scene) -> dict[str, Any]:
    """Return ``summary`` with the scene as run, as it goes into ``summary.json``."""
    return {**summary, "scene": scene.model_dump(exclude_none=True)}
