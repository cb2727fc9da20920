"""The result of a run, whoever computed it: columns, events, beam shapes, summary."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..scene import Scene

#: Columns of a whole pair, in file order; those of an absent body are left out.
COLUMNS = (
    "time",
    "u_tip",
    "v_tip",
    "y",
    "z",
    "contact_force",
    "contact_force_smoothed",
    "compliance_force",
    "tie_reaction",
    "foundation_force",
    "gap",
    "velocity_mismatch",
    "phase",
    "e_beam",
    "e_spring",
    "e_contact",
    "e_dissipated",
    "e_impact_loss",
    "e_load",
    "e_total",
    "energy_residual",
)
EVENT_COLUMNS = (
    "time",
    "kind",
    "y",
    "z",
    "u_tip",
    "v_tip",
    "impulse_contact",
    "impulse_foundation",
    "energy_loss",
)
EVENT_KINDS = ("impact", "stop_impact", "release", "retie", "separation", "seated", "unseated")
#: The share of a table's largest value that is a zero, rounded.
_NOISE = 1e-13


@dataclass(frozen=True)
class Event:
    """One event; ``y, z, u_tip, v_tip`` are the values after it, ``None`` for an absent body."""

    time: float
    kind: str
    y: float | None = None
    z: float | None = None
    u_tip: float | None = None
    v_tip: float | None = None
    impulse_contact: float = 0.0  #: on the beam's tip, upward [N·s]
    impulse_foundation: float = 0.0  #: of the foundation, upward [N·s]
    energy_loss: float = 0.0  #: [J]


def rounded(value: float, scale: float) -> str:
    """``value`` in four digits; "0" for what rounding leaves of a zero, beside the largest of its kind, ``scale``."""
    return "0" if abs(value) <= _NOISE * scale else f"{value:.4g}"


@dataclass
class Trajectory:
    """Columns as numpy arrays under the names of `COLUMNS`: ``trajectory["y"]`` or ``trajectory.y``.

    ``shapes`` holds ``(time, deflection)`` with ``deflection`` of shape (n, 21) [m], or ``None`` without a beam.
    """

    scene: Scene
    columns: dict[str, np.ndarray]
    events: list[Event] = field(default_factory=list)
    shapes: tuple[np.ndarray, np.ndarray] | None = None
    summary: dict[str, Any] = field(default_factory=dict)

    def __getitem__(self, name: str) -> np.ndarray:
        return self.columns[name]

    def __getattr__(self, name: str) -> np.ndarray:
        try:
            columns: dict[str, np.ndarray] = self.__dict__["columns"]
            return columns[name]
        except KeyError:
            raise AttributeError(name) from None

    def __len__(self) -> int:
        return len(self.columns["time"])
