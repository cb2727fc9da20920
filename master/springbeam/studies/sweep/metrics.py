"""What is kept of each run of a sweep: one number per metric, the same on every machine that runs it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...results.totals import LOSS_NAMES, TOTAL_UNITS
from ...results.trajectory import EVENT_KINDS, Trajectory


def _extreme(column: str, pick: Callable[[np.ndarray], float]) -> Callable[[Trajectory], float | None]:
    return lambda run: float(pick(run[column])) if column in run.columns else None


def _last(column: str) -> Callable[[Trajectory], float | None]:
    return lambda run: float(run[column][-1]) if column in run.columns else None


def _first(kind: str) -> Callable[[Trajectory], float | None]:
    return lambda run: next((event.time for event in run.events if event.kind == kind), None)


def _number(kind: str) -> Callable[[Trajectory], float | None]:
    return lambda run: float(sum(event.kind == kind for event in run.events))


def _total(name: str) -> Callable[[Trajectory], float | None]:
    return lambda run: float(run.summary[name]) if name in run.summary else None


#: Name → value of a run; ``None`` where the scene has no such thing, or it did not happen.
METRICS: dict[str, Callable[[Trajectory], float | None]] = {
    "u_tip_min": _extreme("u_tip", np.min),
    "u_tip_max": _extreme("u_tip", np.max),
    "u_tip_end": _last("u_tip"),
    "y_min": _extreme("y", np.min),
    "y_max": _extreme("y", np.max),
    "y_end": _last("y"),
    "z_max": _extreme("z", lambda z: np.max(np.abs(z))),
    "gap_max": _extreme("gap", np.max),
    **{name: _total(name) for name in (*TOTAL_UNITS, *LOSS_NAMES)},
    "dissipated": _last("e_dissipated"),
    "impact_loss": _last("e_impact_loss"),
    "energy_residual": lambda run: float(run.summary["max_energy_residual"]),
    "macro_steps": lambda run: float(run.summary["macro_steps"]),
    **{f"first_{kind}": _first(kind) for kind in EVENT_KINDS},
    **{f"number_of_{kind}": _number(kind) for kind in EVENT_KINDS},
}
#: Units of the metrics that have one; `z_max` is the largest |z|.
UNITS = {
    **dict.fromkeys(("u_tip_min", "u_tip_max", "u_tip_end", "y_min", "y_max", "y_end", "gap_max"), "m"),
    "z_max": "m/s",
    **{name: unit for name, unit in TOTAL_UNITS.items() if unit},
    **dict.fromkeys(LOSS_NAMES, "J"),
    **dict.fromkeys(("dissipated", "impact_loss"), "J"),
    **{f"first_{kind}": "s" for kind in EVENT_KINDS},
}
