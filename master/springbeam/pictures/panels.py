"""Panels of curves of a run over time, with units and limits.

``timeline`` paints them with matplotlib, ``report.charts`` makes plotly's charts of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..results.trajectory import Trajectory
from .drawing import (
    ACCELERATIONS,
    BLACK,
    BLUE,
    COLOURS,
    ENERGIES,
    FORCES,
    IMPULSES,
    LEVELS,
    POSITIONS,
    VELOCITIES,
    VERMILLION,
    Line,
    Look,
    Marker,
    Unit,
    decimated,
    drawable,
    near_levels,
    present,
    readable_unit,
)

#: Name, heading, quantity, unit, columns and height of the panels of accelerations, clamp forces and stress.
_ON_BODIES: tuple[tuple[str, str, str, str, dict[str, Look], float], ...] = (
    ("accelerations", "Accelerations", "acceleration", "m/s²", ACCELERATIONS, 1.6),
    ("clamp-force", "Force of the clamp", "force", "N", {"clamp_force": Look(BLUE, "of the clamp, upward")}, 1.2),
    ("clamp-moment", "Moment of the clamp", "moment", "N·m",
     {"clamp_moment": Look(BLUE, "of the clamp, counter-clockwise")}, 1.2),
    ("bending-stress", "Bending stress", "stress", "Pa", {"bending_stress": Look(BLUE, "largest along the beam")}, 1.2),
)  # fmt: skip
#: Quantity, unit, and columns or fields of events of the panels in which runs are compared.
_COMPARED = (
    ("position", "m", ("u_tip", "y")),
    ("velocity", "m/s", ("v_tip", "z")),
    ("contact force", "N", ("contact_force",)),
    ("foundation force", "N", ("foundation_force",)),
    ("impulse, tip", "N·s", ("impulse_contact",)),
    ("impulse, foundation", "N·s", ("impulse_foundation",)),
)
#: A motion smaller than this share of another cannot be seen in the same panel.
_SEEN_BESIDE = 0.02
#: Looks of the first and the second column of such a panel.
_COMPARED_LINES = (Line(1.4), Line(0.8, dashed=True))


@dataclass(frozen=True)
class Curve:
    """A curve over time, thinned; where its look has a marker, points on stems."""

    name: str  #: column of the run, or field of its events
    look: Look
    time: np.ndarray  #: [s]
    values: np.ndarray  #: in SI units
    stacked: bool = False  #: drawn as an area on top of those before it


@dataclass
class Panel:
    """Curves of one quantity."""

    name: str
    heading: str
    quantity: str
    si: str  #: its unit
    curves: list[Curve]
    height: float = 1.6  #: [inch]
    logarithmic: tuple[float, float] | None = None  #: limits of a logarithmic axis; stems begin at the lower one

    @property
    def unit(self) -> Unit:
        """The unit of the axis, with a prefix unless it is logarithmic."""
        if self.logarithmic is not None:
            return Unit(1.0, self.si)
        return readable_unit([curve.values for curve in self.curves], self.si)

    @property
    def axis(self) -> str:
        """The label of the axis."""
        return f"{self.quantity} [{self.unit.name}]"


def panels(trajectory: Trajectory) -> list[Panel]:
    """Return all panels for which the run has data."""
    if not drawable(trajectory):
        return []
    gap = Look(BLUE, "u(t, L) − y" if "y" in trajectory.columns else "u(t, L) − φ")
    every = [
        positions(trajectory),
        enlarged(trajectory),
        Panel("velocities", "Velocities", "velocity", "m/s", _curves(trajectory, VELOCITIES)),
        forces(trajectory),
        impulses(trajectory),
        *loads(trajectory),
        *inside(trajectory),
        Panel("gap", "Gap", "gap", "m", _curves(trajectory, {"gap": gap})),
        energies(trajectory),
        residual(trajectory),
    ]
    return [panel for panel in every if panel.curves]


def positions(trajectory: Trajectory) -> Panel:
    """Return tip and spring top, with the levels near the motion."""
    curves = _curves(trajectory, POSITIONS)
    near = near_levels(trajectory.scene, [trajectory[name] for name in present(trajectory, POSITIONS)])
    ends = trajectory["time"][[0, -1]]
    curves += [Curve(symbol, LEVELS[symbol], ends, np.full(2, height)) for symbol, height in near.items()]
    return Panel("positions", "Positions", "position", "m", curves, 3.0)


def enlarged(trajectory: Trajectory) -> Panel:
    """Return a panel for the smaller of two motions, if it cannot be seen together with the other."""
    ranges = {name: float(np.ptp(trajectory[name])) for name in present(trajectory, POSITIONS)}
    looks = {
        name: Look(POSITIONS[name].colour, f"{POSITIONS[name].words}, enlarged")
        for name, size in ranges.items()
        if 0.0 < size < _SEEN_BESIDE * max(ranges.values())
    }
    return Panel("positions-enlarged", "The smaller one, enlarged", "position", "m", _curves(trajectory, looks), 1.2)


def forces(trajectory: Trajectory) -> Panel:
    """Return the forces that are not zero throughout, in the words of the run's law, and the largest mean."""
    contact = trajectory.scene.contact
    summary = trajectory.summary
    legend = contact.legend + contact.damper * contact.damped
    looks = FORCES | {"compliance_force": FORCES["compliance_force"]._replace(words=legend)}
    curves = _not_zero(_curves(trajectory, looks))
    if "contact_force_max_time" in summary and curves and curves[0].name == "contact_force":
        begin = float(summary["contact_force_max_time"])
        peak = float(summary["contact_force_max"])
        length = float(summary.get("contact_force_window", 0.0))
        window = np.array([begin, begin + length])
        clock = readable_unit([np.array([length])], "s")
        words = f"largest mean, over {clock.factor * length:.3g}\u00a0{clock.name}" if length else "largest"
        curves.append(Curve("contact_force_max", Look(VERMILLION, words, Line(2.2)), window, np.array([peak, peak])))
    return Panel("forces", "Forces", "force", "N", curves, 2.0)


