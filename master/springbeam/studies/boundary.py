"""The damage boundary of a product: which pulses bring a number of it to its limit, as a part of a sweep.

A pulse is told by its peak and by the velocity that it changes, ∫ a dt. At each duration of a sweep the critical peak
is that at which the metric first reaches its limit, linear between the amplitudes swept.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..pictures.drawing import VERMILLION
from ..scene import Load, Scene, SceneError
from .design import Axis
from .metrics import named

#: Points of the integral of a pulse.
_POINTS = 20_001


class Limit(NamedTuple):
    """A metric of ``springbeam.studies.metrics``, by name, and what it must not reach."""

    metric: str
    value: float


class Critical(NamedTuple):
    """A pulse at the boundary."""

    duration: float  #: [s]
    velocity_change: float  #: ∫ of the load over its duration, in the load's unit times s
    peak: float  #: in the load's unit


def limit_of(text: str, own: Sequence[str] = ()) -> Limit:
    """Read ``METRIC=LIMIT``, the metric being one of ``own`` or known. Raises SceneError for anything else."""
    metric, separator, value = text.rpartition("=")
    try:
        limit = float(value)
    except ValueError:
        limit = 0.0
    if not separator or not limit > 0.0:
        raise SceneError(f"--boundary {text}: must be METRIC=LIMIT with a limit above 0, as in max_a_tip=400")
    return Limit(metric.strip() if metric.strip() in own else named(metric.strip())[0], limit)


def pulse_axes(scene: Scene, axes: Sequence[Axis]) -> tuple[Load, str, str]:
    """Return the pulse that a sweep varies, and the names of the axes of its amplitude and its duration.

    Raises SceneError if the sweep is over anything else.
    """
    names = {axis.name for axis in axes}
    table = next(iter(names)).rpartition(".")[0]
    amplitude, duration = f"{table}.amplitude", f"{table}.duration"
    if names != {amplitude, duration} or not table.startswith("loads."):
        raise SceneError("--boundary: takes --vary loads.0.amplitude=… and --vary loads.0.duration=… of one pulse")
    load = scene.loads[int(table.partition(".")[2])]
    if load.duration is None:
        raise SceneError(f'--boundary: the load is no pulse; its signal is "{load.signal}", without a duration')
    return load, amplitude, duration


def boundary(
    load: Load, amplitude: str, duration: str, rows: Iterable[Mapping[str, Any]], limit: Limit
) -> list[Critical]:
    """Return the critical pulses by duration; none at durations whose runs stay below the limit.

    ``rows`` are those of the sweep, ``amplitude`` and ``duration`` the names of its axes.
    """
    by_duration: dict[float, list[tuple[float, float]]] = {}
    for row in rows:
        if row[limit.metric] is not None:
            by_duration.setdefault(row[duration], []).append((abs(row[amplitude]), abs(row[limit.metric])))
    found = []
    for length, pairs in sorted(by_duration.items()):
        peaks, values = np.array([(0.0, 0.0), *sorted(pairs)]).T
        above = np.flatnonzero(values >= limit.value)
        if above.size:
            k = int(above[0])
            share = (limit.value - values[k - 1]) / (values[k] - values[k - 1])
            peak = float(peaks[k - 1] + share * (peaks[k] - peaks[k - 1]))
            found.append(Critical(length, peak * _area(load, length), peak))
    return found


def in_words(found: Sequence[Critical], limit: str) -> list[str]:
    """Return what the boundary says: both of its sides."""
    if not found:
        return [f"boundary  {limit} is not reached in any run that has a value of it"]
    slowest, least = min(found, key=lambda c: c.velocity_change), min(found, key=lambda c: c.peak)
    return [
        f"boundary  {limit} is reached from a velocity change of {slowest.velocity_change:.4g} on "
        f"(in {slowest.duration:.4g} s)",
        f"          and from a peak of {least.peak:.4g} on (in {least.duration:.4g} s)",
    ]


def draw_boundary(found: Sequence[Critical], limit: str, path: Path) -> Path:
    """Draw peaks over velocity changes; what lies above and to the right damages."""
    from .picture import panels

    figure, (ax,) = panels(1, 1, (7.0, 4.0), f"damage boundary: {limit}")
    along = sorted(found, key=lambda c: c.duration)
    ax.loglog([c.velocity_change for c in along], [c.peak for c in along], ".-", color=VERMILLION)
    ax.set(xlabel="velocity change [unit of the load × s]", ylabel="peak [unit of the load]")
    ax.grid(alpha=0.3, which="both")
    figure.savefig(path, dpi=100)
    return path


def _area(load: Load, duration: float) -> float:
    """Return ∫ of the pulse over its duration at an amplitude of 1 [s]."""
    pulse = load.model_copy(update={"amplitude": 1.0, "duration": duration, "start": 0.0})
    middle = (np.arange(_POINTS) + 0.5) * duration / _POINTS
    return float(pulse.value(middle).mean()) * duration
