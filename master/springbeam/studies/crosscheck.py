"""``springbeam crosscheck``: a run beside the reference of its law, and the orders of smaller steps."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from functools import cached_property
from typing import Any, ClassVar

import matplotlib
import numpy as np
from rich.text import Text

from ..monolithic import event_driven
from ..pictures import drawing
from ..pictures.drawing import BLACK, POSITIONS, Line, Look, present
from ..pictures.panels import Curve, Panel
from ..pictures.timeline import STYLE, timeline
from ..results.contact_times import contact_changes
from ..results.trajectory import Event, Trajectory, columns_of
from ..scene import Scene
from .comparison import (
    SHORT,
    Verdict,
    away_from,
    compare,
    macro_points,
    quantities,
    refuse_without_reference,
    sample,
)
from .study import Findings, Pictures, Row, Study
from .tables import table

#: Exit codes of the command.
CODES: dict[Verdict, int] = {"agrees": 0, "differs": 1, "not comparable": 4}
_CASE = "comparison"
#: What is told of a compared quantity; the errors at all times are for the picture.
_TOLD = ("quantity", "error", "at", "l2", "bound", "passed")
_COLOURS = (
    *(drawing.BLUE, drawing.SKY, drawing.VERMILLION, drawing.ORANGE, drawing.GREEN, drawing.PURPLE, drawing.GREY),
)
#: How often the macro step is halved; once less if quick.
_HALVINGS = 3


class Crosscheck(Study):
    """A scene beside the reference of its law."""

    kind: ClassVar[str] = "crosscheck"

    scene: Scene  #: its first quarter if quick

    def cases(self) -> dict[str, Row]:
        """Return the one comparison. Raises SceneError if there is no reference."""
        if not self.scene.contact.algorithm:
            refuse_without_reference(self.scene)
        start, end = self.scene.contact_time or 0.0, self.scene.time.t_end
        return {_CASE: {"time.t_end": start + 0.25 * (end - start)} if self.quick else {}}

    def cost(self) -> str:
        """Say what is run."""
        if self.scene.contact.algorithm:
            return "a run, and Algorithm 1 twice"
        return "2 runs and 2 references"

    def record(self, case: Row) -> Row:
        """Return what was found, and both motions."""
        report = compare(self.at(case))
        found: Row = {
            "verdict": report.verdict,
            "from": report.scene.contact_time or 0.0,
            "horizon": report.horizon,
            "t_end": report.scene.time.t_end,
            "growth": report.growth,
            "quantities": [row._asdict() for row in report.rows],
            "events": [change._asdict() for change in report.events],
            "notes": report.notes,
            "scene": report.scene.model_dump(exclude_none=True),
        }
        run, reference = report.trajectory, report.reference
        if run is not None and reference is not None:
            positions = present(run, POSITIONS)
            found["motion"] = {name: run[name] for name in ("time", "phase", *positions)}
            found["marks"] = run.events
            found["reference"] = {name: reference[name] for name in ("time", *positions)}
        return found

    def rows(self, records: Mapping[str, Row]) -> list[Row]:
        """Return a row per quantity."""
        return [{name: row[name] for name in _TOLD} for row in records[_CASE]["quantities"]]

    def findings(self, records: Mapping[str, Row]) -> Findings:
        """Show what was compared, quantities and changes of contact, and the verdict."""
        record, units = records[_CASE], columns_of(self.scene)
        shown: list[Any] = [*map(Text, record["notes"])]
        if record["quantities"]:
            quantities = [
                (f"{row['quantity']} [{units[row['quantity']]}]", f"{row['error']:.2e}", f"{row['at']:.6g}",
                 f"{row['l2']:.1e}", f"{row['bound']:.1e}", _ok(row))
                for row in record["quantities"]
            ]  # fmt: skip
            shown.append(table(("quantity", "max error", "at t [s]", "L2 error", "bound", ""), quantities))
        if record["events"]:
            names = ("contact", "t [s]", "reference [s]", "error [s]", "bound [s]", "")
            shown.append(table(names, map(_contact, record["events"])))
        verdict: Verdict = record["verdict"]
        if record["quantities"]:
            shown.append(
                f"comparable from {record['from']:.9g} to {record['horizon']:.9g} s of {record['t_end']:.9g} s; there "
                f"a perturbation of the reference has grown {record['growth']:.3g} times"
            )
        looks = {"agrees": "bold green", "differs": "bold red", "not comparable": "bold"}
        words = {"not comparable": "not comparable over the run that was asked for"}
        shown.append(Text(words.get(verdict, verdict), style=looks[verdict]))
        told = {name: record[name] for name in ("verdict", "horizon", "growth", "events", "notes", "scene")}
        return Findings({**told, "quantities": self.rows(records)}, shown, CODES[verdict])

    def draw(self, records: Mapping[str, Row]) -> Pictures:
        """Draw both motions, and every error below its bound."""
        record = records[_CASE]
        if not record["quantities"]:
            return {}
        run, reference = (
            {name: np.array(values) for name, values in record[which].items()} for which in ("motion", "reference")
        )
        trajectory = Trajectory(self.scene, run, [Event(**mark) for mark in record["marks"]])
        with matplotlib.rc_context(STYLE):
            shown = [_positions(run, reference), _errors(record["quantities"])]
            figure = timeline(trajectory, "Co-simulation and reference", shown)
            horizon = drawing.time_unit(trajectory).factor * record["horizon"]
            figure.axes[1].axvline(horizon, color=BLACK, lw=0.8, ls="--")
        return {"crosscheck": figure}


def _positions(run: Mapping[str, np.ndarray], reference: Mapping[str, np.ndarray]) -> Panel:
    """Return both motions, the reference as a thin line within the other."""
    curves = []
    for name in (name for name in POSITIONS if name in reference):
        ours = Look(POSITIONS[name].colour, f"{name}, co-simulation", Line(2.5, opacity=0.5))
        curves.append(Curve(name, ours, run["time"], run[name]))
        curves.append(Curve(name, Look(BLACK, f"{name}, reference", Line(0.7)), reference["time"], reference[name]))
    return Panel("positions", "Positions", "position", "m", curves, 2.2)


def _errors(rows: list[Row]) -> Panel:
    curves, seen = [], [0.0]
    for row, colour in zip(rows, _COLOURS, strict=False):
        name, time = row["quantity"], np.array(row["times"])
        error, bound = (np.where(np.array(row[part]) > 0.0, row[part], np.nan) for part in ("errors", "bounds"))
        curves.append(Curve(name, Look(colour, name, Line(0.9)), time, error))
        curves.append(Curve(name, Look(colour, "", Line(0.9, dashed=True)), time, bound))
        seen += [float(x) for x in (*error, *bound) if x > 1e-18]
    limits = min(seen[1:], default=1e-16), 10.0 * (max(seen) or 1.0)
    quantity = "error (lines), bound (dashed)\n"
    return Panel("errors", "Errors", quantity, "unit of the quantity", curves, 3.0, logarithmic=limits)


def _ok(row: Mapping[str, Any]) -> str:
    return "ok" if row["passed"] else "DIFFERS"


def _contact(row: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the row of a change of contact, which the co-simulation may lack."""
    time, exact = row["time"], row["reference"]
    ours, error = ("none", "") if time is None else (f"{time:.10f}", f"{time - exact:.1e}")
    return row["kind"], ours, f"{exact:.10f}", error, f"{row['bound']:.1e}", _ok(row)


