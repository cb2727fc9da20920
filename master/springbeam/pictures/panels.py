"""What is drawn of a run over time: panels of curves, with units, limits and remarks.

``timeline`` paints them with matplotlib, ``report.charts`` makes plotly's charts of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..results.trajectory import Trajectory
from .drawing import (
    ACCELERATIONS,
    ALTERNATES,
    BLACK,
    BLUE,
    ENERGIES,
    FORCES,
    GREEN,
    IMPULSES,
    LEVELS,
    ORANGE,
    POSITIONS,
    PURPLE,
    SKY,
    VELOCITIES,
    VERMILLION,
    Line,
    Look,
    Marker,
    Unit,
    alternates,
    decimated,
    drawable,
    much_smaller,
    near_levels,
    present,
    readable_unit,
)

#: Forces and energies below this part of the largest one are not seen beside it.
_INVISIBLE = 5e-3
#: Heading, quantity, unit and words of what the beam feels.
_OF_THE_BEAM = {
    "clamp_force": ("Force of the clamp", "force", "N", "of the clamp, upward"),
    "clamp_moment": ("Moment of the clamp", "moment", "N·m", "of the clamp, counter-clockwise"),
    "bending_stress": ("Bending stress", "stress", "Pa", "largest along the beam"),
}
_COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK)
#: Quantity, unit, and columns or fields of events of the panels in which runs are compared.
_COMPARED = (
    ("position", "m", ("u_tip", "y")),
    ("velocity", "m/s", ("v_tip", "z")),
    ("contact force", "N", ("contact_force",)),
    ("foundation force", "N", ("foundation_force",)),
    ("impulse, tip", "N·s", ("impulse_contact",)),
    ("impulse, foundation", "N·s", ("impulse_foundation",)),
)
#: How the first column of such a panel is drawn, and the second.
_COMPARED_LINES = (Line(1.4), Line(0.8, dashed=True))


@dataclass(frozen=True)
class Curve:
    """A curve over time, thinned; where its look has a marker, points on stems."""

    name: str  #: column of the run, or field of its events
    look: Look
    time: np.ndarray  #: [s]
    values: np.ndarray  #: in SI units
    alternates: bool = False  #: drawn as dots on a faint line
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
    remarks: list[str] = field(default_factory=list)

    @property
    def unit(self) -> Unit:
        """The unit of the axis, with a prefix unless it is logarithmic."""
        if self.logarithmic is not None:
            return Unit(1.0, self.si)
        return readable_unit([curve.values for curve in self.curves], self.si)

    @property
    def axis(self) -> str:
        """What stands along the axis."""
        return f"{self.quantity} [{self.unit.name}]"


def panels(trajectory: Trajectory) -> list[Panel]:
    """Return all panels that the run has something to show for."""
    if not drawable(trajectory):
        return []
    found = [
        positions(trajectory),
        enlarged(trajectory),
        velocities(trajectory, VELOCITIES),
        forces(trajectory),
        impulses(trajectory),
        *loads(trajectory),
        *inside(trajectory),
        gap(trajectory),
        energies(trajectory),
        residual(trajectory),
    ]
    return [panel for panel in found if panel.curves]


def positions(trajectory: Trajectory) -> Panel:
    """Return tip and spring top, with the levels that are near what moves."""
    panel = _lines(trajectory, "positions", "Positions", POSITIONS, "position", "m", height=2.4)
    near = near_levels(trajectory.scene, [trajectory[name] for name in present(trajectory, POSITIONS)])
    ends = trajectory["time"][[0, -1]]
    panel.curves += [Curve(symbol, LEVELS[symbol], ends, np.full(2, height)) for symbol, height in near.items()]
    return panel


def enlarged(trajectory: Trajectory) -> Panel:
    """Return a panel of its own for the one of two positions whose motion is lost beside the other's."""
    small = much_smaller(trajectory)
    looks = {name: Look(POSITIONS[name].colour, f"{POSITIONS[name].words}, enlarged") for name in small}
    name = "-".join(["position", *small])
    return _lines(trajectory, name, "The smaller one, enlarged", looks, "position", "m", height=1.2)


def velocities(trajectory: Trajectory, names: Iterable[str]) -> Panel:
    """Return those of `VELOCITIES` that are named."""
    return _lines(trajectory, "velocities", "Velocities", {name: VELOCITIES[name] for name in names}, "velocity", "m/s")


