"""Observed orders in the macro step, stretch by stretch between changes of contact."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from ...monolithic import event_driven
from ...results.contact_times import contact_changes
from ...run.runner import simulate
from ...scene import Scene, SceneError, with_changes
from ..study import Findings, Record, Study
from ..tables import table, write_csv
from .sampling import SHORT, away_from, quantities, sample

#: How often the macro step is halved; once less if quick.
_HALVINGS = 3


@dataclass(frozen=True)
class OrderRow:
    """Errors of a quantity in one stretch between changes of contact, at H, H/2, …"""

    phase: str
    begin: float  #: [s]
    end: float
    quantity: str
    errors: tuple[float, ...]
    orders: tuple[float, ...]  #: between neighbours


class Orders(Study):
    """A scene at H, H/2, H/4, … beside the event-driven reference.

    Errors of displacement, velocity and contact force are in the max norm, at the macro points that all runs share and
    two macro steps away from the events.
    """

    kind: ClassVar[str] = "orders"
    files: ClassVar[tuple[str, ...]] = ("orders.csv",)

    scene: Scene

    def cases(self) -> dict[str, int | None]:
        """Return the halvings, ``None`` for the reference. Raises SceneError if the law does not converge."""
        if self.scene.contact.algorithm:
            raise SceneError("contact.law = 'paper': Algorithm 1 does not converge; --orders needs another law")
        halvings = range(_HALVINGS + 1 - self.quick)
        return {"reference": None, **{f"H/{2**k}" if k else "H": k for k in halvings}}

    @property
    def times(self) -> np.ndarray:
        """The macro points [s]."""
        start, H = self.scene.contact_time or 0.0, self.scene.coupling.H
        return start + H * np.arange(np.floor((self.scene.time.t_end - start) / H * (1.0 + 1e-9)) + 1.0)

    def record(self, case: int | None) -> Record:
        """Return the values at the macro points of a run, and when the reference changes contact."""
        size, times = self.scene.coupling.H, self.times
        if case is None:
            run = event_driven.simulate(self.scene, sample_times=times)
        else:
            run = simulate(with_changes(self.scene, coupling={"macro_step": size / 2**case}))
        found: Record = {"values": {name: sample(run, times, name) for name in quantities(self.scene)}}
        if case is None:
            found["phases"] = run.phase[np.searchsorted(run.time, times)]
            found["changes"] = [change.time for change in contact_changes(run, SHORT * size)]
        return found

    def rows(self, records: Mapping[str, Record]) -> list[OrderRow]:
        """Return the observed orders in H."""
        times, (reference, *runs) = self.times, records.values()
        edges = [self.scene.contact_time or 0.0, *reference["changes"], self.scene.time.t_end]
        found: list[OrderRow] = []
        for begin, end in itertools.pairwise(edges):
            inside = np.flatnonzero(
                (times > begin) & (times < end) & away_from(times, (begin, end), self.scene.coupling.H)
            )
            if len(inside) < 4:
                continue
            phase = reference["phases"][inside[len(inside) // 2]]
            for name, exact in reference["values"].items():
                if name in ("e_beam", "e_spring") or (name == "contact_force" and phase == "free"):
                    continue
                values = np.array([run["values"][name] for run in runs], dtype=float)[:, inside]
                difference = np.abs(values - np.array(exact, dtype=float)[inside])
                none = np.isnan(difference).all(axis=1)
                errors = np.where(none, np.nan, np.where(np.isnan(difference), 0.0, difference).max(axis=1))
                with np.errstate(divide="ignore", invalid="ignore"):
                    observed = np.log2(errors[:-1] / errors[1:])
                found.append(OrderRow(phase, begin, end, name, tuple(errors.tolist()), tuple(observed.tolist())))
        return found

    def findings(self, records: Mapping[str, Record]) -> Findings:
        """Show the errors and the orders."""
        rows, steps = self.rows(records), list(records)[1:]
        cells = [
            (
                *(row.phase, f"{row.begin:.4f}", row.quantity),
                *(f"{error:.1e}" for error in row.errors),
                " ".join(f"{order:.1f}" for order in row.orders),
            )
            for row in rows
        ]
        names = ("phase", "from [s]", "quantity", *steps, "orders")
        shown = table(names, cells, "largest errors", words=("from [s]", "quantity"))
        return Findings({"orders": [asdict(row) for row in rows]}, [shown])

    def write(self, records: Mapping[str, Record], directory: Path, *, pictures: bool) -> list[Path]:
        """Write a row per stretch and quantity."""
        steps = list(records)[1:]
        rows = [
            {"phase": row.phase, "begin": row.begin, "end": row.end, "quantity": row.quantity}
            | {f"error at {step}": error for step, error in zip(steps, row.errors, strict=True)}
            | {f"order from {step}": order for step, order in zip(steps[:-1], row.orders, strict=True)}
            for row in self.rows(records)
        ]
        return [write_csv(directory / "orders.csv", rows)]
