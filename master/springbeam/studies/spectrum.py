"""Spectra of a run, or of a record, as tables and a picture (``springbeam spectrum``)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from ..pictures.diagrams import Diagram, draw_diagrams
from ..results.trajectory import Trajectory, columns_of
from ..scene import ArgumentError, SceneError
from ..scene.recorded import Reading
from ..scene.units import GRAVITY
from ..signals.curves import unit_of
from ..signals.record import columns_along, read_record
from ..signals.shock import CERTAIN, ShockSpectrum, frequencies_between, shock_of_record
from ..signals.spectra import Spectra, power_of, spectra
from .tables import Findings

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
    units = columns_of(run.scene)
    found = spectra(run, of, low, high, quality, since, segments)
    return _findings(found, shocks or Shocks(), partial(unit_of, units=units), run.scene.title or title)


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
    shown_in = unit or record.unit
    step = record.step
    certain = CERTAIN / step
    frequencies = frequencies_between(
        low or 1.0 / (step * (len(record.time) - 1)), high or max(certain, 2.0 * (low or 0.0))
    )
    found = Spectra(
        shock={what: shock_of_record(a, step, frequencies, quality) for what, a in record.values.items()},
        power={what: power_of(a / UNITS[shown_in], step, segments) for what, a in record.values.items()},
        quality=quality,
        recorded={what: float(np.abs(a).max()) for what, a in record.values.items()},
    )
    findings = _findings(found, replace(shocks, unit=shown_in), lambda what: shown_in, file.name)
    uncertain = (
        f"uncertain from {certain:.4g} Hz on: what the base did between {1.0 / step:.4g} samples a second counts there "
        "(ISO 18431-4)"
    )
    after = [uncertain] if frequencies[-1] > certain * (1.0 + 1e-9) else []
    return findings.with_lines([f"read      {note}" for note in record.notes], after)


def _findings(found: Spectra, how: Shocks, unit_of: Callable[[str], str], title: str) -> Findings:
    """Return tables, diagrams and lines of spectra; curves of one unit share a diagram."""
    size = UNITS[how.unit]
    shocks = {
        what: ShockSpectrum(one.frequency, *(values / size for values in one[1:])) for what, one in found.shock.items()
    }
    columns = {f"shock-{_file_name(what, k)}": one._asdict() for k, (what, one) in enumerate(shocks.items())}
    diagrams = [Diagram("frequency [Hz]", f"largest acceleration [{how.unit}]", _curves(shocks, how))]
    if how.over is not None:
        if how.over not in shocks:
            raise ArgumentError(f"--over {how.over}: there are shock spectra of {', '.join(shocks)}")
        ratios = {}
        for number, (what, one) in enumerate(shocks.items()):
            if what != how.over:
                ratio = one.maximax / shocks[how.over].maximax
                columns[f"shock-{_file_name(what, number)}"][f"over_{_file_name(how.over, 0)}"] = ratio
                ratios[f"{what} over {how.over}"] = np.column_stack([one.frequency, ratio])
        diagrams.append(Diagram("frequency [Hz]", "ratio of shock spectra", ratios))
    powers: dict[str, dict[str, np.ndarray]] = {}
    for number, (what, power) in enumerate(found.power.items()):
        columns[f"power-{_file_name(what, number)}"] = power._asdict()
        points = np.transpose(power[:2])
        unit = unit_of(what)
        squared = f"{f'({unit})' if set('/·') & set(unit) else unit}²" if unit else "unit²"
        curves = powers.setdefault(f"power density [{squared}/Hz]", {})
        curves[f"power, {what}"] = points[points[:, 1] > _FLOOR * points[:, 1].max()]
    diagrams += [Diagram("frequency [Hz]", label, curves) for label, curves in powers.items()]
    answers: dict[str, dict[str, np.ndarray]] = {}
    for what, chirp in ((what, chirp) for what, several in found.responses.items() for chirp in several):
        name = f"response-{what if what.isidentifier() else 'function'}-load-{chirp.load}"
        columns[name] = {"frequency": chirp.frequency, "amplitude": chirp.amplitude}
        curves = answers.setdefault(f"half the range{f' [{unit_of(what)}]' * bool(unit_of(what))}", {})
        curves[f"{what} to load {chirp.load}, {chirp.way}"] = np.transpose(chirp[1:])
    diagrams += [Diagram("frequency of the chirp [Hz]", label, curves, log=False) for label, curves in answers.items()]
    if found.points is not None:
        times, points = found.points
        columns["poincare"] = {"time": times, "position": points[:, 0], "velocity": points[:, 1]}
        once = Diagram("position once a period of the drive [m]", "velocity [m/s]", {"points": points}, log=False)
        diagrams.append(once._replace(dots=("points",)))
    tables = {
        name: [dict(zip(of, row, strict=True)) for row in np.transpose(list(of.values())).tolist()]
        for name, of in columns.items()
    }
    document = {
        "shock": {what: one._asdict() for what, one in shocks.items()},
        "unit": how.unit,
        "jumps": found.jumps,
        "settled": None if found.settled is None else {**found.settled._asdict(), "period": found.settled.period},
        "highest": {what: power.highest for what, power in found.power.items()},
    }
    lines = [f"{what:<20} {words}" for what, words in found.in_words(how.unit, size)]
    drawn = [diagram for diagram in diagrams if diagram.curves]
    pictures = {"spectrum": partial(draw_diagrams, drawn, title, (8.2, 2.8), wide=1)}
    return Findings(document, [*lines, *_judged(shocks, how)], tables=tables, pictures=pictures)


def _curves(shocks: Mapping[str, ShockSpectrum], how: Shocks) -> dict[str, np.ndarray]:
    """Return the shock spectra, and the band of the one that is required."""
    curves = {f"shock, {what}": np.transpose(one[:2]) for what, one in shocks.items()}
    if how.required is not None:
        frequency, level = required(how.required, how.unit)
        for name, decibels in zip(("lowest allowed", "highest allowed"), how.tolerance, strict=True):
            curves[name] = np.column_stack([frequency, level * 10.0 ** (decibels / 20.0)])
    return curves


def _judged(shocks: Mapping[str, ShockSpectrum], how: Shocks) -> Iterator[str]:
    """Yield how shock spectra lie in the band of the one that is required."""
    if how.required is None:
        return
    frequency, level = required(how.required, how.unit)
    low, high = how.tolerance
    for what, one in shocks.items():
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
    return np.exp(np.interp(np.log(at), np.log(frequency), np.log(level)))


def required(path: Path, unit: str) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies [Hz] and accelerations in ``unit`` of a spectrum that is required.

    Raises SceneError, which names file and line.
    """
    frequency, levels = columns_along(path, "Hz", "m/s²")
    if not (frequency[0] > 0.0 and (levels > 0.0).all()):
        raise SceneError(f"{path}: frequencies and accelerations must be above 0")
    return frequency, levels / UNITS[unit]


def _file_name(what: str, number: int) -> str:
    return what if what.isidentifier() else str(number)
