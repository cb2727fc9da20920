"""What a run reports of each accepted step: a row, and now and then the beam's shape."""

from __future__ import annotations

from typing import Any

from .contact import Joint
from .coupling.compliance import compliance_force
from .ledger import Ledger
from .recording import Recorder
from .scene import Scene
from .stepping import Pair, State

#: Steps after first contact whose beam shape is kept, and shapes kept evenly over the run.
_SHAPES_AFTER_CONTACT, _SHAPES_OVER_RUN = 20, 400


class Rows:
    """Writes rows and shapes of a pair into a recorder, and keeps their extremes."""

    def __init__(self, scene: Scene, pair: Pair, ledger: Ledger, recorder: Recorder, start_time: float) -> None:
        self._scene, self._pair, self._ledger, self._recorder = scene, pair, ledger, recorder
        self._shapes_left = _SHAPES_AFTER_CONTACT
        self._next_shape = start_time
        self.largest_mismatch = 0.0  #: |v_tip − z| while tied [m/s]
        self.largest_speed = 0.0  #: of tip and lower end [m/s]

    def write(self, state: State) -> None:
        """The row of the present state. Raises NonFiniteValue."""
        pair, law = self._pair, self._scene.contact
        tip, low = pair.ends()
        row: dict[str, Any] = {"time": state.time, "phase": str(state.phase)}
        row.update(u_tip=tip.displacement, v_tip=tip.velocity, y=low.displacement, z=low.velocity)
        row["gap"] = tip.displacement - low.displacement
        contact = state.contact[0]
        if pair.compliant:
            contact = compliance_force(-row["gap"], law.stiffness, law.exponent)
        joined = state.phase.joint is not Joint.FREE
        row["contact_force"] = contact
        row["contact_force_smoothed"] = state.smoothed if joined and not pair.compliant else contact
        if pair.joinable:
            assert self._scene.spring is not None
            depth = self._scene.spring.equilibrium - tip.displacement
            row["compliance_force"] = (
                contact if pair.compliant else compliance_force(depth, law.stiffness, law.exponent)
            )
            row["tie_reaction"] = contact - row["compliance_force"]
            row["velocity_mismatch"] = tip.velocity - low.velocity if joined else 0.0
            if joined and not pair.compliant:
                self.largest_mismatch = max(self.largest_mismatch, abs(row["velocity_mismatch"]))
        row["foundation_force"] = state.foundation[0]
        self.largest_speed = max(self.largest_speed, abs(tip.velocity), abs(low.velocity))
        row.update(self._ledger.book(*pair.energies()))
        self._recorder.row(row)
        self._shape(state.time, joined)

    def _shape(self, time: float, joined: bool) -> None:
        if self._pair.beam is None:
            return
        early = joined and self._shapes_left > 0
        if not early and time < self._next_shape:
            return
        self._shapes_left -= early
        span = self._scene.time.t_end / _SHAPES_OVER_RUN
        while self._next_shape <= time:
            self._next_shape += span
        self._recorder.shape(time, self._pair.beam.shape())
