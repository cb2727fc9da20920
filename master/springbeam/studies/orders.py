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
from ..scene import Scene, SceneError
from .sampling import SHORT, away_from, quantities, sample
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
        """Return the macro steps. Raises SceneError if the law does not converge."""
        if self.scene.contact.algorithm:
            raise SceneError("contact.law = 'paper': Algorithm 1 does not converge; --orders needs another law")
        H, halvings = self.scene.coupling.H, range(_HALVINGS + 1 - self.quick)
        return {f"H/{2**k}" if k else "H": {"coupling.macro_step": H / 2**k} for k in halvings}

    @cached_property
    def times(self) -> np.ndarray:
        """The macro points [s]."""
        start, H = self.scene.contact_time or 0.0, self.scene.coupling.H
        return start + H * np.arange(np.floor((self.scene.time.t_end - start) / H * (1.0 + 1e-9)) + 1.0)

    @cached_property
    def reference(self) -> Trajectory:
        """The solution at the macro points."""
        return event_driven.simulate(self.scene, sample_times=self.times)

    def record(self, case: Row) -> Row:
        """Run once; ``stretches`` has the errors between two changes of contact each."""
        row, run = self.observed(case)
        if run is None:
            return {**row, "stretches": []}
        reference, times, H = self.reference, self.times, self.scene.coupling.H
        changes = [change.time for change in contact_changes(reference, SHORT * H)]
        stretches = []
        for begin, end in itertools.pairwise([times[0], *changes, self.scene.time.t_end]):
            inside = np.flatnonzero((times > begin) & (times < end) & away_from(times, (begin, end), H))
            if len(inside) >= 4:
                phase = reference.phase[np.searchsorted(reference.time, times[inside[len(inside) // 2]])]
                stretch = {"phase": phase, "begin": begin, "end": end}
                for name in quantities(self.scene):
                    if name not in ("e_beam", "e_spring") and (name, phase) != ("contact_force", "free"):
                        off = np.abs(sample(run, times, name) - sample(reference, times, name))[inside]
                        stretch[f"error_{name}"] = None if np.isnan(off).all() else float(np.nanmax(off))
                stretches.append(stretch)
        return {**row, "stretches": stretches}

    def rows(self, records: Mapping[str, Row]) -> list[Row]:
        """Return a row per stretch and quantity: the errors at all steps, and the orders between neighbours."""
        steps, several = list(records), [record["stretches"] for record in records.values()]
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
        from .picture import lines, panels

        steps = {name: case["coupling.macro_step"] for name, case in self.cases().items()}
        points = [
            {"at": (row["begin"], row["phase"]), "quantity": row["quantity"], "H": H, "error": row[f"error_{step}"]}
            for row in self.rows(records)
            for step, H in steps.items()
        ]
        stretches = list(dict.fromkeys(point["at"] for point in points))
        if not stretches:
            return []
        figure, axes = panels(len(stretches), 3, (4.0, 3.4), f"{self.scene.title}: largest errors")
        for ax, at in zip(axes, stretches, strict=True):
            lines(ax, [point for point in points if point["at"] == at], "H", "error", "quantity")
            ax.set(title=f"{at[1]} from {at[0]:.4g} s", xlabel="macro step [s]", ylabel="unit of the quantity")
        axes[0].legend(fontsize="small")
        figure.savefig(directory / "orders.png", dpi=110)
        return [directory / "orders.png"]