def forces(trajectory: Trajectory) -> Panel:
    """Return the forces that are not zero throughout, in the words of the run's law."""
    contact = trajectory.scene.contact
    words = contact.facts.force + contact.facts.damper * (contact.damping > 0.0)
    looks = FORCES | {"compliance_force": FORCES["compliance_force"]._replace(words=words)}
    seen, remarks = _seen(trajectory, looks, "N")
    panel = _lines(trajectory, "forces", "Forces", seen, "force", "N", remarks, height=2.0)
    summary = trajectory.summary
    if "contact_force_max_time" in summary and "contact_force" in seen:
        begin, peak = float(summary["contact_force_max_time"]), float(summary["contact_force_max"])
        window = np.array([begin, begin + float(summary["contact_force_window"])])
        clock = readable_unit([np.diff(window)], "s")
        words = f"largest mean, over {clock.factor * np.diff(window)[0]:.3g}\u00a0{clock.name}"
        look = Look(VERMILLION, words, Line(2.2))
        panel.curves.append(Curve("contact_force_max", look, window, np.array([peak, peak])))
    return panel


def loads(trajectory: Trajectory) -> list[Panel]:
    """Return the loads, those of a unit together."""
    found: list[Panel] = []
    for unit in dict.fromkeys(load.unit for load in trajectory.scene.loads):
        looks = {
            f"load_{i}": Look(_COLOURS[i % len(_COLOURS)], f"load {i}, on the {load.on}", Line(1.1, dashed=i % 2 == 1))
            for i, load in enumerate(trajectory.scene.loads)
            if load.unit == unit
        }
        heading = "Loads" if unit != "m/s²" else "Acceleration of the base"
        found.append(_lines(trajectory, f"loads-{len(found)}", heading, looks, "load", unit, height=1.2))
    return found


def inside(trajectory: Trajectory) -> list[Panel]:
    """Return accelerations, what the clamp does to the beam, and the largest stress along it."""
    trajectory = trajectory.felt()
    found = [_lines(trajectory, "accelerations", "Accelerations", ACCELERATIONS, "acceleration", "m/s²")]
    for column, (heading, quantity, unit, words) in _OF_THE_BEAM.items():
        look = {column: Look(BLUE, words)}
        found.append(_lines(trajectory, column.replace("_", "-"), heading, look, quantity, unit, height=1.2))
    return found


def impulses(trajectory: Trajectory) -> Panel:
    """Return the impulses of the events, on a logarithmic axis where a linear one would not show them all."""
    curves = [curve for name, look in IMPULSES.items() for curve in _stems(trajectory, name, look)]
    panel = Panel("impulses", "Impulses", "impulse", "N·s", curves, 1.2)
    sizes = [curve.values for curve in panel.curves]
    least, most = min(map(np.min, sizes), default=0.0), max(map(np.max, sizes), default=0.0)
    if 0.0 < 30.0 * least < most:
        # Impulses of rounding size would stretch the axis over the ones that matter.
        panel.logarithmic = 0.3 * max(least, 1e-8 * most), 3.0 * most
    return panel


def _stems(trajectory: Trajectory, name: str, look: Look) -> list[Curve]:
    """Return the impulses of one kind, none if there were none."""
    points = [(e.time, getattr(e, name)) for e in trajectory.events if getattr(e, name)]
    time, values = np.reshape(points, (-1, 2)).T
    rows = decimated(time, values)
    return [Curve(name, look, time[rows], values[rows])] if points else []


def gap(trajectory: Trajectory) -> Panel:
    """Return the gap above the spring, or above the foundation."""
    look = Look(BLUE, "u(t, L) − y" if "y" in trajectory.columns else "u(t, L) − φ")
    return _lines(trajectory, "gap", "Gap", {"gap": look}, "gap", "m")


def energies(trajectory: Trajectory) -> Panel:
    """Return the energies, stacked where no part is negative but by rounding."""
    parts, remarks = _seen(trajectory, ENERGIES, "J")
    looks = parts | {"e_total": Look(BLACK, "total", Line(1.4, dashed=True))}
    panel = _lines(trajectory, "energies", "Energy ledger", looks, "energy", "J", remarks, height=2.2)
    least = min((float(np.min(trajectory[name])) for name in parts), default=-1.0)
    if least < -1e-9 * float(np.max(trajectory["e_total"])):
        panel.heading += " (lines: a part is negative)"
        return panel
    time = trajectory["time"]
    rows = np.unique(np.concatenate([decimated(time, trajectory[name]) for name in [*parts, "e_total"]]))
    stack = [Curve(name, look, time[rows], trajectory[name][rows], stacked=True) for name, look in parts.items()]
    panel.curves = [*stack, panel.curves[-1]]
    return panel


