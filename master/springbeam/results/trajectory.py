"""The result of a run, whoever computed it: columns, events, beam shapes, summary."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..scene import Scene
from ..scene.statics import SHAPE_POINTS

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
#: Columns of the table of shapes: time [s] and deflections [m] at `SHAPE_POINTS`.
SHAPE_COLUMNS = ("time", *(f"u_{i}" for i in range(len(SHAPE_POINTS))))
#: Most characters of a phase's name.
PHASE_WIDTH = 32
_BEAM_COLUMNS = frozenset({"u_tip", "v_tip", "e_beam"})
_SPRING_COLUMNS = frozenset({"y", "z", "e_spring"})
_PAIR_COLUMNS = frozenset(
    {"contact_force", "contact_force_smoothed", "compliance_force", "tie_reaction", "velocity_mismatch", "e_contact"}
)
#: A number below this share of its table's largest is a zero, rounded.
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


def columns_of(scene: Scene) -> tuple[str, ...]:
    """Return the columns of ``scene`` in file order: `COLUMNS` without those of bodies that it does not have.

    ``gap`` is u_tip − y of a pair, u_tip − φ of a beam above a stop.
    """
    beam, spring, stop = scene.beam is not None, scene.spring is not None, scene.stop is not None
    absent: set[str] = set()
    if not beam:
        absent |= _BEAM_COLUMNS
    if not spring:
        absent |= _SPRING_COLUMNS
    if not (beam and spring):
        absent |= _PAIR_COLUMNS
    if not stop:
        absent.add("foundation_force")
    if not (beam and (spring or stop)):
        absent.add("gap")
    return tuple(name for name in COLUMNS if name not in absent)


def rounded(value: float, scale: float) -> str:
    """Return ``value`` in four digits; "0" for a zero rounded, told by ``scale``, the largest of its kind."""
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

    @property
    def do_steps(self) -> int:
        """doStep calls of both FMUs, those that were rolled back included."""
        return sum(int(self.summary.get(f"{body}_steps", 0)) for body in ("beam", "spring"))

    def __len__(self) -> int:
        return len(self.columns["time"])
