"""Observed orders in the macro step, stretch by stretch between changes of contact (``crosscheck --orders``)."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import ClassVar

import numpy as np

from ..monolithic import event_driven
from ..results.contact_times import contact_changes
from ..results.trajectory import Trajectory
from ..scene import Scene
from .reference import SHORT, away_from, macro_points, quantities, refuse_without_reference, sample
from .study import Findings, Row, Study
from .tables import table

#: How often the macro step is halved; once less if quick.
_HALVINGS = 3


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

    def draw(self, records: Mapping[str, Row], directory: Path) -> list[Path]:
        """Draw errors over the macro step, a panel a stretch."""
        from .picture import Point, curves

        steps = {name: case["coupling.macro_step"] for name, case in self.cases().items()}
        points = [
            Point(f"{row['phase']} from {row['begin']:.4g} s", row["quantity"], H, row[f"error_{step}"])
            for row in self.rows(records)
            for step, H in steps.items()
        ]
        title = f"{self.scene.title}: largest errors"
        curves(points, title, "macro step [s]", "unit of the quantity").savefig(directory / "orders.png", dpi=110)
        return [directory / "orders.png"]
