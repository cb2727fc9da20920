"""A load of a scene, ``[[loads]]``: where it acts, and its value as a function of time.

``docs/model.md``, "Loads", has the equations. Each signal is one table of keys, a `Load` named in `SIGNALS`. A table of
values is a file of two columns, time and value (``recorded``).
"""

from collections.abc import Callable
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, model_validator
from typing_extensions import Self

from ..lazily import Later
from .recorded import Reading, curve_of
from .tables import OneOf, Table, key

if TYPE_CHECKING:
    import numpy as np
    from scipy.interpolate import PPoly
else:
    np = Later("numpy")

#: With so many lines of a table in a step, no step ends at its kinks.
LINES_IN_STEP = 4
#: A time that no run has [s].
FOR_EVER = 1e300
#: Most different places of point forces on a beam.
MOST_POINTS = 4


class Load(Table):
    """A load on the beam, its tip or the spring, an acceleration of the base, or the motion of a moving wall."""

    on: Literal["beam", "tip", "spring", "base", "wall"] = key(
        "–",
        "target: beam (force in N/m, or N at a point), tip or spring (force in N), base (acceleration in m/s²), wall "
        "(height of a moving_wall in m)",
    )
    shape: Annotated[tuple[float, ...] | None, Field(strict=False, min_length=1, max_length=4)] = key(
        "–", "on the beam: f_b is the signal times Σ s_i (x/L)^i", None, otherwise="uniform, without at"
    )
    at: float | None = key("–", "on the beam: a point force at this fraction of L", None, gt=0.0, le=1.0)
    amplitude: float = key("N/m, N, m/s² or m", "amplitude of the signal; upward is positive", 1.0)
    signal: str

    @model_validator(mode="after")
    def _acts_somewhere(self) -> Self:
        place = f"shape = {list(self.shape)}" if self.shape is not None else f"at = {self.at}"
        if self.on != "beam" and (self.shape is not None or self.at is not None):
            raise ValueError(f'{place}: is for on = "beam", this load is on = "{self.on}"')
        if self.shape is not None and self.at is not None:
            raise ValueError(f"at = {self.at}: a load has a shape or acts at a point; leave one of the two out")
        return self

    def curve(self, t: "np.ndarray") -> Any:
        """Return the value over the amplitude at t [s] after `start`; before it begins and after its end, anything."""
        raise NotImplementedError

    def slope(self, t: "np.ndarray") -> Any:
        """Return the derivative of `curve` [1/s]; at a kink, that after it."""
        return 0.0

    @property
    def unit(self) -> str:
        """Unit of `value`."""
        return {"beam": "N" if self.at is not None else "N/m", "base": "m/s²", "wall": "m"}.get(self.on, "N")

    @property
    def since(self) -> float:
        """Time 0 of `curve` [s]."""
        return 0.0

    @property
    def _extent(self) -> tuple[float, float]:
        """Interval in which it is not 0 [s], counted from `since`."""
        return -inf, inf

    @property
    def _bends(self) -> tuple[float, ...]:
        """Times at which it jumps or has a kink [s], counted from `since`."""
        return ()

    @property
    def begins(self) -> float:
        """Time [s] before which the load is 0; −∞ of a constant."""
        return self.since + self._extent[0]

    @property
    def end(self) -> float:
        """Time [s] from which on the load is 0; ∞ if there is none."""
        return self.since + self._extent[1]

    @property
    def peak(self) -> float:
        """Largest absolute value, in `unit`."""
        return abs(self.amplitude)

    @property
    def rate(self) -> float:
        """Rate of an oscillation without end [rad/s], 0 for any other signal."""
        return 0.0

    @property
    def wave(self) -> tuple[float, float] | None:
        """Rate [rad/s] and phase [rad] of a sine, ``None`` for any other signal."""
        return None

    @property
    def kinks(self) -> list[float]:
        """Times at which it jumps or has a kink [s], ascending; a step ends at each."""
        return [self.since + bend for bend in sorted(set(self._bends))]

    @property
    def edges(self) -> list[float]:
        """Times between which it is smooth [s], ascending."""
        return self.kinks

    @property
    def notes(self) -> list[str]:
        """Changes made to the lines of its file, in words."""
        return []

    def is_finer_than(self, macro_step: float | None) -> bool:
        """Return whether the lines of a straight table are too close for steps of ``macro_step`` [s] to end on them."""
        return False

    def value(self, times: Any) -> "np.ndarray":
        """Return the signal at ``times`` [s], any shape, in `unit`; where it jumps, the value after the jump."""
        return self._within(times, self.curve)

    def change(self, times: Any) -> "np.ndarray":
        """Return the time derivative of `value` at ``times`` [s]; at a kink, that after it."""
        return self._within(times, self.slope)

    def _within(self, times: Any, curve: Callable[["np.ndarray"], Any]) -> "np.ndarray":
        t = np.asarray(times, dtype=float) - self.since
        first, last = self._extent
        return np.where((t >= first) & (t < last), self.amplitude * curve(t), 0.0)


