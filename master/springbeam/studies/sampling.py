"""Quantities of a run and its reference at the same times, away from events."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..results.trajectory import TOLD, Trajectory, columns_of
from ..scene import Scene

#: Intervals of contact shorter than this many macro steps are no evidence either way.
SHORT = 2.0
DISPLACEMENTS, VELOCITIES = ("u_tip", "y"), ("v_tip", "z")


def macro_points(trajectory: Trajectory, scene: Scene) -> np.ndarray:
    """Return the times of the run's rows that lie on the grid of its macro steps [s]."""
    index = (trajectory.time - trajectory.time[0]) / scene.coupling.H
    return np.unique(trajectory.time[np.abs(index - np.round(index)) < 1e-6])


def away_from(times: np.ndarray, events: Iterable[float], size: float) -> np.ndarray:
    """Return which of ``times`` are more than `SHORT` and a half macro steps of ``size`` [s] away from all events."""
    away = np.ones(len(times), dtype=bool)
    for event in events:
        away &= np.abs(times - event) > (SHORT + 0.5) * size
    return away


def quantities(scene: Scene) -> list[str]:
    """Return the columns that are compared."""
    wanted = ("u_tip", "v_tip", "e_beam", "y", "z", "e_spring", "contact_force", *TOLD)
    there = columns_of(scene).keys() - {"bending_stress"}  # which follows from strains: the references have none
    return [name for name in wanted if name in there]


def sample(trajectory: Trajectory, times: np.ndarray, name: str) -> np.ndarray:
    """Return a quantity at macro points [s]; NaN where there is none. `at`, but for the contact force of a run."""
    if name == "contact_force" and "reference" not in trajectory.summary:
        return _contact_force(trajectory, times)
    return at(trajectory, times, name)


def at(trajectory: Trajectory, times: np.ndarray, name: str) -> np.ndarray:
    """Return the column's values at ``times`` [s] that are rows; NaN where there is none."""
    rows = trajectory.time
    index = np.clip(np.searchsorted(rows, times), 0, len(rows) - 1)
    for shift in (-1, 0):
        near = np.clip(index + shift, 0, len(rows) - 1)
        index = np.where(np.abs(rows[near] - times) < np.abs(rows[index] - times), near, index)
    close = np.abs(rows[index] - times) <= 1e-9 * np.maximum(1e-300, np.median(np.diff(rows)) + np.abs(times))
    return np.where(close, trajectory[name][index], np.nan)


def _contact_force(trajectory: Trajectory, times: np.ndarray) -> np.ndarray:
    """Return the mean of the contact force's two limits at macro points of a run, from the row after."""
    size = trajectory.scene.coupling.H
    steps = np.diff(trajectory.time, prepend=np.nan)
    regular = (np.abs(steps - size) < 1e-6 * size) & (np.abs(np.roll(steps, 1) - size) < 1e-6 * size)
    if regular.sum() < 2:
        return np.full(len(times), np.nan)
    force = trajectory["contact_force_smoothed"][regular]
    before = Trajectory(trajectory.scene, {"time": trajectory.time[regular] - size, "contact_force": force})
    return at(before, times, "contact_force")
