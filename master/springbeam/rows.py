"""What a run reports of each accepted step: a row, and now and then the beam's shape."""

from __future__ import annotations

from operator import itemgetter

from .contact import Joint
from .coupling.compliance import compliance_force
from .ledger import Ledger
from .memory import Memory
from .recording import Recorder
from .scene import Scene
from .stepping import Pair, State
from .trajectory import COLUMNS

#: Steps after first contact whose beam shape is kept, and shapes kept evenly over the run.
_SHAPES_AFTER_CONTACT, _SHAPES_OVER_RUN = 20, 400


class Rows(Memory):
    """Writes rows and shapes of a pair into a recorder, and keeps their extremes."""

    REMEMBERED = ("_shapes_left", "_next_shape", "largest_mismatch", "largest_speed")

    def __init__(self, scene: Scene, pair: Pair, ledger: Ledger, recorder: Recorder, start_time: float) -> None:
        self._scene, self._pair, self._ledger, self._recorder = scene, pair, ledger, recorder
        self._shapes_left = _SHAPES_AFTER_CONTACT
        self._next_shape = start_time
        self._equilibrium = 0.0 if scene.spring is None else scene.spring.equilibrium
        #: The columns of the scene, out of all.
        self._present = itemgetter(*(COLUMNS.index(name) for name in recorder.columns))
        self.largest_mismatch = 0.0  #: |v_tip − z| while tied [m/s]
        self.largest_speed = 0.0  #: of tip and lower end [m/s]

    def write(self, state: State) -> None:
        """The row of the present state. Raises NonFiniteValue."""
        pair, law = self._pair, self._scene.contact
        tip, low = pair.ends()
        (u, v), (y, z) = tip[:2], low[:2]
        joined = state.phase.joint is not Joint.FREE
        contact = smoothed = state.contact[0]
        inside = mismatch = 0.0
        if pair.compliant:
            contact = smoothed = inside = compliance_force(y - u, law.stiffness, law.exponent)
        elif joined:
            smoothed = state.smoothed
        if pair.joinable and not pair.compliant:
            inside = compliance_force(self._equilibrium - u, law.stiffness, law.exponent)
        if joined:
            mismatch = v - z
            if not pair.compliant:
                self.largest_mismatch = max(self.largest_mismatch, abs(mismatch))
        self.largest_speed = max(self.largest_speed, abs(v), abs(z))
        forces = (contact, smoothed, inside, contact - inside, state.foundation[0])
        row = (state.time, u, v, y, z, *forces, u - y, mismatch, str(state.phase))
        self._recorder.row(self._present((*row, *self._ledger.book(*pair.energies()))))
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