def residual(trajectory: Trajectory) -> Panel:
    """Return |energy residual| over the largest energy; rows where it is 0 are left out."""
    relative = np.abs(trajectory["energy_residual"]) / _energy_scale(trajectory)
    rows = decimated(trajectory["time"], relative)
    rows = rows[relative[rows] > 0.0]
    look = Look(VERMILLION, "over the largest energy", Line(0.8))
    curve = Curve("energy_residual", look, trajectory["time"][rows], relative[rows])
    heading = "Energy residual: what the sum of all energies has changed by since the start"
    panel = Panel("residual", heading, "energy residual", "–", [curve], 1.4)
    if len(rows):
        panel.logarithmic = 0.3 * max(float(np.min(curve.values)), 1e-18), 3.0 * float(np.max(curve.values))
    else:
        panel.remarks.append("zero throughout")
    return panel


def compared(runs: Mapping[str, Trajectory]) -> list[Panel]:
    """Return panels with the curves of several runs, a colour each; only those of positions may be all zero.

    What strikes leaves impulses and no force: they have panels of their own.
    """
    found = []
    for quantity, unit, columns in _COMPARED:
        panel = Panel(quantity, quantity, quantity, unit, [])
        for number, (name, run) in enumerate(runs.items()):
            colour, size = _COLOURS[number % len(_COLOURS)], max(7.0 - 1.5 * number, 2.5)
            for column, line in zip(columns, _COMPARED_LINES, strict=False):
                words = f"{name}: {(POSITIONS | VELOCITIES)[column].words}" if len(columns) > 1 else name
                if column in IMPULSES:
                    stems = Look(colour, words, marker=Marker("○", "o", "circle-open", size))
                    panel.curves += _stems(run, column, stems)
                else:
                    panel.curves += _lines(run, "", "", {column: Look(colour, words, line)}, quantity, unit).curves
        if unit == "m" or any(curve.values.any() for curve in panel.curves):
            found.append(panel)
    return found


def _energy_scale(trajectory: Trajectory) -> float:
    """Return the largest energy of the run [J], against which its residual is judged; 1 if there is none."""
    columns = trajectory.columns
    stored = sum(np.abs(columns[name]) for name in ("e_beam", "e_spring", "e_contact") if name in columns)
    return float(max(np.max(stored), abs(columns["e_total"][0]))) or 1.0


def _lines(
    trajectory: Trajectory,
    name: str,
    heading: str,
    looks: Mapping[str, Look],
    quantity: str,
    unit: str,
    remarks: Iterable[str] = (),
    **more: Any,
) -> Panel:
    """Return a panel of those columns of ``looks`` that the run has; ``more`` are fields of the panel."""
    time, curves = trajectory["time"], []
    for column in present(trajectory, looks):
        values = trajectory[column]
        rows = decimated(time, values)
        curves.append(Curve(column, looks[column], time[rows], values[rows], alternates(values)))
    said = [f"{curve.look.words} {ALTERNATES}" for curve in curves if curve.alternates]
    return Panel(name, heading, quantity, unit, curves, remarks=[*said, *remarks], **more)


def _seen(trajectory: Trajectory, looks: Mapping[str, Look], unit: str) -> tuple[dict[str, Look], list[str]]:
    """Return the columns that can be seen beside the largest of them, and words for those that cannot but are not 0."""
    sizes = {name: float(np.max(np.abs(trajectory[name]))) for name in present(trajectory, looks)}
    sizes = {name: size for name, size in sizes.items() if size > 0.0}
    seen = {name: looks[name] for name, size in sizes.items() if size >= _INVISIBLE * max(sizes.values())}
    unseen = [f"{looks[name].words} ≤ {size:.2g}\u00a0{unit}" for name, size in sizes.items() if name not in seen]
    return seen, [f"too small to draw: {', '.join(unseen)}"] if unseen else []
