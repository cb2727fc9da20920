"""What a run shows of how well its macro steps follow the motion, for `springbeam.scene.resolution`."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import NamedTuple

import numpy as np

from ..contact.laws import SoftLaw
from ..contact.phases import Phase
from ..results.columns import MOST_SHOWN, normal_compliance
from ..results.paths import Path
from ..results.steps import joined
from ..results.trajectory import Event
from ..scene import Scene
from ..scene.resolution import VIBRATION
from .ledger import errors
from .stepping import Pair

#: Warning of a run in which a force was too large for its column.
NOT_SHOWN = (
    f"compliance_force is larger than {MOST_SHOWN:g} N at times and is written as that, tie_reaction with it; "
    "the motion does not depend on either. A smaller contact.stiffness or contact.exponent keeps them in range"
)


class Observed(NamedTuple):
    """What the records of a run tell; all 0 where there is nothing of it."""

    speed: float = 0.0  #: the largest of an end [m/s]
    mismatch: float = 0.0  #: |v_tip − z| of ends that a rigid law joins [m/s]
    mismatch_at_events: float = 0.0  #: the same where joined ends part or strike: √ of its energy over the largest
    contact_frequency: float = 0.0  #: √(k (1/m_tip + 1/m)) of a soft contact at its stiffest [rad/s]
    contact_steps: int = 0  #: with a force of a soft law
    hidden: bool = False  #: whether a compliance force was too large for its column


def observed(scene: Scene, pair: Pair, steps: np.ndarray, events: Sequence[Event]) -> Observed:
    """Return what all records and events of a run show."""
    if not len(steps):
        return Observed()
    v, z = steps["v_tip_after"], steps["z_after"]
    speed, apart = float(np.abs([v, z]).max()), np.abs(v - z)
    if pair.law is not None:
        frequency, number = _of_soft_contact(pair, pair.law, steps, float(apart.max()), speed)
        return Observed(speed, contact_frequency=frequency, contact_steps=number)
    hidden = False
    if pair.joinable and not pair.lasting:
        hidden = bool((normal_compliance(scene, steps["u_tip_after"], steps[:1]) > MOST_SHOWN).any())
    at_events = _mismatch_at_events(scene, pair, steps, events)
    return Observed(speed, float(apart[joined(steps)].max(initial=0.0)), at_events, hidden=hidden)


def _mismatch_at_events(scene: Scene, pair: Pair, steps: np.ndarray, events: Sequence[Event]) -> float:
    """Return the largest |v_tip − z| of joined ends as they part or strike the foundation, as √ of its energy.

    That is over the largest energy of the run. Strikes less than a macro step after another one are left out, and what
    happens at the start of a phase: they may be as slow as one likes.
    """
    scale = float(errors(scene, steps, steps[:1], 0.0, of_interface=False).scale[-1])
    strikes = np.array([event.kind.strikes for event in events], bool)
    counted = np.flatnonzero(strikes | np.array([event.kind.opens for event in events], bool))
    if scale == 0.0 or not counted.size:
        return 0.0
    H = scene.coupling.macro_step or float(steps["size"].max())
    row = np.searchsorted(steps["events"], counted + 1.0)
    before = np.maximum(row - 1, 0)
    struck = strikes[counted]
    late = np.full(len(row), True)
    late[struck] = np.diff(steps["time"][row[struck]], prepend=-np.inf) > H
    made = np.cumsum(steps["size"] > 0.0)
    entered = np.diff(steps["phase"], prepend=steps["phase"][0]) != 0.0
    since = np.maximum.accumulate(np.where(entered, made, 0))
    row, before = (found[late & joined(steps)[before] & (made[row] > since[before])] for found in (row, before))
    mass = np.where(steps["phase"][before] < 3.0, pair.reduced_mass(Phase()), pair.reduced_mass(Phase(seated=True)))
    energy = 0.5 * mass * (steps["v_tip"][row] - steps["z"][row]) ** 2
    return sqrt(float(energy.max(initial=0.0)) / scale)


def _of_soft_contact(
    pair: Pair, law: SoftLaw, steps: np.ndarray, relative_speed: float, speed: float
) -> tuple[float, int]:
    """Return the frequency at the deepest penetration, also inside steps, and the number of steps with a force.

    A law that never opens is linear: how deep does not matter. A link whose ends move as one does not swing, however
    stiff.
    """
    forces = [steps[name] for name in ("contact_force", "contact_force_rate", "contact_force_rate_2")]
    touching = np.flatnonzero((steps["size"] > 0.0) & np.any(forces, axis=0))
    depth = (steps["y"] - steps["u_tip"])[touching]
    deepest = float(depth.max(initial=0.0))
    for row in touching[depth <= 0.0] if pair.opens_softly else ():
        before, step = steps[row - 1], steps[row]
        path = Path.through(
            (before["u_tip_after"] - before["y_after"], before["v_tip_after"] - before["z_after"]),
            (step["u_tip"] - step["y"], step["v_tip"] - step["z"]),
            step["size"],
            (
                (step["u_tip_integral"] - step["y_integral"]) / step["size"],
                (step["u_tip_integral_2"] - step["y_integral_2"]) / step["size"] ** 2,
            ),
        )
        inside = path.lowest_inside()
        deepest = max(deepest, 0.0 if inside is None else -float(path.at(inside)))
    if pair.lasting and relative_speed <= VIBRATION * speed:
        return 0.0, len(touching)
    inverse_mass = sum(1.0 / body.mass for body in (pair.upper, pair.lower) if body.mass > 0.0)
    return sqrt(law.slope(deepest) * inverse_mass), len(touching)
