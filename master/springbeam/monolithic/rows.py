"""Rows of an event-driven run: states recorded with their phases, and the columns that follow from them."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..results.trajectory import Trajectory, columns_of
from .laws import Phase
from .transitions import HybridState

_ENERGIES = ("e_beam", "e_spring", "e_contact", "e_dissipated", "e_impact_loss", "e_load")


class Rows:
    """States recorded so far in a run, each with its time, its phase, and what impacts had lost by then."""

    def __init__(self, state: HybridState) -> None:
        self._state, self._system = state, state.system
        self._rows: list[tuple[float, np.ndarray, Phase, float]] = []

    def record(self, time: float, X: np.ndarray) -> None:
        """Keep ``X`` at ``time`` [s], in the phase in which the run is."""
        self._rows.append((time, X.copy(), self._state.phase, self._state.loss))

    def trajectory(self, summary: dict[str, Any]) -> Trajectory:
        """Return the result of the run, with its ledger added to ``summary``."""
        s = self._system
        states = np.array([X for _, X, _, _ in self._rows]).reshape(len(self._rows), s.size)
        columns = self._columns(states)
        self._derive(columns)
        residual = columns["energy_residual"]
        scale = max(float(np.max(np.abs(columns[c]))) for c in ("e_beam", "e_spring", "e_contact", "e_load"))
        largest = float(np.max(np.abs(residual)))
        summary["largest_energy_residual"] = largest
        summary["largest_relative_energy_residual"] = largest / scale if scale > 0.0 else 0.0
        summary["seat_height"] = None if s.scene.stop is None else self._state.seat_height()
        deflection = s.shapes(states)
        shapes = None if deflection is None else (columns["time"], deflection)
        loads = s.loads.values(columns["time"])
        columns |= {f"load_{i}": values for i, values in enumerate(loads.T)}
        ordered = {name: columns[name] for name in columns_of(s.scene) if name in columns}
        return Trajectory(s.scene, ordered, self._state.events, shapes, summary)

    def _columns(self, states: np.ndarray) -> dict[str, np.ndarray]:
        """What the equations of each row's phase give."""
        s, phases = self._system, [phase for _, _, phase, _ in self._rows]
        columns: dict[str, np.ndarray] = {
            "time": np.array([time for time, _, _, _ in self._rows]),
            "phase": np.array([phase.name for phase in phases], dtype="<U8"),
            "e_impact_loss": np.array([loss for _, _, _, loss in self._rows]),
        }
        for phase in set(phases):
            index = np.array([k for k, p in enumerate(phases) if p == phase])
            m = s.motion(phase, states[index])
            values = {
                "u_tip": m.u,
                "v_tip": m.v,
                "y": m.y,
                "z": m.z,
                "contact_force": m.C,
                "foundation_force": m.N,
                **s.energies(states[index], phase),
            }
            for name, value in values.items():
                columns.setdefault(name, np.zeros(len(phases)))[index] = value
        return columns

    def _derive(self, columns: dict[str, np.ndarray]) -> None:
        """Add what follows from other columns."""
        s = self._system
        if s.two_ends:
            columns["gap"] = columns["u_tip"] - columns["y"]
            together = columns["phase"] != "free"
            columns["velocity_mismatch"] = np.where(together, columns["v_tip"] - columns["z"], 0.0)
            C = columns["contact_force"]
            inside = s.law.inside(C, columns["u_tip"])
            columns["compliance_force"], columns["tie_reaction"] = inside, C - inside
        elif s.scene.stop is not None and s.beam is not None:
            columns["gap"] = columns["u_tip"] - s.stop.position
        columns["e_total"] = np.sum([columns[name] for name in _ENERGIES], axis=0)
        columns["energy_residual"] = columns["e_total"] - columns["e_total"][0]
