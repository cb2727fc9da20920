"""What a crosscheck finds: compared quantities, changes of contact, and whether all are within their bounds."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...results.trajectory import Trajectory
from ...scene import Scene

#: Factor on what halving the macro step changes.
SAFETY = 4.0
#: Relative tolerance of IDA, the spring FMU's default.
IDA_TOLERANCE = 1e-12


@dataclass(frozen=True)
class QuantityRow:
    """One compared quantity."""

    quantity: str
    error: float  #: max norm, in the quantity's unit
    at: float  #: where it occurred [s]
    l2: float  #: root mean square over the window
    bound: float  #: at that time
    passed: bool
    times: np.ndarray  #: of the compared rows [s]
    errors: np.ndarray
    bounds: np.ndarray

    @classmethod
    def judged(cls, name: str, times: np.ndarray, error: np.ndarray, bound: np.ndarray) -> QuantityRow:
        """Judge the errors of a quantity at ``times`` [s]; the row shows the largest, or the furthest out of bounds."""
        worst, top = int(np.argmax(error / bound)), int(np.argmax(error))
        at = worst if error[worst] > bound[worst] else top
        return cls(
            name, float(error[at]), float(times[at]), float(np.sqrt(np.mean(error**2))), float(bound[at]),
            bool(np.all(error <= bound)), times, error, bound,
        )  # fmt: skip


@dataclass(frozen=True)
class EventRow:
    """One change of contact."""

    kind: str
    time: float | None  #: ``None`` if the co-simulation lacks it
    reference: float
    bound: float
    passed: bool


@dataclass
class Report:
    """What `springbeam.studies.crosscheck.crosscheck` found."""

    scene: Scene  #: as compared: the macro step and t_end may be finer and shorter than asked
    reference: Trajectory
    trajectory: Trajectory
    horizon: float  #: comparable up to here [s]
    growth: float  #: of a perturbation of the reference up to the horizon
    rows: list[QuantityRow] = field(default_factory=list)
    events: list[EventRow] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def passed(self) -> bool:
        return all(row.passed for row in self.rows) and all(row.passed for row in self.events)