class ConstantLoad(Load):
    """The amplitude at all times."""

    signal: Literal["constant"] = key("–", "the amplitude at all times", "constant")

    def curve(self, t: "np.ndarray") -> Any:
        return 1.0


class _Started(Load):
    """A load that is 0 before its start."""

    start: float = key("s", "time before which the load is 0; time 0 of a table", 0.0)

    @property
    def since(self) -> float:
        return self.start


class _Lasting(_Started):
    """A load that may end."""

    duration: float | None = key("s", "how long it acts", None, gt=0.0, otherwise="for ever")

    @property
    def _extent(self) -> tuple[float, float]:
        return 0.0, self.duration or inf

    @property
    def _bends(self) -> tuple[float, ...]:
        return 0.0, self.duration or 0.0


class _Pulse(_Started):
    """A load that ends."""

    duration: float = key("s", "length of the pulse, or of the rise", gt=0.0)

    @property
    def _extent(self) -> tuple[float, float]:
        return 0.0, self.duration

    @property
    def _bends(self) -> tuple[float, ...]:
        return 0.0, self.duration


class HarmonicLoad(_Lasting):
    """A sine, sin(2π f t + φ)."""

    signal: Literal["harmonic"] = key("–", "a sine", "harmonic")
    frequency: float = key("Hz", "frequency f", gt=0.0)
    phase: float = key("rad", "phase φ at its start", 0.0)

    @property
    def rate(self) -> float:
        return 2.0 * np.pi * self.frequency

    @property
    def wave(self) -> tuple[float, float]:
        return self.rate, self.phase

    def curve(self, t: "np.ndarray") -> Any:
        return np.sin(self.rate * t + self.phase)

    def slope(self, t: "np.ndarray") -> Any:
        return self.rate * np.cos(self.rate * t + self.phase)


class ChirpLoad(_Pulse):
    """A sine whose frequency changes evenly in time."""

    signal: Literal["chirp"] = key("–", "a sine whose frequency changes", "chirp")
    frequency: float = key("Hz", "frequency at its start", gt=0.0)
    frequency_end: float = key("Hz", "frequency at its end", gt=0.0)
    phase: float = key("rad", "phase φ at its start", 0.0)

    @property
    def rate(self) -> float:
        return 2.0 * np.pi * max(self.frequency, self.frequency_end)

    def curve(self, t: "np.ndarray") -> Any:
        return np.sin(self._angle(t))

    def slope(self, t: "np.ndarray") -> Any:
        frequency = self.frequency + (self.frequency_end - self.frequency) * t / self.duration
        return 2.0 * np.pi * frequency * np.cos(self._angle(t))

    def _angle(self, t: "np.ndarray") -> Any:
        mean = self.frequency + 0.5 * (self.frequency_end - self.frequency) * t / self.duration
        return 2.0 * np.pi * mean * t + self.phase


class HalfSineLoad(_Pulse):
    """A pulse, the half of a sine."""

    signal: Literal["half_sine"] = key("–", "a pulse, the half of a sine", "half_sine")

    @property
    def wave(self) -> tuple[float, float]:
        return np.pi / self.duration, 0.0

    def curve(self, t: "np.ndarray") -> Any:
        return np.sin(self.wave[0] * t)

    def slope(self, t: "np.ndarray") -> Any:
        return self.wave[0] * np.cos(self.wave[0] * t)


class SawtoothLoad(_Pulse):
    """A pulse that grows evenly and has its peak at the end."""

    signal: Literal["sawtooth"] = key("–", "a pulse with its peak at the end", "sawtooth")

    def curve(self, t: "np.ndarray") -> Any:
        return t / self.duration

    def slope(self, t: "np.ndarray") -> Any:
        return 1.0 / self.duration


