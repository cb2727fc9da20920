"""Accelerations that were recorded, at equal steps (`springbeam.scene.recorded` reads the file)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..scene import SceneError
from ..scene.recorded import Reading, Recorded
from ..scene.units import factor
from .measured import errors_of, scaled

#: Steps that differ by less than this share are equal.
_EQUAL = 1e-3
_ACCELERATION = "m/s²"


class Record(NamedTuple):
    """Recorded accelerations."""

    time: np.ndarray  #: [s], at equal steps, shape (n,)
    values: dict[str, np.ndarray]  #: [m/s²], by the column of the file, shapes (n,)
    unit: str  #: "g" if one of them is in g in the file, else "m/s²"
    notes: list[str]  #: assumptions and changes, in words

    @property
    def step(self) -> float:
        """Return the time between two samples [s]."""
        return float(self.time[-1] - self.time[0]) / (len(self.time) - 1)


def read_record(path: Path, of: Sequence[str], reading: Reading, scales: Mapping[str, str]) -> Record:
    """Read accelerations from a file: the columns ``of`` it, or all that may be accelerations by their units.

    ``scales`` are factors of columns, which may have a unit. Times at unequal steps are replaced by equal ones, no
    longer than the shortest, with values on the lines between samples. Raises SceneError, which names file, line,
    column and remedy.
    """
    with errors_of(path):
        file = Recorded(path, reading)
        there, factors = scaled(file, scales, of=of)
        wanted = [there[name] for name in of] or [k for k in there.values() if _may_be_acceleration(file.units[k])]
        if not wanted:
            raise ValueError(f"no column is an acceleration ({', '.join(there)}); --of COLUMN, with --scale, names one")
        times, columns = file.read(dict.fromkeys(wanted, _ACCELERATION))
    notes = file.notes
    steps = np.diff(times)
    count = len(times)
    if np.ptp(steps) > _EQUAL * steps.mean():
        count = 1 + int(np.ceil((times[-1] - times[0]) / steps.min() - _EQUAL))
        if count > 10 * len(times):
            raise SceneError(f"{path}: the steps are from {steps.min():.3g} to {steps.max():.3g} s; give equal ones")
        notes = [*notes, f"steps of {steps.min():.3g} to {steps.max():.3g} s are made equal, by lines between samples"]
    equal = np.linspace(times[0], times[-1], count)
    values = {file.labels[k]: np.interp(equal, times, factors[k] * columns[k]) for k in wanted}
    in_g = any("g" in file.units[k].replace("/", " ").split() for k in wanted)
    return Record(equal, values, "g" if in_g else _ACCELERATION, notes)


def columns_along(path: Path, along: str, unit: str) -> tuple[np.ndarray, np.ndarray]:
    """Return both columns of a file: the first, ascending, in the unit ``along``, the other one in ``unit``.

    Raises SceneError, which names file, line, column and remedy.
    """
    with errors_of(path):
        file = Recorded(path, Reading(time_column="1"))
        if len(file.units) != 2:
            raise ValueError(f"{len(file.units)} columns; there must be two, in {along} and {unit}")
        first, columns = file.read({1: unit}, along)
    return first, columns[1]


def _may_be_acceleration(unit: str) -> bool:
    try:
        return not unit or factor(unit, _ACCELERATION) > 0.0
    except ValueError:
        return False
