"""The errors of a run against the reference: displacements, event times, impulses, energy."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...results.contact_times import contact_time_difference, impulse_difference
from ...results.trajectory import Trajectory

#: Contacts shorter than this many macro steps are no evidence either way.
_SHORT = 2.0


@dataclass(frozen=True)
class Errors:
    """Relative errors over the compared window; NaN where the scene or the run lacks the quantity.

    Displacements are relative to the largest deviation of the reference from its start, impulses to the sum of the
    reference's, the energy residual to the largest energy.
    """

    u_tip_max: float
    u_tip_l2: float  #: root mean square
    y_max: float
    y_l2: float
    event_time: float  #: largest of a change of contact, from the nearest one of the reference [s]
    impulse: float
    energy: float

    @property
    def displacement(self) -> float:
        """Return the larger of the maximum errors of u_tip and y."""
        return float(np.nanmax([self.u_tip_max, self.y_max]))

    @classmethod
    def of(cls, known: Mapping[str, float | None]) -> Errors:
        """Return the errors of a record, which has ``None`` in place of NaN."""
        return cls(**{name: math.nan if value is None else value for name, value in known.items()})


def errors(run: Trajectory, reference: Trajectory, macro_step: float) -> Errors:
    """Return the errors of ``run`` at those of its rows whose times the reference has.

    ``macro_step`` [s] says which contacts are too short for the run to see.
    """
    index = np.searchsorted(reference.time, run.time).clip(max=len(reference) - 1)
    rows = np.flatnonzero(reference.time[index] == run.time)
    index = index[rows]
    values: dict[str, float] = {}
    for name in ("u_tip", "y"):
        if name in run.columns and name in reference.columns:
            exact = reference[name]
            scale = float(np.abs(exact - exact[0]).max()) or 1.0
            difference = (run[name][rows] - exact[index]) / scale
            values[f"{name}_max"] = float(np.abs(difference).max())
            values[f"{name}_l2"] = float(np.sqrt(np.mean(difference**2)))
        else:
            values[f"{name}_max"] = values[f"{name}_l2"] = float("nan")
    return Errors(
        **values,
        event_time=contact_time_difference(run, reference, _SHORT * macro_step)[0],
        impulse=impulse_difference(run, reference),
        energy=_energy(run.summary),
    )


def _energy(summary: dict[str, Any]) -> float:
    for key in ("max_energy_residual", "largest_relative_energy_residual"):
        if key in summary:
            return float(summary[key])
    return float("nan")