class TrapezoidLoad(_Pulse):
    """A pulse that rises and falls evenly, and is constant between."""

    signal: Literal["trapezoid"] = key("–", "a pulse that rises, stays and falls", "trapezoid")
    rise: float = key("s", "duration of the rise, and of the fall", gt=0.0)

    @model_validator(mode="after")
    def _has_time_to_fall(self) -> Self:
        if self.rise > 0.5 * self.duration:
            raise ValueError(f"rise = {self.rise}: must be at most half of duration = {self.duration}")
        return self

    @property
    def _bends(self) -> tuple[float, ...]:
        return 0.0, self.rise, self.duration - self.rise, self.duration

    def curve(self, t: "np.ndarray") -> Any:
        return np.clip(np.minimum(t, self.duration - t) / self.rise, 0.0, 1.0)

    def slope(self, t: "np.ndarray") -> Any:
        return np.where(t < self.rise, 1.0, np.where(t < self.duration - self.rise, 0.0, -1.0)) / self.rise


class StepLoad(_Lasting):
    """The amplitude from the start on."""

    signal: Literal["step"] = key("–", "the amplitude from the start on", "step")

    def curve(self, t: "np.ndarray") -> Any:
        return 1.0


class RampLoad(_Pulse):
    """A load that rises evenly, and stays."""

    signal: Literal["ramp"] = key("–", "a load that rises, and stays", "ramp")

    @property
    def _extent(self) -> tuple[float, float]:
        return 0.0, inf

    def curve(self, t: "np.ndarray") -> Any:
        return np.clip(t / self.duration, 0.0, 1.0)

    def slope(self, t: "np.ndarray") -> Any:
        return np.where(t < self.duration, 1.0 / self.duration, 0.0)


class TableLoad(Reading, _Started):
    """A table of values over time, in a file."""

    signal: Literal["table"] = key("–", "a table of values over time", "table")
    file: str = key("–", "file of a table, relative to that of the scene")
    interpolation: Literal["linear", "cubic"] = key("–", "between the lines of a table", "linear")

    @model_validator(mode="after")
    def _has_its_table(self) -> Self:
        _ = self._read  # refuses what is no table
        return self

    @property
    def record(self) -> "PPoly":
        """The table, as the polynomials between its lines. Raises ValueError, which names its line and column."""
        return self._read[0]

    @property
    def notes(self) -> list[str]:
        return self._read[1]

    @property
    def _read(self) -> "tuple[PPoly, list[str]]":
        path = Path(self.file)
        reading = Reading(**{name: getattr(self, name) for name in Reading.model_fields})
        try:
            return curve_of(path, path.stat().st_mtime_ns, self.interpolation, self.unit, reading)
        except (OSError, ValueError) as error:
            why = f"{error.strerror}; give a file of numbers" if isinstance(error, OSError) else error
            raise ValueError(f'file = "{path}": {why}') from error

    @property
    def _extent(self) -> tuple[float, float]:
        x = self.record.x
        return float(x[0]), float(np.nextafter(x[-1], inf))  # the last line belongs to it

    @property
    def end(self) -> float:
        return self.start + float(self.record.x[-1])

    @property
    def peak(self) -> float:
        return abs(self.amplitude) * float(np.abs(self.record(self.record.x)).max())

    @property
    def kinks(self) -> list[float]:
        lines = self.edges
        return [lines[0], lines[-1]] if self.interpolation == "cubic" else lines

    @property
    def edges(self) -> list[float]:
        return (self.start + self.record.x).tolist()

    def is_finer_than(self, macro_step: float | None) -> bool:
        if self.interpolation == "cubic" or macro_step is None:
            return False
        times = self.record.x
        return bool(LINES_IN_STEP * (times[-1] - times[0]) < macro_step * (len(times) - 1))

    def curve(self, t: "np.ndarray") -> Any:
        return self.record(t)

    def slope(self, t: "np.ndarray") -> Any:
        return self.record(t, 1)


#: By their names in a scene.
SIGNALS: dict[str, type[Load]] = {
    "constant": ConstantLoad,
    "harmonic": HarmonicLoad,
    "chirp": ChirpLoad,
    "half_sine": HalfSineLoad,
    "sawtooth": SawtoothLoad,
    "trapezoid": TrapezoidLoad,
    "step": StepLoad,
    "ramp": RampLoad,
    "table": TableLoad,
}
SIGNAL = OneOf(Load, "signal", "value over time", SIGNALS, "constant")
