"""Rows of a reference: states of an event-driven run, recorded with their phases, and the columns of its result."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..motion.events import Event
from ..results.trajectory import Trajectory, columns_of
from ..scene import Scene
from .laws import ReferencePhase
from .semi_discrete import ModalBeam, assemble, constant_forces, points, unit_forces
from .transitions import HybridState

_ENERGIES = ("e_beam", "e_spring", "e_contact", "e_dissipated", "e_impact_loss", "e_load")


class Rows:
    """States recorded so far in a run, each with its time, its phase, and what impacts had lost by then."""

    def __init__(self, state: HybridState) -> None:
        self._state = state
        self._rows: list[tuple[float, np.ndarray, ReferencePhase, float]] = []

    def record(self, time: float, X: np.ndarray) -> None:
        """Keep a state X in the phase in which the run is."""
        self._rows.append((time, X.copy(), self._state.phase, self._state.loss))

    def trajectory(self, summary: dict[str, Any]) -> Trajectory:
        """Return the result of the run, with its ledger added to ``summary``."""
        s = self._state.system
        times, states, phases, losses = zip(*self._rows, strict=True)
        X = np.array(states)
        columns: dict[str, np.ndarray] = {
            "time": np.array(times),
            "phase": np.array([phase.name for phase in phases], dtype="<U8"),
            "e_impact_loss": np.array(losses),
        }
        columns |= {f"load_{i}": values for i, values in enumerate(s.loads.values(columns["time"]).T)}
        clamp = None if s.beam is None or s.scene.massless else Clamp(s.scene, s.beam)
        for phase in set(phases):
            index = np.array([k for k, p in enumerate(phases) if p == phase])
            m = s.motion(phase, X[index])
            values = {"u_tip": m.u, "v_tip": m.v, "y": m.y, "z": m.z, "contact_force": m.C, "foundation_force": m.N}
            values |= {"a_tip": m.a @ s.tip, "a_y": m.z_dot, "compliance_force": s.law.inside(m.C, m.u)}
            values |= s.energies(X[index], phase)
            if clamp is not None:
                reaction = clamp.reaction(m.a[:, : s.r], m.C, s.loads.values(columns["time"][index]))
                values["clamp_force"], values["clamp_moment"] = reaction
            for name, value in values.items():
                columns.setdefault(name, np.zeros(len(X)))[index] = value
        return finished(s.scene, columns, s.shapes(X), self._state.events, summary)


def finished(
    scene: Scene,
    columns: dict[str, np.ndarray],
    shapes: np.ndarray | None,
    events: list[Event],
    summary: dict[str, Any],
    extra: Sequence[str] = (),
) -> Trajectory:
    """Return the result of a reference: ``columns``, what follows from them, and their balance in ``summary``.

    ``shapes`` are deflections, bending moments and shear forces as of `HybridSystem.shapes`, ``None`` without a beam;
    ``extra`` names the columns that only this reference has.
    """
    if scene.coupled:
        columns["gap"] = columns["u_tip"] - columns["y"]
        columns["tie_reaction"] = columns["contact_force"] - columns["compliance_force"]
    elif scene.stop is not None and shapes is not None:
        columns["gap"] = columns["u_tip"] - scene.stop.position
    columns["e_total"] = np.sum([columns[name] for name in _ENERGIES], axis=0)
    columns["energy_residual"] = columns["e_total"] - columns["e_total"][0]
    scale = max(float(np.max(np.abs(columns[c]))) for c in ("e_beam", "e_spring", "e_contact", "e_load"))
    largest = float(np.max(np.abs(columns["energy_residual"])))
    summary["largest_relative_energy_residual"] = largest / scale if scale > 0.0 else 0.0
    ordered = {name: columns[name] for name in (*columns_of(scene), *extra) if name in columns}
    table = None if shapes is None else np.column_stack([columns["time"], shapes])
    return Trajectory(scene, ordered, events, summary=summary, shape_table=table)


class Clamp:
    """What holds the beam of ``scene``, whose modes are those of ``modes``."""

    def __init__(self, scene: Scene, modes: ModalBeam) -> None:
        beam = scene.beam
        assert beam is not None
        self._length = beam.length
        mesh = assemble(beam)
        x, dx = points(beam)
        mass = beam.density * beam.area
        inertia = beam.density * beam.second_moment_of_area
        deflection = mesh.nodal(x, dx)  # its integral of each unknown of the mesh
        rotation = np.roll(deflection, -1)  # θ has the shapes of u, one place before it
        #: Rates of momentum and of moment of momentum of a unit of each modal acceleration, shape (2, r).
        self._inertia = np.array([mass * deflection, mass * mesh.nodal(x, x * dx) + inertia * rotation]) @ modes.basis
        forces = constant_forces(beam), *(unit_forces(beam, load) for load in scene.loads)
        #: Force [N] and moment about the clamp [N·m] of the constant loads, (2,), and of a unit of each other, (2, n).
        self._constant, *varying = (np.array([P.sum(), x @ P]) for x, P in forces)
        self._varying = np.reshape(varying, (-1, 2)).T

    def reaction(self, acceleration: np.ndarray, contact: np.ndarray, loads: np.ndarray) -> np.ndarray:
        """Return the clamp's force, upward [N], and moment, counter-clockwise [N·m], shape (2, k).

        Parameters
        ----------
        acceleration
            ä of the modes, shape (k, r).
        contact
            C [N], shape (k,).
        loads
            The loads of the scene, each in its unit, shape (k, n).
        """
        on_beam = np.array([contact, contact * self._length]) + self._constant[:, None] + self._varying @ loads.T
        return self._inertia @ acceleration.T - on_beam
