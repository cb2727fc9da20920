"""The damage boundary of a product: which pulses bring a number of it to its limit, as a part of a sweep.

A pulse is told by its peak and by the velocity that it changes, ∫ a dt. At each duration of a sweep the critical peak
is that at which the metric first reaches its limit, linear between the amplitudes swept.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ..scene import Load, Scene, SceneError
from .design import Axis
from .metrics import named

#: Points of the integral of a pulse.
_POINTS = 20_001


def limit_of(text: str, own: Sequence[str] = ()) -> tuple[str, float]:
    """Read ``METRIC=LIMIT``, what must not be reached, the metric being one of ``own`` or known.

    Raises SceneError for anything else.
    """
    metric, _, value = text.rpartition("=")
    try:
        limit = float(value)
    except ValueError:
        limit = 0.0
    if not limit > 0.0:
        raise SceneError(f"--boundary {text}: must be METRIC=LIMIT with a limit above 0, as in max_clamp_moment=0.3")
    return metric.strip() if metric.strip() in own else named(metric.strip())[0], limit


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
    load: Load, amplitude: str, duration: str, rows: Iterable[Mapping[str, Any]], metric: str, limit: float
) -> list[dict[str, float]]:
    """Return the critical pulses by duration; none at durations whose runs stay below the limit.

    ``rows`` are those of the sweep, ``amplitude`` and ``duration`` the names of its axes. A critical pulse has its
    ``duration`` [s], its ``peak``, in the load's unit, and its ``velocity_change``, the integral of the load.
    """
    by_duration: dict[float, list[tuple[float, float]]] = {}
    for row in rows:
        if row[metric] is not None:
            by_duration.setdefault(row[duration], []).append((abs(row[amplitude]), abs(row[metric])))
    found = []
    for length, pairs in sorted(by_duration.items()):
        peaks, values = np.array([(0.0, 0.0), *sorted(pairs)]).T
        above = np.flatnonzero(values >= limit)
        if above.size:
            around = slice(above[0] - 1, above[0] + 1)
            peak = float(np.interp(limit, values[around], peaks[around]))
            pulse = load.model_copy(update={"amplitude": 1.0, "duration": length, "start": 0.0})
            mean = float(pulse.value((np.arange(_POINTS) + 0.5) * length / _POINTS).mean())
            found.append({"duration": length, "velocity_change": peak * mean * length, "peak": peak})
    return found


def in_words(found: Sequence[Mapping[str, float]], limit: str) -> list[str]:
    """Return what the boundary says: both of its sides."""
    if not found:
        return [f"boundary  {limit} is not reached in any run that has a value of it"]
    slowest, least = (min(found, key=lambda pulse: pulse[side]) for side in ("velocity_change", "peak"))
    return [
        f"boundary  {limit} is reached from a velocity change of {slowest['velocity_change']:.4g} on "
        f"(in {slowest['duration']:.4g} s)",
        f"          and from a peak of {least['peak']:.4g} on (in {least['duration']:.4g} s)",
    ]
