"""The errors of a run against the reference: displacements, event times, impulses, energy."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...results.contact_times import contact_time_difference, impulse_difference
from ...results.trajectory import Trajectory

#: Contacts shorter than this many macro steps are no evidence either way.
_SHORT = 2.0


@dataclass(frozen=True)
class Errors:
    """Relative errors over the compared window; ``None`` where the scene or the run lacks the quantity.

    Displacements are relative to the largest deviation of the reference from its start, impulses to the sum of the
    reference's, the energy residual to the largest energy.
    """

    u_tip_max: float | None
    u_tip_l2: float | None  #: root mean square
    y_max: float | None
    y_l2: float | None
    event_time: float  #: largest of a change of contact, from the nearest one of the reference [s]
    impulse: float | None
    energy: float | None

    @property
    def displacement(self) -> float:
        """Return the larger of the maximum errors of u_tip and y, ∞ without any."""
        return max((error for error in (self.u_tip_max, self.y_max) if error is not None), default=math.inf)


def errors(run: Trajectory, reference: Trajectory, macro_step: float) -> Errors:
    """Return the errors of ``run`` at those of its rows whose times the reference has.

    ``macro_step`` [s] says which contacts are too short for the run to see.
    """
    index = np.searchsorted(reference.time, run.time).clip(max=len(reference) - 1)
    rows = np.flatnonzero(reference.time[index] == run.time)
    index = index[rows]
    values: dict[str, float | None] = dict.fromkeys(("u_tip_max", "u_tip_l2", "y_max", "y_l2"))
    for name in ("u_tip", "y"):
        if name in run.columns and name in reference.columns:
            exact = reference[name]
            scale = float(np.abs(exact - exact[0]).max()) or 1.0
            difference = (run[name][rows] - exact[index]) / scale
            values[f"{name}_max"] = float(np.abs(difference).max())
            values[f"{name}_l2"] = float(np.sqrt(np.mean(difference**2)))
    residuals = (run.summary.get(key) for key in ("max_energy_residual", "largest_relative_energy_residual"))
    return Errors(
        **values,
        event_time=contact_time_difference(run, reference, _SHORT * macro_step)[0],
        impulse=impulse_difference(run, reference),
        energy=next((float(residual) for residual in residuals if residual is not None), None),
    )
