"""Spectra of a run, or of a record, as tables and a picture (``springbeam spectrum``)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..pictures.diagrams import Diagram, draw_diagrams
from ..results.trajectory import Trajectory, columns_of
from ..scene import ArgumentError, SceneError
from ..scene.recorded import Reading
from ..scene.units import GRAVITY
from ..signals.curves import unit_of
from ..signals.record import columns_along, read_record
from ..signals.shock import CERTAIN, ShockSpectrum, frequencies_between, shock_of_record
from ..signals.spectra import PowerSpectrum, power_of, spectra
from .tables import Findings, Row

#: Power below this share of the highest line is not drawn.
_FLOOR = 1e-12
#: Units in which accelerations may be shown, in m/s².
UNITS = {"m/s²": 1.0, "g": GRAVITY}


@dataclass(frozen=True)
class Shocks:
    """How shock spectra are shown."""

    unit: str = "m/s²"  #: one of `UNITS`
    over: str | None = None  #: the spectrum over which the others are shown as well
    required: Path | None = None  #: a file of the spectrum that is required: frequency and acceleration
    tolerance: tuple[float, float] = (-3.0, 6.0)  #: of that [dB]


def spectrum(
    run: Trajectory,
    of: Sequence[str],
    low: float | None,
    high: float | None,
    quality: float,
    since: float | None,
    segments: int,
    title: str,
    shocks: Shocks | None = None,
) -> Findings:
    """Return the spectra of a run; arguments are those of `springbeam.signals.spectra.spectra`."""
    shocks = shocks or Shocks()
    found = spectra(run, of, low, high, quality, since, segments)
    shown = _Shown(shocks, {end: _in(shocks.unit, shock) for end, shock in found.shock.items()})
    units = columns_of(run.scene)
    for what, power in found.power.items():
        shown.power(what, power, unit_of(what, units))
    swept = {(what, chirp.load): chirp for what, several in found.responses.items() for chirp in several}
    answers: dict[str, dict[str, np.ndarray]] = {}
    for (what, load), chirp in swept.items():
        name = f"response-{what if what.isidentifier() else 'function'}-load-{load}"
        shown.columns[name] = {"frequency": chirp.frequency, "amplitude": chirp.amplitude}
        curves = answers.setdefault(unit_of(what, units), {})
        curves[f"{what} to load {load}, {chirp.way}"] = np.transpose(chirp[1:])
    for unit, curves in answers.items():
        up = f"half the range{f' [{unit}]' * bool(unit)}"
        shown.diagrams.append(Diagram("frequency of the chirp [Hz]", up, curves, log=False))
    if found.points is not None:
        times, points = found.points
        shown.columns["poincare"] = {"time": times, "position": points[:, 0], "velocity": points[:, 1]}
        once = Diagram("position once a period of the drive [m]", "velocity [m/s]", {"points": points}, log=False)
        shown.diagrams.append(once._replace(dots=("points",)))
    settled = None if found.settled is None else {**found.settled._asdict(), "period": found.settled.period}
    document = {"jumps": found.jumps, "settled": settled}
    lines = [f"{what:<20} {words}" for what, words in found.in_words(shocks.unit, UNITS[shocks.unit])]
    return shown.findings(document, lines, run.scene.title or title)


def spectrum_of_record(
    file: Path,
    of: Sequence[str],
    low: float | None,
    high: float | None,
    quality: float,
    segments: int,
    reading: Reading,
    scales: Mapping[str, str],
    shocks: Shocks,
    unit: str | None,
) -> Findings:
    """Return the spectra of the accelerations in a file, in their own unit if that is g, or in ``unit``.

    Other arguments are those of `spectrum`, ``scales`` those of `springbeam.signals.measured.read_measured`.
    """
    record = read_record(file, of, reading, scales)
    shocks = Shocks(unit or record.unit, shocks.over, shocks.required, shocks.tolerance)
    step = record.step
    frequencies = frequencies_between(
        low or 1.0 / (step * (len(record.time) - 1)), high or max(CERTAIN / step, 2.0 * (low or 0.0))
    )
    shock = {what: shock_of_record(a, step, frequencies, quality) for what, a in record.values.items()}
    shown = _Shown(shocks, {what: _in(shocks.unit, one) for what, one in shock.items()})
    lines = [f"read      {note}" for note in record.notes]
    for what, one in shown.shocks.items():
        at = int(np.argmax(one.maximax))
        peak = f"{one.maximax[at]:.4g} {shocks.unit} at {one.frequency[at]:.4g} Hz, Q = {quality:g}"
        largest = float(np.abs(record.values[what]).max()) / UNITS[shocks.unit]
        lines.append(f"{f'shock of {what}':<20} {peak} (record: {largest:.4g})")
        power = power_of(record.values[what] / UNITS[shocks.unit], step, segments)
        shown.power(what, power, shocks.unit)
        lines.append(f"{f'power of {what}':<20} highest at {power.highest:.5g} Hz")
    if frequencies[-1] > CERTAIN / step * (1.0 + 1e-9):
        lines.append(
            f"uncertain from {CERTAIN / step:.4g} Hz on: what the base did between {1.0 / step:.4g} samples a second "
            "counts there (ISO 18431-4)"
        )
    return shown.findings({}, lines, file.name)


class _Shown:
    """Tables, diagrams and lines of spectra."""

    def __init__(self, how: Shocks, shocks: Mapping[str, ShockSpectrum]) -> None:
        self.how = how
        self.shocks = shocks
        self.columns: dict[str, dict[str, Any]] = {
            f"shock-{_file_name(what, k)}": one._asdict() for k, (what, one) in enumerate(shocks.items())
        }
        self.diagrams = [Diagram("frequency [Hz]", f"largest acceleration [{how.unit}]", self._curves())]
        self.diagrams += self._ratios()
        self._powers: dict[str, dict[str, np.ndarray]] = {}
        self._highest: dict[str, float] = {}

    def _curves(self) -> dict[str, np.ndarray]:
        """Return the shock spectra, and the band of the one that is required."""
        curves = {f"shock, {what}": np.transpose(one[:2]) for what, one in self.shocks.items()}
        if self.how.required is not None:
            frequency, level = required(self.how.required, self.how.unit)
            for name, decibels in zip(("lowest allowed", "highest allowed"), self.how.tolerance, strict=True):
                curves[name] = np.column_stack([frequency, level * 10.0 ** (decibels / 20.0)])
        return curves

    def _ratios(self) -> list[Diagram]:
        over = self.how.over
        if over is None:
            return []
        if over not in self.shocks:
            raise ArgumentError(f"--over {over}: there are shock spectra of {', '.join(self.shocks)}")
        ratios = {}
        for number, (what, one) in enumerate(self.shocks.items()):
            if what != over:
                ratio = one.maximax / self.shocks[over].maximax
                self.columns[f"shock-{_file_name(what, number)}"][f"over_{_file_name(over, 0)}"] = ratio
                ratios[f"{what} over {over}"] = np.column_stack([one.frequency, ratio])
        return [Diagram("frequency [Hz]", "ratio of shock spectra", ratios)]

    def power(self, what: str, power: PowerSpectrum, unit: str) -> None:
        """Add a power spectrum of a curve in ``unit``; curves of one unit share a diagram."""
        self.columns[f"power-{_file_name(what, len(self._highest))}"] = power._asdict()
        self._highest[what] = power.highest
        points = np.transpose(power[:2])
        squared = f"{f'({unit})' if set('/·') & set(unit) else unit}²" if unit else "unit²"
        curves = self._powers.setdefault(f"power density [{squared}/Hz]", {})
        curves[f"power, {what}"] = points[points[:, 1] > _FLOOR * points[:, 1].max()]

    def findings(self, document: Row, lines: Sequence[str], title: str) -> Findings:
        """Return all as findings."""
        powers = [Diagram("frequency [Hz]", unit, curves) for unit, curves in self._powers.items()]
        ratios = 1 + (self.how.over is not None)
        diagrams = [*self.diagrams[:ratios], *powers, *self.diagrams[ratios:]]
        drawn = [diagram for diagram in diagrams if diagram.curves]
        tables = {
            name: [dict(zip(of, row, strict=True)) for row in np.transpose(list(of.values())).tolist()]
            for name, of in self.columns.items()
        }
        shock = {what: one._asdict() for what, one in self.shocks.items()}
        document = {"shock": shock, "unit": self.how.unit, **document, "highest": self._highest}
        pictures = {"spectrum": partial(draw_diagrams, drawn, title, (8.2, 2.8), wide=1)}
        return Findings(document, [*lines, *self._judged()], tables=tables, pictures=pictures)

    def _judged(self) -> Iterator[str]:
        """Yield how shock spectra lie in the band of the one that is required."""
        if self.how.required is None:
            return
        frequency, level = required(self.how.required, self.how.unit)
        low, high = self.how.tolerance
        for what, one in self.shocks.items():
            known = one.frequency[(one.frequency >= frequency[0]) & (one.frequency <= frequency[-1])]
            if not len(known):
                yield f"{what}: no oscillator lies from {frequency[0]:g} to {frequency[-1]:g} Hz, as those required do"
                continue
            ratio = np.interp(known, one.frequency, one.maximax) / _on_lines(known, frequency, level)
            decibels = 20.0 * np.log10(np.maximum(ratio, 1e-300))
            share = float(np.mean((decibels >= low) & (decibels <= high)))
            ends = (decibels.argmin(), decibels.argmax())
            least, most = (f"{decibels[k]:+.1f} dB at {known[k]:.4g} Hz" for k in ends)
            yield f"{what}: within {low:+g} to {high:+g} dB of --required at {share:.0%}; {least} to {most}"


def _on_lines(at: np.ndarray, frequency: np.ndarray, level: np.ndarray) -> np.ndarray:
    """Return levels between those at frequencies, on straight lines in a diagram with logarithmic axes."""
    return np.asarray(np.exp(np.interp(np.log(at), np.log(frequency), np.log(level))))


def required(path: Path, unit: str) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies [Hz] and accelerations in ``unit`` of a spectrum that is required.

    Raises SceneError, which names file and line.
    """
    frequency, levels = columns_along(path, "Hz", "m/s²")
    if not (frequency[0] > 0.0 and (levels > 0.0).all()):
        raise SceneError(f"{path}: frequencies and accelerations must be above 0")
    return frequency, levels / UNITS[unit]


def _in(unit: str, found: ShockSpectrum) -> ShockSpectrum:
    return ShockSpectrum(found.frequency, *(values / UNITS[unit] for values in found[1:]))


def _file_name(what: str, number: int) -> str:
    return what if what.isidentifier() else str(number)
