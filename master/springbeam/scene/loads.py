"""A load of a scene, ``[[loads]]``: where it acts, and its value as a function of time.

``docs/model.md``, "Loads", has the equations. A table is a file of two columns, time and value (``recorded``).
"""

from __future__ import annotations

from functools import lru_cache
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from .recorded import Recorded
from .tables import Table, key

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

#: Which keys each signal takes: those that it needs, and others.
_TAKES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "constant": ((), ()),
    "harmonic": (("frequency",), ("phase", "start", "duration")),
    "chirp": (("frequency", "frequency_end", "duration"), ("phase", "start")),
    "half_sine": (("duration",), ("start",)),
    "sawtooth": (("duration",), ("start",)),
    "trapezoid": (("duration", "rise"), ("start",)),
    "step": ((), ("start", "duration")),
    "ramp": (("duration",), ("start",)),
    "table": (("file",), ("interpolation", "start")),
}
_OF_SIGNALS = ("frequency", "frequency_end", "phase", "start", "duration", "rise", "file", "interpolation")
#: So many lines of a table in a step are data, and no kinks that are worth the end of one.
LINES_IN_STEP = 4
#: Most different places of point forces on a beam.
MOST_POINTS = 4


class Load(Table):
    """A load that acts on the beam, on its tip, on the spring, or on all by the acceleration of the base."""

    on: Literal["beam", "tip", "spring", "base"] = key(
        "–", "what it acts on: a force on the beam (N/m, or N at a point), on tip or spring (N), or the base (m/s²)"
    )
    shape: Annotated[tuple[float, ...] | None, Field(strict=False, min_length=1, max_length=4)] = key(
        "–", "on the beam: f_b is the signal times Σ s_i (x/L)^i", None, otherwise="uniform, without at"
    )
    at: float | None = key("–", "on the beam: a point force at this fraction of L", None, gt=0.0, le=1.0)
    amplitude: float = key("N/m, N or m/s²", "amplitude of the signal; upward is positive", 1.0)
    signal: Literal["constant", "harmonic", "chirp", "half_sine", "sawtooth", "trapezoid", "step", "ramp", "table"] = (
        key("–", "value over time; sawtooth has its peak at the end", "constant")
    )
    frequency: float | None = key(
        "Hz", "frequency of harmonic, of chirp at its start", None, gt=0.0, otherwise="needed with harmonic and chirp"
    )
    frequency_end: float | None = key(
        "Hz", "frequency of chirp at its end; between, it changes evenly in time", None, gt=0.0,
        otherwise="needed with chirp",
    )  # fmt: skip
    phase: float = key("rad", "phase of harmonic or chirp at its start", 0.0)
    start: float = key("s", "time before which the load is 0; time 0 of a table", 0.0)
    duration: float | None = key(
        "s", "length of the pulse, or of the rise", None, gt=0.0,
        otherwise="for ever; needed with chirp, half_sine, sawtooth, trapezoid and ramp",
    )  # fmt: skip
    rise: float | None = key(
        "s", "how long a trapezoid rises, and falls", None, gt=0.0, otherwise="needed with trapezoid"
    )
    file: str | None = key("–", "file of a table, relative to that of the scene", None, otherwise="needed with table")
    interpolation: Literal["linear", "cubic"] = key("–", "between the lines of a table", "linear")

    @model_validator(mode="after")
    def _keys_of_signal(self) -> Load:
        given = [name for name in _OF_SIGNALS if getattr(self, name) != type(self).model_fields[name].default]
        needs, may_have = _TAKES[self.signal]
        for name in given:
            if name not in needs + may_have:
                allowed = ", ".join(needs + may_have) or "none of these keys"
                raise ValueError(
                    f'{name} = {getattr(self, name)!r}: plays no part in signal = "{self.signal}"; it takes {allowed}'
                )
        for name in needs:
            if getattr(self, name) is None:
                raise ValueError(f'{name}: missing; signal = "{self.signal}" needs it')
        for name in ("shape", "at"):
            if getattr(self, name) is not None and self.on != "beam":
                raise ValueError(f'{name} = {getattr(self, name)!r}: is for on = "beam", this load is on = "{self.on}"')
        if self.shape is not None and self.at is not None:
            raise ValueError(f"at = {self.at}: a load has a shape or acts at a point; leave one of the two out")
        if self.rise is not None and self.duration is not None and self.rise > 0.5 * self.duration:
            raise ValueError(f"rise = {self.rise}: must be at most half of duration = {self.duration}")
        if self.signal == "table":
            _ = self.record  # refuses what is no table
        return self

    @property
    def unit(self) -> str:
        """Unit of `value`."""
        return {"beam": "N" if self.at is not None else "N/m", "base": "m/s²"}.get(self.on, "N")

    @property
    def begins(self) -> float:
        """Time [s] before which the load is 0; −∞ of a constant."""
        if self.signal == "constant":
            return -inf
        return self.start + (float(self.record.x[0]) if self.signal == "table" else 0.0)

    @property
    def end(self) -> float:
        """Time [s] from which on the load is 0; ∞ if there is none."""
        if self.signal == "table":
            return self.start + float(self.record.x[-1])
        return inf if self.duration is None or self.signal == "ramp" else self.start + self.duration

    @property
    def peak(self) -> float:
        """Largest absolute value, in `unit`."""
        return abs(self.amplitude) * (
            float(np.abs(self.record(self.record.x)).max()) if self.signal == "table" else 1.0
        )

    @property
    def rate(self) -> float:
        """Rate of an oscillation that goes on and on [rad/s], 0 for any other signal."""
        return 2.0 * np.pi * max(self.frequency or 0.0, self.frequency_end or 0.0)

    def is_finer_than(self, macro_step: float | None) -> bool:
        """Return whether the lines of a straight table are too close for steps of ``macro_step`` [s] to end on them."""
        if self.signal != "table" or self.interpolation == "cubic" or macro_step is None:
            return False
        times = self.record.x
        return bool(LINES_IN_STEP * (times[-1] - times[0]) < macro_step * (len(times) - 1))

    @property
    def kinks(self) -> list[float]:
        """Times at which it jumps or bends [s], ascending; all lines of a straight table."""
        if self.signal == "constant":
            return []
        if self.signal == "table":
            times = self.start + self.record.x
            return list((times[[0, -1]] if self.interpolation == "cubic" else times).tolist())
        if self.duration is None:
            return [self.start]
        bends = [] if self.rise is None else [self.rise, self.duration - self.rise]
        return [self.start + since for since in (0.0, *bends, self.duration)]

    @property
    def record(self) -> PPoly:
        """The table, as the polynomials between its lines. Raises ValueError, which names its line and column."""
        assert self.file is not None
        path = Path(self.file)
        try:
            return _record(path, path.stat().st_mtime_ns, self.interpolation, self.unit)
        except (OSError, ValueError) as error:
            why = error.strerror if isinstance(error, OSError) else error
            raise ValueError(f'file = "{path}": {why}') from error

    def value(self, times: Any) -> np.ndarray:
        """Return the signal at ``times`` [s], any shape, in `unit`; where it jumps, the value after the jump."""
        t = np.asarray(times, dtype=float) - self.start
        if self.signal == "constant":
            return np.full_like(t, self.amplitude)
        if self.signal == "table":
            record = self.record
            return np.asarray(self.amplitude * np.where((t >= record.x[0]) & (t <= record.x[-1]), record(t), 0.0))
        duration = inf if self.duration is None else self.duration
        if self.signal == "ramp":
            return self.amplitude * np.clip(t / duration, 0.0, 1.0)
        wave = np.ones_like(t)
        if self.signal == "harmonic":
            wave = np.sin(self.rate * t + self.phase)
        elif self.signal == "chirp":
            first, last = self.frequency or 0.0, self.frequency_end or 0.0
            wave = np.sin(2.0 * np.pi * (first + 0.5 * (last - first) * t / duration) * t + self.phase)
        elif self.signal == "half_sine":
            wave = np.sin(np.pi / duration * t)
        elif self.signal == "sawtooth":
            wave = t / duration
        elif self.signal == "trapezoid":
            wave = np.clip(np.minimum(t, duration - t) / (self.rise or inf), 0.0, 1.0)
        return np.where((t >= 0.0) & (t < duration), self.amplitude * wave, 0.0)


@lru_cache(maxsize=16)
def _record(path: Path, modified: int, interpolation: str, unit: str) -> PPoly:
    recorded = Recorded(path)
    if len(recorded) != 2:
        raise ValueError(f"{len(recorded)} columns; a table has two, time and value")
    values, times = recorded.column(1, unit), recorded.times()
    from scipy.interpolate import CubicSpline, PPoly  # takes half a second to load: only for who has a table

    if interpolation == "cubic":
        spline = CubicSpline(times, values)
        return PPoly(spline.c, spline.x)
    return PPoly(np.array([np.diff(values) / np.diff(times), values[:-1]]), times)
