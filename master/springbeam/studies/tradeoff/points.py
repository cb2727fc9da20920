"""The points of a tradeoff: each a configuration with its errors against the reference and its cost.

Errors are those of displacements, event times, impulses and energy.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import TypeAdapter
from rich.table import Table

from ...results.contact_times import contact_time_difference, impulse_difference
from ...results.trajectory import Trajectory
from ..tables import number, table
from .configurations import ALGORITHM_1

#: Contacts shorter than this many macro steps are no evidence either way.
_SHORT = 2.0
#: Relative errors for which the cheapest configuration is named.
TARGETS = (1e-2, 1e-4, 1e-6, 1e-8)
#: Columns of the CSV file.
_COSTS = ("solve", "solve_spread", "setup", "macro_steps", "beam_steps", "spring_steps", "rollbacks", "ida_steps")


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


@dataclass(frozen=True)
class Point:
    """A configuration, its errors and its cost."""

    family: str
    setting: str
    method: str
    refined: bool  #: judged by the reference on a finer mesh
    unknowns: int  #: of the beam as integrated
    macro_step: float | None  #: H [s]; ``None`` where tolerances choose it
    errors: Errors | None  #: ``None`` if the run stopped early
    cause: str  #: why it stopped, or empty
    solve: float  #: median wall time [s] from the start to the end of the window
    solve_spread: float  #: largest minus smallest [s]
    setup: float  #: wall time before the first step [s]: loading and initialising FMUs, or the modal decomposition
    macro_steps: int = 0
    beam_steps: int = 0  #: doStep calls, those that were rolled back included
    spring_steps: int = 0
    rollbacks: int = 0
    ida_steps: int = 0

    @property
    def name(self) -> str:
        return f"{self.family}, {self.setting}"

    @property
    def monolithic(self) -> bool:
        return self.method != "co-simulation"

    @property
    def do_steps(self) -> int:
        """doStep calls of both FMUs."""
        return self.beam_steps + self.spring_steps

    @property
    def displacement(self) -> float:
        return math.inf if self.errors is None else self.errors.displacement

    def row(self) -> dict[str, Any]:
        """Return the row of the CSV file."""
        against = "finer mesh" if self.refined else "same model"
        errors = dict.fromkeys(Errors.__dataclass_fields__) if self.errors is None else vars(self.errors)
        costs = {name: getattr(self, name) for name in _COSTS}
        return {"family": self.family, "setting": self.setting, "against": against, **errors, **costs}

    def summary(self) -> dict[str, Any]:
        """Return what is said of it to programs."""
        return {"name": self.name, "error": self.displacement, "solve": self.solve, "setup": self.setup}


_POINTS = TypeAdapter(list[Point])


@dataclass(frozen=True)
class Cheapest:
    """The cheapest ways to an error, by this package and by scipy's solvers; ``None`` where none gets there."""

    target: float
    ours: Point | None
    scipy: Point | None

    @property
    def ratio(self) -> float | None:
        """How many times as long scipy takes."""
        return self.scipy.solve / self.ours.solve if self.ours and self.scipy else None


@dataclass(frozen=True)
class Points:
    """The points of a tradeoff, judged together."""

    points: list[Point]

    @classmethod
    def of(cls, records: Iterable[Mapping[str, Any]]) -> Points:
        """Return the points of the records."""
        return cls(_POINTS.validate_python([point for record in records for point in record["points"]]))

    def front(self) -> list[Point]:
        """Return the Pareto front, the cheapest first: no other point is both quicker and more accurate.

        Errors of a tenth of the motion and more are no results.
        """
        best, front = 0.1, []
        for point in sorted((p for p in self.points if not p.refined), key=lambda p: p.solve):
            if point.displacement < best:
                best = point.displacement
                front.append(point)
        return front

    def cheapest(self) -> list[Cheapest]:
        """Return the cheapest configurations for each of `TARGETS`."""

        def best(points: Iterable[Point], target: float) -> Point | None:
            good = [p for p in points if p.displacement <= target]
            return min(good, key=lambda p: p.solve, default=None)

        same = [p for p in self.points if not p.refined]
        ours = [p for p in same if not p.monolithic]
        theirs = [p for p in same if p.monolithic and p.method != ALGORITHM_1]
        return [Cheapest(target, best(ours, target), best(theirs, target)) for target in TARGETS]

    def document(self) -> dict[str, Any]:
        """Return what is said to programs: the cheapest, and the front."""
        cheapest = [
            {"error": choice.target, "co_simulation": choice.ours and choice.ours.summary()}
            | {"scipy": choice.scipy and choice.scipy.summary()}
            for choice in self.cheapest()
        ]
        return {"cheapest": cheapest, "front": [point.summary() for point in self.front()]}

    def tables(self) -> Iterator[Table]:
        """Yield for a terminal the cheapest, and the front."""

        def shown(point: Point | None) -> tuple[str, str]:
            return ("none gets there", "") if point is None else (point.name, f"{1e3 * point.solve:.3g}")

        cheapest = [
            (f"{best.target:.0e}", *shown(best.ours), *shown(best.scipy), number(best.ratio, ".1f"))
            for best in self.cheapest()
        ]
        names = ("error", "co-simulation", "[ms]", "scipy", "[ms]", "ratio")
        yield table(names, cheapest, "cheapest for an error (solve time)", words=("co-simulation", "scipy"))
        front = [
            (
                *(point.name, f"{point.displacement:.1e}", f"{point.errors.event_time:.1e}" if point.errors else ""),
                *(f"{1e3 * point.solve:.3g}", f"{1e3 * point.setup:.3g}", str(point.do_steps or "")),
            )
            for point in self.front()
        ]
        yield table(
            ("configuration", "error", "event [s]", "solve [ms]", "set-up [ms]", "doSteps"), front, "Pareto front"
        )
