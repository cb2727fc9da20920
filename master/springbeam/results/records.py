"""The three arrays that are a run: events, shapes, and records, from which columns, totals and dense output follow.

There is a record, of fixed size, per accepted step. Between two rows the motion follows from the
state after the event of the row before, the end of the step and its two moments, the force from the step's polynomial.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain
from math import nan
from operator import itemgetter
from struct import Struct
from typing import Any

import numpy as np

from ..motion.events import EVENT_COLUMNS, Event
from .trajectory import SHAPE_COLUMNS

#: Numbers of a record in the order of the file ``steps.bin``, by the names that `packed` takes.
_PARTS = {
    # The step's end [s] and size [s], 0 for a row that ends no step.
    "time": ("time", "size"),
    # The ends before the event of the row: displacements [m], velocities [m/s], integrals [m·s] and [m·s²] over it.
    "tip": ("u_tip", "v_tip", "u_tip_integral", "u_tip_integral_2"),
    "low": ("y", "z", "y_integral", "y_integral_2"),
    # Contact force and foundation force with two derivatives at its start; where it has no size, at the row.
    "contact": ("contact_force", "contact_force_rate", "contact_force_rate_2"),
    "foundation": ("foundation_force", "foundation_force_rate", "foundation_force_rate_2"),
    # Contact force and foundation force at the end of the step [N], which may differ from the polynomials.
    "forces": ("contact_force_end", "foundation_force_end"),
    # The row: the ends and both forces after its event, the phase (`PHASE_NAMES`), and the number of events up to here.
    "tip_after": ("u_tip_after", "v_tip_after"),
    "low_after": ("y_after", "z_after"),
    "forces_after": ("contact_force_after", "foundation_force_after"),
    "phase": ("phase", "events"),
    # Energies of the bodies after the event [J], as of `springbeam.bodies.protocol.Energies`.
    "upper_energies": ("beam_kinetic", "beam_potential", "beam_dissipated", "beam_load"),
    "lower_energies": ("spring_kinetic", "spring_potential", "spring_dissipated", "spring_load"),
    # In the contact law: stored, and dissipated since the start [J].
    "law_energies": ("law_stored", "law_dissipated"),
    # Taken by events since the start, and the work that foreign bodies have received [J].
    "lost": ("impact_loss",),
    "received": ("beam_received", "spring_received"),
    # All energies when the run began, before an impact at its start [J].
    "energy_at_start": ("energy_at_start",),
    # Inner forces of the beam at the end of the step, before the event (`springbeam.bodies.protocol.InnerForces`); and
    # the bodies that report them, the sum of `BEAM_REPORTS` and `SPRING_REPORTS`, the same in all records of a run.
    "inner_forces": ("tip_acceleration", "clamp_force", "clamp_moment", "bending_stress"),
    "reports": ("reports",),
    # The same in all records: the degree of the contact force, and the tip's share of the common velocity of joined
    # ends, m_tip/(m_tip + m). Reduced mass of ends that a rigid law has joined over the step, 1/(1/m_tip + 1/m) [kg],
    # the tip's alone on a seat; else 0.
    "joined": ("degree", "tip_share", "reduced_mass"),
}
STEP_COLUMNS = tuple(chain.from_iterable(_PARTS.values()))
#: The contact force of a step: C and its two derivatives at the step's start.
FORCE_COLUMNS = _PARTS["contact"]
#: Flags in ``reports``: the record has the inner forces of the beam; the lower body is the spring of the scene.
BEAM_REPORTS = 1
SPRING_REPORTS = 2
#: Little-endian doubles, on every machine.
STEP = np.dtype([(name, "<f8") for name in STEP_COLUMNS])
#: Fields of an event that are NaN where its body is absent; and an event.
_OF_BODIES = ("y", "z", "u_tip", "v_tip")
EVENT = np.dtype([(n, {"kind": "<U11", "joint": "<U5", "seated": "?"}.get(n, "<f8")) for n in EVENT_COLUMNS])
#: A shape of the beam.
SHAPE = np.dtype([(name, "<f8") for name in SHAPE_COLUMNS])
_pack = Struct(f"<{len(STEP_COLUMNS)}d").pack
_in_order = itemgetter(*_PARTS)
#: The column ``phase`` by the number in a record: how the ends are joined, and 3 more while the lower end is seated.
PHASE_NAMES = np.array(["free", "tied", "touch", "seated", "seated", "seated"])
#: The first number of the phases in which the lower end is seated.
_SEATED = 3.0


def packed(**parts: Iterable[float]) -> bytes:
    """Return the bytes of a record from its numbers, those of each part of `_PARTS`."""
    return _pack(*chain.from_iterable(_in_order(parts)))


class Rows:
    """Some records of a run; only the fields that are used are copied."""

    def __init__(self, records: np.ndarray, which: np.ndarray) -> None:
        self._records = records
        self._which = which

    def __getitem__(self, name: str) -> np.ndarray:
        return np.asarray(self._records[name][self._which])

    def among(self, which: slice) -> Rows:
        """Return ``which`` of them."""
        return Rows(self._records, self._which[which])


#: Records, or some of them.
Records = np.ndarray | Rows


def array_of(content: bytes, kind: np.dtype) -> np.ndarray:
    """Return the records in ``content``, an incomplete last one left out; ``kind`` is `STEP`, `EVENT` or `SHAPE`.

    Raises ValueError for one that has a number that is not finite, or is no such record.
    """
    rows: np.ndarray = np.frombuffer(content, kind, len(content) // kind.itemsize).copy()
    for name in kind.names or ():
        if kind[name].kind == "f" and not (kind is EVENT and name in _OF_BODIES):
            wrong = ~np.isfinite(rows[name])
            if wrong.any():
                row = rows[int(np.argmax(wrong))]
                raise ValueError(f"{name} = {row[name]} at t = {row['time']!s} s: not finite")
    if kind is STEP and (
        not np.isin(rows["phase"], range(len(PHASE_NAMES))).all() or (np.diff(rows["events"], prepend=0.0) < 0.0).any()
    ):
        raise ValueError("not records of steps")
    return rows


def events_as_array(events: Iterable[Event]) -> np.ndarray:
    """Return events as an array of `EVENT`."""
    return np.array([tuple(nan if v is None else v for v in vars(event).values()) for event in events], EVENT)


def events_of(rows: np.ndarray) -> list[Event]:
    """Return the events of an array of `EVENT`. Raises ValueError for a word that is no kind and no joint."""
    values: list[list[Any]] = [[None if value != value else value for value in row] for row in rows.tolist()]
    return [Event(*row) for row in values]


def joined(steps: Records) -> np.ndarray:
    """Return whether the ends are joined from each row on."""
    return np.asarray(steps["phase"] % _SEATED > 0.0)


def seated(steps: Records) -> np.ndarray:
    """Return whether the lower end is seated on the foundation from each row on."""
    return np.asarray(steps["phase"] >= _SEATED)


def common(steps: Records, held: np.ndarray, of_tip: str, of_low: str) -> np.ndarray:
    """Return what joined ends have in common of a field of the tip and that of the lower end, as of their velocities.

    ``held`` says where the foundation holds the lower end.
    """
    return np.asarray(steps[of_low] + np.where(held, 0.0, steps["tip_share"]) * (steps[of_tip] - steps[of_low]))


def impulse(steps: np.ndarray, name: str = "contact_force") -> np.ndarray:
    """Return ∫ C dτ [N·s] over each step of a run, or that of the force N of the foundation.

    What has reversed a mismatch of joined ends' velocities is no part of it.
    """
    size, c, dc, ddc = (steps[part] for part in ("size", name, f"{name}_rate", f"{name}_rate_2"))
    before = Rows(steps, np.arange(len(steps)) - 1)
    turned = steps["v_tip"] - steps["z"] - before["v_tip_after"] + before["z_after"]
    acts = (name == "contact_force") | seated(before)
    return np.asarray(size * (c + size * (dc / 2.0 + size * ddc / 6.0)) - acts * steps["reduced_mass"] * turned)