def loads(trajectory: Trajectory) -> list[Panel]:
    """Return the loads, those of a unit together."""
    looks: dict[str, dict[str, Look]] = {}
    for i, load in enumerate(trajectory.scene.loads):
        line = Line(1.1, dashed=i % 2 == 1)
        of_unit = looks.setdefault(load.unit, {})
        of_unit[f"load_{i}"] = Look(COLOURS[i % len(COLOURS)], f"load {i}, on the {load.on}", line)
    return [
        Panel(f"loads-{k}", "Loads" if unit != "m/s²" else "Acceleration of the base", "load", unit,
              _curves(trajectory, of_unit), 1.2)
        for k, (unit, of_unit) in enumerate(looks.items())
    ]  # fmt: skip


def inside(trajectory: Trajectory) -> list[Panel]:
    """Return accelerations, clamp force and moment, and the largest stress along the beam."""
    run = trajectory.without_start()
    return [
        Panel(name, heading, quantity, unit, _curves(run, looks), height)
        for name, heading, quantity, unit, looks, height in _ON_BODIES
    ]


def impulses(trajectory: Trajectory) -> Panel:
    """Return the impulses of the events, on a logarithmic axis where a linear one would not show them all."""
    panel = Panel("impulses", "Impulses", "impulse", "N·s", _stems(trajectory, IMPULSES), 1.2)
    sizes = [curve.values for curve in panel.curves]
    least = min(map(np.min, sizes), default=0.0)
    most = max(map(np.max, sizes), default=0.0)
    if 0.0 < 30.0 * least < most:
        # Impulses of rounding size would stretch the axis over the ones that matter.
        panel.logarithmic = 0.3 * max(least, 1e-8 * most), 3.0 * most
    return panel