class Orders(Study):
    """A scene at H, H/2, H/4, … beside the event-driven reference.

    Errors of displacement, velocity and contact force are in the max norm, at the macro points that all runs share and
    two macro steps away from the events.
    """

    kind: ClassVar[str] = "orders"

    scene: Scene

    def cases(self) -> dict[str, Row]:
        """Return the macro steps. Raises SceneError if there is no reference to converge to."""
        refuse_without_reference(self.scene)
        H, halvings = self.scene.coupling.H, range(_HALVINGS + 1 - self.quick)
        return {f"H/{2**k}" if k else "H": {"coupling.macro_step": H / 2**k} for k in halvings}

    @cached_property
    def reference(self) -> Trajectory:
        """The solution at the macro points."""
        return event_driven.simulate(self.scene, sample_times=macro_points(self.scene))

    def measured(self, run: Trajectory, case: Row) -> Row:
        """Return ``stretches``: the largest errors between two changes of contact each."""
        reference, times, H = self.reference, macro_points(self.scene), self.scene.coupling.H
        names = [name for name in quantities(self.scene) if name not in ("e_beam", "e_spring")]
        off = {name: np.abs(sample(run, times, name) - reference[name]) for name in names}
        changes = [change.time for change in contact_changes(reference, SHORT * H)]
        stretches = []
        for begin, end in itertools.pairwise([times[0], *changes, self.scene.time.t_end]):
            inside = np.flatnonzero((times > begin) & (times < end) & away_from(times, (begin, end), H))
            if len(inside) >= 4:
                phase = reference.phase[inside[len(inside) // 2]]
                stretch = {"phase": phase, "begin": begin, "end": end}
                for name in (name for name in names if (name, phase) != ("contact_force", "free")):
                    known = off[name][inside]
                    stretch[f"error_{name}"] = float(np.nanmax(known)) if np.isfinite(known).any() else None
                stretches.append(stretch)
        return {"stretches": stretches}

    def rows(self, records: Mapping[str, Row]) -> list[Row]:
        """Return a row per stretch and quantity: the errors at all steps, and the orders between neighbours."""
        steps, several = list(records), [record.get("stretches", ()) for record in records.values()]
        found = []
        for stretches in zip(*several, strict=True):
            first = stretches[0]
            for name in (key for key in first if key.startswith("error_")):
                errors = [stretch[name] for stretch in stretches]
                row = {**{key: first[key] for key in ("phase", "begin", "end")}, "quantity": name.partition("_")[2]}
                row |= {f"error_{step}": error for step, error in zip(steps, errors, strict=True)}
                for step, (a, b) in zip(steps, itertools.pairwise(errors), strict=False):
                    row[f"order_{step}"] = float(np.log2(a / b)) if a and b else None
                found.append(row)
        return found

    def findings(self, records: Mapping[str, Row]) -> Findings:
        """Show the errors and the orders."""
        rows, steps = self.rows(records), list(records)
        cells = [
            (row["phase"], f"{row['begin']:.4f}", row["quantity"],
             *("" if row[f"error_{step}"] is None else f"{row[f'error_{step}']:.1e}" for step in steps),
             " ".join("–" if row[f"order_{step}"] is None else f"{row[f'order_{step}']:.1f}" for step in steps[:-1]))
            for row in rows
        ]  # fmt: skip
        names = ("phase", "from [s]", "quantity", *steps, "orders")
        return Findings({"orders": rows}, [table(names, cells, "largest errors", words=("from [s]", "quantity"))])

    def draw(self, records: Mapping[str, Row]) -> Pictures:
        """Draw errors over the macro step, a panel a stretch."""
        from .picture import Point, curves

        steps = {name: case["coupling.macro_step"] for name, case in self.cases().items()}
        points = [
            Point(f"{row['phase']} from {row['begin']:.4g} s", row["quantity"], H, row[f"error_{step}"])
            for row in self.rows(records)
            for step, H in steps.items()
        ]
        title = f"{self.scene.title}: largest errors"
        return {"orders": curves(points, title, "macro step [s]", "unit of the quantity")}
