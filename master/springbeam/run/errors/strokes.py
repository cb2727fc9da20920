"""Impacts on the foundation at the wrong time: an end that is higher or lower strikes later or earlier."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...contact.interface import Interface, Rigid
from ...motion.events import Event, EventKind
from .records import StepRecords, accelerations


class Strokes(NamedTuple):
    """What the impacts at the end of each step leave of the error of the end that strikes, (n,) each."""

    share: np.ndarray  #: of the errors of displacement and velocity; 0 while the end is seated
    turns: np.ndarray  #: by how much each unit of displacement changes the velocity [1/s]
    most: np.ndarray  #: at most, the jump of the impact [m/s]; 0 without one


def strokes(interface: Interface, steps: StepRecords, events: Sequence[Event]) -> Strokes:
    """Return those of a run: the end is struck earlier or later, under the acceleration before and after that."""
    share = np.where(steps.last["phase"] >= 3.0, 0.0, 1.0)
    turns, most = np.zeros((2, len(share)))
    at = steps.ended_by(EventKind.STOP_IMPACT, events)
    if len(at):
        e = interface.restitution
        np.multiply.at(share, at, -e)
        speed = steps.ends["v_tip" if interface.alone else "z"][at]
        if interface.alone:  # no force acts on the tip before or after
            changed = (1.0 + e) * accelerations(steps, "u_tip", "v_tip", 1.0)[at]
        elif isinstance(interface.law, Rigid):
            # A tie turns velocities that differ round: its force has a mean over a step, and no value at an instant.
            gained = (steps.ends["z"] - steps.before["z_after"]) / steps.size
            changed = e * gained[at] + np.append(gained, 0.0)[at + 1]
        else:
            after = np.append(accelerations(steps, "y", "z", 0.0), 0.0)
            changed = e * accelerations(steps, "y", "z", 1.0)[at] + after[at + 1]
        # Several may be at one time.
        np.add.at(turns, at, np.divide(changed, speed, out=np.zeros(len(at)), where=speed != 0.0))
        np.add.at(most, at, (1.0 + e) * np.abs(speed))
    return Strokes(share, turns, most)
