"""Impacts on the foundation at the wrong time: an end that is higher or lower strikes later or earlier."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ...contact.interface import Interface, Rigid
from ...motion.events import Event, EventKind
from ...motion.paths import derivative, value
from .records import StepRecords, path_of


class Strokes(NamedTuple):
    """What the impacts at the end of each step leave of the error of the end that strikes, (n,) each."""

    share: np.ndarray  #: of the errors of displacement and velocity; 0 while the end is seated
    turns: np.ndarray  #: by how much each unit of displacement changes the velocity [1/s]
    most: np.ndarray  #: at most, the jump of the impact [m/s]; 0 without one


def strokes(interface: Interface, steps: StepRecords, events: Sequence[Event]) -> Strokes:
    """Return those of a run: the end is struck earlier or later, under the acceleration before and after that."""
    share = np.where(steps.last["phase"] >= 3.0, 0.0, 1.0)
    turns, most = np.zeros((2, len(share)))
    start = steps.before["events"][0]
    number = [n for n, event in enumerate(events, 1) if event.kind is EventKind.STOP_IMPACT and n > start]
    at = np.searchsorted(steps.last["events"], number)  # the steps that they end
    if len(at):
        e = interface.restitution
        np.multiply.at(share, at, -e)
        speed = steps.ends["v_tip" if interface.alone else "z"][at]
        if interface.alone:  # no force acts on the tip before or after
            changed = (1.0 + e) * _accelerations(steps, "u_tip", "v_tip", 1.0)[at]
        elif isinstance(interface.law, Rigid):
            # A tie turns velocities that differ round: its force has a mean over a step, and no value at an instant.
            gained = (steps.ends["z"] - steps.before["z_after"]) / steps.size
            changed = e * gained[at] + np.append(gained, 0.0)[at + 1]
        else:
            after = np.append(_accelerations(steps, "y", "z", 0.0), 0.0)
            changed = e * _accelerations(steps, "y", "z", 1.0)[at] + after[at + 1]
        # Several may be at one time.
        np.add.at(turns, at, np.divide(changed, speed, out=np.zeros(len(at)), where=speed != 0.0))
        np.add.at(most, at, (1.0 + e) * np.abs(speed))
    return Strokes(share, turns, most)


def _accelerations(steps: StepRecords, position: str, velocity: str, share: float) -> Any:
    """Return those at a ``share`` of each step [m/s²], of the path of an end through both its ends and the moments."""
    return value(derivative(derivative(path_of(steps, position, velocity))), share) / steps.size**2
