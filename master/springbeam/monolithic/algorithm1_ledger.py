"""What `algorithm1` reports of each step: a row, the energies, and the work that no force of its model does."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..results.trajectory import Event, Trajectory
from ..scene import Scene
from .rows import finished
from .semi_discrete import SemiDiscreteBeam


class PairState(NamedTuple):
    """Beam and spring between two steps."""

    q: np.ndarray  #: unknowns of the mesh [rad, m], their last the tip's deflection
    v: np.ndarray
    y: float  #: [m]
    z: float  #: [m/s]


class StepLedger:
    """Rows and books of Algorithm 1.

    Parameters
    ----------
    load
        Load vector of the beam.
    """

    def __init__(self, scene: Scene, discrete: SemiDiscreteBeam, load: np.ndarray) -> None:
        assert scene.beam is not None
        assert scene.spring is not None
        self._scene, self._spring, self._alpha = scene, scene.spring, scene.beam.alpha_b
        self._discrete, self._load = discrete, load
        self._sampler = discrete.deflection_sampler()
        self._rows: list[dict[str, Any]] = []
        self._totals = {"e_dissipated": 0.0, "e_injected_beam": 0.0, "e_injected_spring": 0.0}

    def dissipate(self, h: float, before: PairState, after: PairState) -> None:
        """Book what the dampers take in a step of ``h`` [s]."""
        rate, dy = (after.q - before.q) / h, after.y - before.y
        beam = self._alpha * float(rate @ (self._discrete.K @ rate)) if self._alpha else 0.0
        self._totals["e_dissipated"] += h * beam + self._spring.damping * dy**2 / h

    def book(
        self,
        h: float,
        before: PairState,
        after: PairState,
        injected: float,
        pressing: float,
        foundation: float,
    ) -> None:
        """Book a step of ``h`` [s] in contact, and the work that no force of the model does.

        That is the work of the overwritten tip on the beam, and of yˡ's exchange on the spring.

        ``injected`` is the part of the force on the tip that no law gives, ``pressing`` the law's force on the spring,
        ``foundation`` N; means over the step [N].
        """
        dy = after.y - before.y
        self.dissipate(h, before, after)
        self._totals["e_injected_beam"] += injected * float(after.q[-1] - before.q[-1])
        gained = self._spring_energy(after) - self._spring_energy(before)
        worked = (foundation - pressing + self._spring.external_force) * dy - self._spring.damping * dy**2 / h
        self._totals["e_injected_spring"] += gained - worked

    def _spring_energy(self, state: PairState) -> float:
        p, y, z = self._spring, state.y, state.z
        return 0.5 * p.mass * z**2 + 0.5 * p.linear_stiffness * y**2 + 0.25 * p.cubic_stiffness * y**4

    def record(
        self,
        time: float,
        state: PairState,
        phase: str,
        on_tip: float = 0.0,
        inside: float = 0.0,
        foundation: float = 0.0,
        case: int = 0,
    ) -> None:
        """Add a row; the forces are means over the step that ends in it [N]."""
        d, (q, v, y, z) = self._discrete, state
        row: dict[str, Any] = {
            "time": time,
            "phase": phase,
            "deflection": self._sampler @ q,
            "u_tip": float(q[-1]),
            "v_tip": float(v[-1]),
            "y": y,
            "z": z,
            "contact_force": on_tip,
            "compliance_force": inside,
            "foundation_force": foundation,
            "e_beam": 0.5 * float(v @ (d.M @ v)) + 0.5 * float(np.sum((d.B @ q) ** 2)),
            "e_spring": self._spring_energy(state),
            "e_contact": 0.0,
            "e_impact_loss": 0.0,
            "e_load": -float(self._load @ q) - self._spring.external_force * y,
            "case": float(case),
            **self._totals,
        }
        self._rows.append(row)

    def trajectory(self, events: list[Event], summary: dict[str, Any]) -> Trajectory:
        """Return the rows as a result, with what they sum up to added to ``summary``."""
        columns = {name: np.array([row[name] for row in self._rows]) for name in self._rows[0]}
        after_contact = columns["case"][1:]
        summary["steps_apart"] = int(np.sum(after_contact == 11))
        summary["steps_joined"] = int(np.sum(after_contact == 14))
        extra = ("case", "e_injected_beam", "e_injected_spring")
        return finished(self._scene, columns, columns.pop("deflection"), events, summary, extra)