def energies(trajectory: Trajectory) -> Panel:
    """Return the energies that are not zero throughout, stacked where none is negative but by rounding."""
    total = Look(BLACK, "total", Line(1.4, dashed=True))
    names = [*present(trajectory, ENERGIES), "e_total"]
    rows = np.array(sorted({row for name in names for row in decimated(trajectory["time"], trajectory[name]).tolist()}))
    curves = _not_zero(_curves(trajectory, ENERGIES | {"e_total": total}, rows))
    least = min((np.min(curve.values) for curve in curves), default=0.0)
    stacked = bool(least >= -1e-9 * np.max(trajectory["e_total"]))
    heading = "Energy ledger" if stacked else "Energy ledger (lines: a part is negative)"
    curves = [replace(curve, stacked=stacked and curve.name != "e_total") for curve in curves]
    return Panel("energies", heading, "energy", "J", curves, 2.2)


def residual(trajectory: Trajectory) -> Panel:
    """Return |energy residual| over the largest energy; rows where it is 0 are left out."""
    columns = trajectory.columns
    stored = sum(np.abs(columns[name]) for name in ("e_beam", "e_spring", "e_contact") if name in columns)
    scale = float(max(np.max(stored), abs(columns["e_total"][0]))) or 1.0
    relative = np.abs(trajectory["energy_residual"]) / scale
    rows = decimated(trajectory["time"], relative)
    rows = rows[relative[rows] > 0.0]
    look = Look(VERMILLION, "over the largest energy", Line(0.8))
    curve = Curve("energy_residual", look, trajectory["time"][rows], relative[rows])
    heading = "Energy residual: change of the sum of all energies since the start"
    panel = Panel("residual", heading, "energy residual", "–", [curve] if len(rows) else [], 1.4)
    if len(rows):
        panel.logarithmic = 0.3 * max(float(np.min(curve.values)), 1e-18), 3.0 * float(np.max(curve.values))
    return panel


def compared(runs: Mapping[str, Trajectory]) -> list[Panel]:
    """Return panels with the curves of several runs, a colour each; only those of positions may be all zero.

    Impulses of impacts have panels of their own.
    """
    panels = []
    for quantity, unit, columns in _COMPARED:
        panel = Panel(quantity, quantity, quantity, unit, [])
        for number, (name, run) in enumerate(runs.items()):
            colour = COLOURS[number % len(COLOURS)]
            size = max(7.0 - 1.5 * number, 2.5)
            for column, line in zip(columns, _COMPARED_LINES, strict=False):
                words = f"{name}: {(POSITIONS | VELOCITIES)[column].words}" if len(columns) > 1 else name
                look = Look(colour, words, line)
                marker = Marker("○", "o", "circle-open", size)
                if column in IMPULSES:
                    panel.curves += _stems(run, {column: look._replace(marker=marker)})
                else:
                    panel.curves += _curves(run, {column: look})
        if unit == "m" or _not_zero(panel.curves):
            panels.append(panel)
    return panels


def _curves(trajectory: Trajectory, looks: Mapping[str, Look], rows: np.ndarray | None = None) -> list[Curve]:
    """Return lines of those columns of ``looks`` that the run has, at ``rows`` or thinned."""
    time = trajectory["time"]
    curves = []
    for column in present(trajectory, looks):
        values = trajectory[column]
        drawn = decimated(time, values) if rows is None else rows
        curves.append(Curve(column, looks[column], time[drawn], values[drawn]))
    return curves


def _stems(trajectory: Trajectory, looks: Mapping[str, Look]) -> list[Curve]:
    """Return the impulses of events, fields of `Event`, for kinds that happened."""
    stems = []
    for name, look in looks.items():
        if points := [(e.time, getattr(e, name)) for e in trajectory.events if getattr(e, name)]:
            time, values = np.array(points).T
            rows = decimated(time, values)
            stems.append(Curve(name, look, time[rows], values[rows]))
    return stems


def _not_zero(curves: list[Curve]) -> list[Curve]:
    return [curve for curve in curves if np.any(curve.values)]
