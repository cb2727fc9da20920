"""What a run reports of each accepted step: a row, and now and then the beam's shape."""

from __future__ import annotations

from math import inf, sqrt
from operator import itemgetter

from ..bodies.checkpointed import Checkpointed
from ..bodies.protocol import NO_FORCE, BeamBody
from ..contact.events import gap
from ..contact.laws import Compliance
from ..contact.phases import Joint
from ..coupling.protocol import Step
from ..results.paths import Path
from ..results.recording import Recorder
from ..results.steps import packed
from ..results.trajectory import COLUMNS
from ..scene import Scene
from ..scene.resolution import VIBRATION
from .ledger import Balance
from .stepping import Pair, State

#: Steps after first contact whose beam shape is kept, and shapes kept evenly over the run.
_SHAPES_AFTER_CONTACT, _SHAPES_OVER_RUN = 20, 400
#: Largest value of a column that the motion does not depend on [N]; pictures multiply two of them.
_MOST_SHOWN = 1e150
#: Warning of a run that has reached it.
NOT_SHOWN = (
    f"compliance_force is larger than {_MOST_SHOWN:g} N at times and is written as that, tie_reaction with it; "
    "the motion does not depend on either. A smaller contact.stiffness or contact.exponent keeps them in range"
)


class Rows(Checkpointed):
    """Writes rows and shapes of a pair into a recorder, and keeps their extremes."""

    CHECKPOINTED = (
        *("_shapes_left", "_next_shape", "largest_mismatch", "largest_speed", "_relative_speed", "_deepest"),
        *("contact_steps", "not_shown", "_mismatch_energy", "_last_strike"),
    )

    def __init__(self, scene: Scene, pair: Pair, balance: Balance, recorder: Recorder, start_time: float) -> None:
        self._pair, self._balance, self._recorder = pair, balance, recorder
        self._shapes_left = _SHAPES_AFTER_CONTACT
        self._next_shape = start_time
        #: The normal-compliance part of a rigid contact's force, as the paper has it.
        self._inside = Compliance(scene.contact.stiffness, scene.contact.exponent)
        length = scene.time.t_end - start_time or 1.0  # 0 where contact is at t_end: the one shape is that of the start
        self._shape_every = length / _SHAPES_OVER_RUN
        #: The columns of the scene, out of all.
        known = (*COLUMNS, *(f"load_{i}" for i in range(len(scene.loads))))
        self._present = itemgetter(*(known.index(name) for name in recorder.columns))
        self.largest_mismatch = 0.0  #: |v_tip − z| while tied [m/s]
        self._mismatch_energy = 0.0  #: of the same where the joined ends part or strike the foundation [J]
        self._last_strike = -inf  #: [s]
        self._relative_speed = 0.0  #: |v_tip − z| of ends that a soft law couples [m/s]
        self._deepest = 0.0  #: penetration of ends that a soft law couples [m]
        self.contact_steps = 0  #: with a force of a soft law
        #: [1/kg] of what a contact force moves.
        self._inverse_mass = sum(1.0 / body.mass for body in (pair.upper, pair.lower) if body.mass > 0.0)
        self.largest_speed = 0.0  #: of tip and lower end [m/s]
        self.not_shown = False  #: whether a compliance force was too large for its column

    def write(self, state: State, step: Step | None) -> None:
        """The row of the present state, at the end of ``step`` or of none. Raises NonFiniteValue."""
        pair, time, phase = self._pair, state.time, state.phase
        (u, v, _, _), (y, z, _, _) = ends = pair.ends()
        joined = phase.joint is not Joint.FREE
        contact = state.contact[0]
        smoothed = state.smoothed if joined else contact
        inside, reaction, mismatch = 0.0, contact, v - z if joined else 0.0
        if pair.law.soft:
            inside, reaction = pair.law.force(y - u, z - v), 0.0
            if abs(z - v) > self._relative_speed:
                self._relative_speed = abs(z - v)
        else:
            if abs(mismatch) > self.largest_mismatch:
                self.largest_mismatch = abs(mismatch)
            if pair.joinable and not pair.law.lasting:
                inside = self._diagnostic(pair.equilibrium - u)
                reaction = contact - inside
        speed = max(abs(v), abs(z))
        if speed > self.largest_speed:
            self.largest_speed = speed
        forces = (contact, smoothed, inside, reaction, state.foundation[0])
        booked, loads = self._balance.book(ends), pair.loads.values(time)
        row = (time, u, v, y, z, *forces, u - y, mismatch, phase.name, *booked, *loads)
        if step is None or step.size == 0.0:
            kept = packed(time, 0.0, *ends[0], *ends[1], *NO_FORCE, 0.0)
        else:
            tip, low = step.end
            kept = packed(time, step.size, *tip, *low, *step.contact, step.foundation[0])
        self._recorder.row(self._present(row), kept)
        if isinstance(pair.beam, BeamBody):
            early = joined and self._shapes_left > 0
            if early or time >= self._next_shape:
                self._shape(pair.beam, time, early)

    def note_mismatch(self, state: State, kind: str, macro_step: float) -> None:
        """Note how far the velocities of joined ends differ as they part, or strike the foundation.

        Strikes less than ``macro_step`` [s] after another one are left out, and what happens at the start of a phase:
        they may be as slow as one likes.
        """
        first = state.steps_in_phase > 0
        if kind == "stop_impact":
            first &= state.time - self._last_strike > macro_step
            self._last_strike = state.time
        if first and not self._pair.law.soft and state.phase.joint is not Joint.FREE:
            v, z = (end.velocity for end in self._pair.ends())
            energy = 0.5 * self._pair.reduced_mass(state.phase) * (v - z) ** 2
            self._mismatch_energy = max(self._mismatch_energy, energy)

    @property
    def mismatch_at_events(self) -> float:
        """Return the largest mismatch noted, as √ of its energy over the largest energy so far."""
        scale = self._balance.ledger.scale
        return sqrt(self._mismatch_energy / scale) if scale > 0.0 else 0.0

    def note_penetration(self, step: Step) -> None:
        """Note how deep the ends of a soft law have sunk into each other on ``step``, also inside it.

        A law that never opens is linear: how deep does not matter.
        """
        if not any(step.contact):
            return
        self.contact_steps += 1
        tip, low = step.end
        depth = low.displacement - tip.displacement
        if depth <= 0.0 and self._pair.opens_softly:
            path = Path.through(gap(step.start), gap(step.end), step.size, gap.means(step.end, step.size))
            inside = path.lowest_inside()
            depth = 0.0 if inside is None else -path.at(inside)
        if depth > self._deepest:
            self._deepest = depth

    @property
    def contact_frequency(self) -> float:
        """Return √(k (1/m_tip + 1/m)) of a soft contact at its stiffest so far [rad/s], 0 without one.

        It is 0 as well of a link whose ends move as one: however stiff, it does not swing.
        """
        law = self._pair.law
        if not law.soft or (law.lasting and self._relative_speed <= VIBRATION * self.largest_speed):
            return 0.0
        return sqrt(law.slope(self._deepest) * self._inverse_mass)

    def _diagnostic(self, p: float) -> float:
        """Return the normal-compliance part of a tied contact [N] at a penetration ``p`` [m]; it drives nothing."""
        try:
            force = self._inside.force(p)
        except OverflowError:
            force = inf
        self.not_shown |= force > _MOST_SHOWN
        return min(force, _MOST_SHOWN)

    def _shape(self, beam: BeamBody, time: float, early: bool) -> None:
        self._shapes_left -= early
        if time >= self._next_shape:
            self._next_shape += self._shape_every * ((time - self._next_shape) // self._shape_every + 1.0)
        self._recorder.shape(time, beam.shape())
