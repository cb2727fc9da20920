"""A load of a scene, ``[[loads]]``: where it acts, and its value as a function of time.

``docs/model.md``, "Loads", has the equations. A table is a file of two columns, time and value (``recorded``).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from .recorded import Reading, Recorded
from .tables import Table, key

if TYPE_CHECKING:
    from scipy.interpolate import PPoly


class Signal(NamedTuple):
    """A signal: keys that it needs, keys that it may have, and its value over the amplitude at t [s] after `start`."""

    needs: tuple[str, ...]
    may: tuple[str, ...]
    value: Callable[[Any, np.ndarray], Any]

    @property
    def takes(self) -> tuple[str, ...]:
        """All keys that play a part."""
        return self.needs + self.may


#: By their names in a scene; what a value is before a signal begins and after its end does not count.
SIGNALS: dict[str, Signal] = {
    "constant": Signal((), (), lambda load, t: 1.0),
    "harmonic": Signal(
        ("frequency",), ("phase", "start", "duration"), lambda load, t: np.sin(load.rate * t + load.phase)
    ),
    "chirp": Signal(
        ("frequency", "frequency_end", "duration"),
        ("phase", "start"),
        lambda load, t: np.sin(
            2.0 * np.pi * (load.frequency + 0.5 * (load.frequency_end - load.frequency) * t / load.duration) * t
            + load.phase
        ),
    ),
    "half_sine": Signal(("duration",), ("start",), lambda load, t: np.sin(np.pi / load.duration * t)),
    "sawtooth": Signal(("duration",), ("start",), lambda load, t: t / load.duration),
    "trapezoid": Signal(
        ("duration", "rise"),
        ("start",),
        lambda load, t: np.clip(np.minimum(t, load.duration - t) / load.rise, 0.0, 1.0),
    ),
    "step": Signal((), ("start", "duration"), lambda load, t: 1.0),
    "ramp": Signal(("duration",), ("start",), lambda load, t: np.clip(t / load.duration, 0.0, 1.0)),
    "table": Signal(("file",), ("interpolation", "start", *Reading.model_fields), lambda load, t: load.record(t)),
}
#: So many lines of a table in a step are data, and no kinks that are worth the end of one.
LINES_IN_STEP = 4
#: Most different places of point forces on a beam.
MOST_POINTS = 4


class _Acting(Table):
    """Where a load acts, and its signal."""

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


class Load(Reading, _Acting):
    """A load that acts on the beam, on its tip, on the spring, or on all by the acceleration of the base."""

    @model_validator(mode="after")
    def _has_its_table(self) -> Load:
        if self.file is not None and self.signal == "table":
            _ = self.record  # refuses what is no table
        return self

    @property
    def unit(self) -> str:
        """Unit of `value`."""
        return {"beam": "N" if self.at is not None else "N/m", "base": "m/s²"}.get(self.on, "N")

    @property
    def _extent(self) -> tuple[float, float]:
        """From when to when it is not 0 [s], counted from `start`."""
        if self.signal == "table":
            return float(self.record.x[0]), float(self.record.x[-1])
        ends = {"constant": (-inf, inf), "ramp": (0.0, inf)}
        return ends.get(self.signal, (0.0, self.duration or inf))

    @property
    def begins(self) -> float:
        """Time [s] before which the load is 0; −∞ of a constant."""
        return self.start + self._extent[0]

    @property
    def end(self) -> float:
        """Time [s] from which on the load is 0; ∞ if there is none."""
        return self.start + self._extent[1]

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
            lines = self.start + self.record.x
            return list((lines[[0, -1]] if self.interpolation == "cubic" else lines).tolist())
        rise, duration = self.rise or 0.0, self.duration or 0.0
        return [self.start + since for since in sorted({0.0, rise, duration - rise, duration})]

    @property
    def record(self) -> PPoly:
        """The table, as the polynomials between its lines. Raises ValueError, which names its line and column."""
        return self._read[0]

    @property
    def notes(self) -> list[str]:
        """What reading the table did to its lines, for people."""
        return self._read[1] if self.signal == "table" else []

    @property
    def _read(self) -> tuple[PPoly, list[str]]:
        assert self.file is not None
        path = Path(self.file)
        reading = Reading(**{name: getattr(self, name) for name in Reading.model_fields})
        try:
            return _record(path, path.stat().st_mtime_ns, self.interpolation, self.unit, reading)
        except (OSError, ValueError) as error:
            why = error.strerror if isinstance(error, OSError) else error
            raise ValueError(f'file = "{path}": {why}') from error

    def value(self, times: Any) -> np.ndarray:
        """Return the signal at ``times`` [s], any shape, in `unit`; where it jumps, the value after the jump."""
        t, (first, last) = np.asarray(times, dtype=float) - self.start, self._extent
        to_the_end = np.less_equal if self.signal == "table" else np.less  # the last line of a table belongs to it
        value = self.amplitude * SIGNALS[self.signal].value(self, t)
        return np.where((t >= first) & to_the_end(t, last), value, 0.0)


@lru_cache(maxsize=16)
def _record(path: Path, modified: int, interpolation: str, unit: str, reading: Reading) -> tuple[PPoly, list[str]]:
    recorded = Recorded(path, reading)
    if len(recorded.units) != 2:
        raise ValueError(f"{len(recorded.units)} columns; a table has two, time and value")
    times, columns = recorded.read({1: unit})
    values, notes = columns[1], [note for note in recorded.notes if not note.endswith("is assumed")]
    from scipy.interpolate import CubicSpline, PPoly  # takes half a second to load: only for who has a table

    if interpolation == "cubic":
        spline = CubicSpline(times, values)
        return PPoly(spline.c, spline.x), notes
    return PPoly(np.array([np.diff(values) / np.diff(times), values[:-1]]), times), notes
