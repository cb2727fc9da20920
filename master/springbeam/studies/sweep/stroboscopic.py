"""A driven motion sampled once per period of its drive: bifurcation diagram, and peak response over one varied key."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ...pictures.drawing import BLUE, VERMILLION
from ...results.trajectory import Trajectory
from ...scene import Load, Scene, SceneError
from .design import Axis
from .picture import labelled, logarithmic

#: What is kept of each run beside its metrics: positions at equal phase [m], and half the range of the motion [m].
POINTS, PEAK = "stroboscopic", "peak_response"
#: The transient, as a share of the run.
_TRANSIENT = 2.0 / 3.0
PICTURE = "bifurcation.png"


def drive(scene: Scene) -> Load:
    """Return the first harmonic load of ``scene``. Raises SceneError if it has none."""
    for load in scene.loads:
        if load.signal == "harmonic":
            return load
    raise SceneError('--stroboscopic: the scene has no drive; it needs [[loads]] with signal = "harmonic"')


def observed(run: Trajectory) -> dict[str, Any]:
    """Return `POINTS` and `PEAK` of the last third of a run: of the tip, of the spring top where there is no beam."""
    load, column = drive(run.scene), "u_tip" if "u_tip" in run.columns else "y"
    assert load.frequency is not None
    begin, end = float(run.time[0]), float(run.time[-1])
    late = begin + _TRANSIENT * (end - begin)
    first, last = np.ceil((late - load.start) * load.frequency), np.floor((end - load.start) * load.frequency)
    times = load.start + np.arange(first, last + 1.0) / load.frequency
    motion = run[column][run.time >= late]
    return {POINTS: run.at(np.minimum(times, end))[column].tolist(), PEAK: 0.5 * float(np.ptp(motion))}


def draw(columns: dict[str, list[Any]], axes: Sequence[Axis], directory: Path) -> bool:
    """Draw `PICTURE`: positions at equal phase, and the peak response; ``False`` unless one key of numbers varies."""
    if len(axes) != 1 or any(isinstance(value, str) for value in columns[axes[0].name]):
        return False
    at = np.array(columns[axes[0].name], dtype=float)
    figure = Figure(figsize=(7.0, 7.0), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    for x, positions in zip(at, columns[POINTS], strict=True):
        if positions is not None:
            upper.plot(np.full(len(positions), x), positions, ".", color=BLUE, markersize=2.0)
    order = np.argsort(at, kind="stable")
    peaks = np.array([np.nan if peak is None else peak for peak in columns[PEAK]], dtype=float)
    lower.plot(at[order], peaks[order], ".-", color=VERMILLION, linewidth=1.0)
    upper.set_ylabel("position once a period of the drive [m]")
    lower.set(ylabel="half the range of the motion [m]", xlabel=labelled(axes[0]))
    for ax in (upper, lower):
        ax.grid(alpha=0.3)
        if axes[0].log:
            logarithmic(ax.xaxis, at)
    figure.savefig(directory / PICTURE, dpi=100)
    return True
