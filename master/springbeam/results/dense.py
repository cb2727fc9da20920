"""Interpolate a run between its rows, by the dense output of each step.

Steps end on events and on changes of phase, so that no polynomial reaches across one. Between two rows there is a
record as at a row, and its columns follow from that (`springbeam.results.columns`). In this record

* positions and velocities of ends that move apart follow the path of order 6 through both ends of the step with its two
  moments (`springbeam.motion.curves`), velocities its slope (order 5);
* ends that a rigid law joins follow the path of their common motion, free of the mismatch of their velocities, plus the
  gap, linear between the rows; so does a tip that the foundation holds;
* contact and foundation force are those of both rows and, between them, the polynomials applied, without the part of
  the mismatch (`forces`: order 6 for a rigid law, d + 3 for a soft one; of an exchange, linear);
* inner forces of the beam follow cubics (`springbeam.results.inner`: order 4);
* the energies are linear between the rows (order 2); an event changes them at its row.

At the time of a row the values are the row's, at an event those after it. Orders are those of the polynomials: values
between rows are no more accurate than the rows.

Shapes, bending moments and shear forces along the beam are linear between those that the run has kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import comb
from typing import Any, NamedTuple

import numpy as np

from ..motion.curves import LAST_MOMENT, Curve
from ..motion.events import Event
from ..scene import Scene
from .columns import columns
from .inner import INNER, MAGNITUDE, curves_of
from .records import Records, Rows, common, joined, seated
from .spans import Extremes, rounding_of_steps, span
from .trajectory import Trajectory

#: Fields that are linear between rows, and do not change with an event.
_LINEAR = (
    *("law_stored", "law_dissipated", "beam_received", "spring_received"),
    "tip_acceleration",
    *(f"{body}_{what}" for body in ("beam", "spring") for what in ("potential", "dissipated", "load")),
)
#: Columns that are polynomials between rows, whose extremes `inside` finds.
MOTION = ("u_tip", "v_tip", "y", "z", "gap")
#: Steps whose extremes are found at once, to bound the memory for a long run.
_TOGETHER = 65536
#: Times closer than this share are one.
_SAME = 1e-12
#: Powers of s of the Legendre polynomials of 2s − 1 up to degree 5, by columns.
_LEGENDRE = np.array([[(-1.0) ** (k + j) * comb(k, j) * comb(k + j, j) for k in range(6)] for j in range(6)])
#: Positions and velocities of both ends.
PLACES = ("u_tip", "y")
SPEEDS = ("v_tip", "z")
_INTEGRALS = ("_integral", "_integral_2")


def at(run: Trajectory, times: Any) -> Trajectory:
    """Return ``run`` at ``times`` [s], in any order, shape (n,): columns and shapes there, events and summary.

    Between rows y and u_tip follow the quintic that has the step's ends and moments, the contact force the polynomial
    applied without what turns a mismatch of velocities round, energies are linear; shapes, moments and shear forces
    along the beam are linear between those of the run, some 400, and less accurate; before the first shape and after
    the last one the beam has these. Raises ValueError for times outside of those that are known, and for a run that
    has no steps.
    """
    rows = rows_at(run, times)
    table = run.shape_table
    if table is None or not len(table):
        return rows
    there = np.column_stack([np.interp(rows.time, table[:, 0], column) for column in table.T])
    there[:, 0] = rows.time
    return replace(rows, shape_table=there)


# Also for functions of the caller's that a command gives a run. Not by assignment, which a type checker refuses.
setattr(Trajectory, at.__name__, at)


def rows_at(run: Trajectory, times: Any) -> Trajectory:
    """Return the result of `at` without shapes, for many times."""
    wanted = np.atleast_1d(np.asarray(times, dtype=float))
    if wanted.ndim != 1:
        raise ValueError(f"times of shape {wanted.shape}: one number, or a sequence of them")
    steps = run.steps
    if steps is None:
        raise ValueError("this run has no data between its rows: it is by a reference")
    known = steps["time"]
    _refuse_outside(known, wanted)
    row = np.searchsorted(known, wanted, side="right") - 1
    # Indexing an array of records copies them field by field; ``take`` and ``put`` copy each as a whole.
    records = steps.take(row)
    between = np.flatnonzero(wanted > known[row])
    before = records.take(between)
    after = steps.take(row[between] + 1)
    np.put(records, between, _between(run.scene, before, after, run.events, wanted[between]))
    for name in INNER:
        number, curve = curves_of(steps, name)
        begins = steps["time"][row[between]]
        share = (wanted[between] - begins) / (steps["time"][row[between] + 1] - begins)
        there = curve.among(np.searchsorted(number, row[between] + 1)).at(share)
        records[name][between] = np.maximum(there, 0.0) if name == MAGNITUDE else there
    made = columns(run.scene, records, steps[:1])
    return Trajectory(run.scene, made, list(run.events), summary=dict(run.summary))


def ends_at(run: Trajectory, times: np.ndarray) -> dict[str, np.ndarray]:
    """Return positions and velocities of both ends at ``times`` [s], which ascend, as `at` does, for many times."""
    steps = run.steps
    assert steps is not None
    _refuse_outside(steps["time"], times)
    made = np.flatnonzero(steps["size"] > 0.0)
    begins = steps["time"][made - 1]
    ends = {name: np.empty(len(times)) for name in (*PLACES, *SPEEDS) if name in run.columns}
    for begin in range(0, len(times), _TOGETHER):
        some = slice(begin, begin + _TOGETHER)
        step = made[np.maximum(np.searchsorted(begins, times[some], side="right") - 1, 0)]
        after, which = np.unique(step, return_inverse=True)
        curves = motion(run.scene.contact.rigid, Rows(steps, after - 1), Rows(steps, after))
        share = (times[some] - steps["time"][step - 1]) / steps["size"][step]
        for name, values in ends.items():
            values[some] = curves[name].among(which).at(share)
    return ends


def _refuse_outside(known: np.ndarray, wanted: np.ndarray) -> None:
    """Raise ValueError if one of the ``wanted`` times is outside of those that are ``known`` [s]."""
    outside = ~((wanted >= known[0]) & (wanted <= known[-1]))
    if outside.any():
        raise ValueError(f"time {wanted[outside][0]:g} s: the run is known from {known[0]!s} s to {known[-1]!s} s")


def at_multiples(run: Trajectory, interval: float, start: float = 0.0) -> Trajectory:
    """Return ``run`` at the multiples of ``interval`` [s] after ``start`` [s], from its first to its last row."""
    first, last = ((run.time[i] - start) / interval for i in (0, -1))
    times = start + interval * np.arange(np.ceil(first - _SAME * abs(first)), np.floor(last + _SAME * abs(last)) + 1.0)
    return rows_at(run, np.clip(times, run.time[0], run.time[-1]))


class Inside(NamedTuple):
    """What a run does between its rows, on the curve that `at` follows."""

    extremes: dict[str, Extremes]  #: by columns
    #: Largest error of the curve of an end, over its largest distance from its start. Rows that are right may miss a
    #: part of the motion that turns far in a step. The last moment of a step shows it: its part of the curve is 0.8 to
    #: 2 times the error where that is above a percent, and more below.
    error: float


def inside(rigid: bool, steps: np.ndarray, *names: str) -> Inside:
    """Return the extremes of the columns ``names``, of `MOTION`, and the error between the rows.

    ``steps`` are all records of a run, ``rigid`` as of `motion`.
    """
    places = {name: steps[f"{name}_after"] for name in (*PLACES, *SPEEDS)}
    places["gap"] = places["u_tip"] - places["y"]
    extremes = {name: Extremes.of_rows(steps["time"], places[name]) for name in names}
    error = 0.0
    rounding = rounding_of_steps(steps)
    made = np.flatnonzero(steps["size"] > 0.0)
    for begin in range(0, len(made), _TOGETHER):
        after = made[begin : begin + _TOGETHER]
        curves = motion(rigid, Rows(steps, after - 1), Rows(steps, after))
        for name in names:
            extremes[name] = extremes[name].along(curves[name], steps["time"][after - 1])
        for name in PLACES:
            unsure = LAST_MOMENT * np.abs(curves[name].powers[-1]).max() - rounding
            error = max(error, float(unsure) / (span(places[name], rounding) or 1.0))
    return Inside(extremes, error)


def motion(rigid: bool, before: Records, steps: Records) -> dict[str, Curve]:
    """Return the curves of ``u_tip``, ``v_tip``, ``y``, ``z`` and ``gap`` over ``steps``.

    Parameters
    ----------
    rigid
        Whether ends that are joined have one position.
    before, steps
        Records of steps of sizes above 0 and those before them, shape (n,).
    """
    size = steps["size"]
    together = rigid & joined(before)
    held = seated(before)

    def of(end: int, records: Records, field: str) -> Any:
        """Return a field of an end; for joined ends that of their common motion."""
        names = [name + field for name in (PLACES if field.startswith("_integral") else SPEEDS)]
        return np.where(together, common(records, held, *names), records[names[end]])

    def curve(end: int, position: str) -> Curve:
        start = before[f"{position}_after"], of(end, before, "_after")
        return Curve.quintic(start, (steps[position], *(of(end, steps, f) for f in ("", *_INTEGRALS))), size)

    apart, low = (curve(end, position) for end, position in enumerate(PLACES))
    gap = before["u_tip_after"] - before["y_after"]
    w, rate, *bends = low.powers
    joint = Curve([w + gap, rate + (steps["u_tip"] - steps["y"] - gap), *bends], size)
    tip = Curve([np.where(together, *both) for both in zip(joint.powers, apart.powers, strict=True)], size)
    speeds = zip(low.rate.powers, apart.rate.powers, strict=True)
    return {
        "u_tip": tip,
        "v_tip": Curve([np.where(together, *both) for both in speeds], size),
        "y": low,
        "z": low.rate,
        "gap": Curve([u - y for u, y in zip(tip.powers, low.powers, strict=True)], size),
    }


def forces(exchanges: bool, before: np.ndarray, steps: np.ndarray) -> dict[str, Curve]:
    """Return the curves of C and N over ``steps`` [N].

    ``exchanges`` says whether the scheme exchanges values once per macro step; other parameters are as of `motion`.

    They are the polynomials applied minus a defect D. For a soft law D has no part of a degree up to d; for a tie it is
    μ g̈, which the curve of the gap has up to degree 3. The Legendre polynomials of the next two degrees bring both
    forces to what they are at the ends of the step. Between two exchanges of values they are linear.
    """
    size = steps["size"]
    mass = steps["reduced_mass"]
    start = [before[f"{tip}_after"] - before[f"{low}_after"] for tip, low in (PLACES, SPEEDS)]
    end = [steps[tip] - steps[low] for tip, low in (PLACES, SPEEDS)]
    moments = [np.subtract(*(steps[position + field] for position in PLACES)) for field in _INTEGRALS]
    reversal = mass * np.array(Curve.quintic(start, [*end, *moments], size).rate.rate.powers)
    first = np.zeros(len(steps), int) if exchanges else np.where(mass > 0.0, 4, steps["degree"].astype(int) + 1)
    sign = (-1.0) ** first
    curves = {}
    for name in ("contact_force", "foundation_force"):
        powers = np.zeros((6, len(steps)))
        if not exchanges:
            powers[:3] = steps[name], size * steps[f"{name}_rate"], 0.5 * size**2 * steps[f"{name}_rate_2"]
            powers[:4] -= np.where((name == "contact_force") | seated(before), reversal, 0.0)
        at_start = sign * (before[f"{name}_after"] - powers[0])
        at_end = steps[f"{name}_end"] - powers.sum(axis=0)
        powers += 0.5 * ((at_end + at_start) * _LEGENDRE[:, first] + (at_end - at_start) * _LEGENDRE[:, first + 1])
        curves[name] = Curve(powers, size)
    return curves


def _between(
    scene: Scene, before: np.ndarray, after: np.ndarray, events: Sequence[Event], times: np.ndarray
) -> np.ndarray:
    """Return records at ``times`` [s] strictly between the records ``before`` and ``after``, all of shape (n,)."""
    records: np.ndarray = before.take(np.arange(len(before)))
    share = (times - before["time"]) / (after["time"] - before["time"])

    def linear(name: str, end: np.ndarray) -> np.ndarray:
        return np.asarray((1.0 - share) * before[name] + share * end)

    records["time"] = times
    records["size"] = share * after["size"]
    for name, curve in forces(scene.coupling.exchanges, before, after).items():
        records[f"{name}_after"] = curve.at(share)
        if name == "contact_force" and scene.contact.opens:
            records[f"{name}_after"] = np.maximum(records[f"{name}_after"], 0.0)
    there = {name: curve.at(share) for name, curve in motion(scene.contact.rigid, before, after).items()}
    for name in (*PLACES, *SPEEDS):
        records[f"{name}_after"] = there[name]
    if scene.coupled and not (scene.contact.rigid or scene.contact.lasting):
        records["phase"] = np.where(seated(before), before["phase"], np.where(there["gap"] < 0.0, 2.0, 0.0))
    for name in _LINEAR:
        records[name] = linear(name, after[name])
    # An event at the end of the step changes kinetic energy: that of the spring by an impulse times the mean velocity,
    # that of the beam by the rest of what is lost. Where ends part, the impulse is that of their common velocity.
    lost = after["impact_loss"] - before["impact_loss"]
    kicks = [(0.0, 0.0, False), *((e.impulse_contact, e.impulse_foundation, e.kind.opens) for e in events)]
    on_tip, of_foundation, opens = np.array(kicks)[after["events"].astype(int)].T
    on_tip = np.where(opens > 0.0, after["reduced_mass"] * (after["z"] - after["v_tip"]), on_tip)
    to_spring = (after["events"] > before["events"]) * (of_foundation - on_tip) * 0.5 * (after["z"] + after["z_after"])
    records["beam_kinetic"] = linear("beam_kinetic", after["beam_kinetic"] + lost + to_spring)
    records["spring_kinetic"] = linear("spring_kinetic", after["spring_kinetic"] - to_spring)
    return records
