"""``springbeam crosscheck``: a run beside the reference of its law, and the orders of smaller steps."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from functools import cached_property, partial
from typing import Any, ClassVar

import numpy as np
from rich.text import Text

from ..monolithic import event_driven
from ..pictures.diagrams import Diagram, draw_diagrams
from ..results.contact_times import contact_changes
from ..results.trajectory import Event, Trajectory, columns_of
from ..scene import Scene
from .comparison import SHORT, Verdict, away_from, compare, macro_points, quantities, sample
from .study import Study
from .tables import Findings, Row, difference, in_words, table

#: Exit codes of the command.
CODES: dict[Verdict, int] = {"agrees": 0, "differs": 1, "not comparable": 4}
_CASE = "comparison"
#: How often the macro step is halved; once less if quick.
_HALVINGS = 3


class Crosscheck(Study):
    """A scene beside the reference of its law."""

    kind: ClassVar[str] = "crosscheck"
    announced: ClassVar[str] = "2 runs and 2 references"

    scene: Scene  #: its first quarter if quick

    def cases(self) -> dict[str, Row]:
        """Return the one comparison. Raises SceneError if there is no reference."""
        event_driven.refuse(self.scene)
        start, end = self.scene.contact_time or 0.0, self.scene.time.t_end
        return {_CASE: {"time.t_end": start + 0.25 * (end - start)} if self.quick else {}}

    def record(self, case: Row) -> Row:
        """Return what was found, as `compare` has it."""
        return compare(self.at(case))

    def findings(self, records: Mapping[str, Row]) -> Findings:
        """Show what was compared, quantities and changes of contact, and the verdict; the table is of quantities."""
        record, units = records[_CASE], columns_of(self.scene)
        shown: list[Any] = [*record["notes"]]
        if record["quantities"]:
            cells = [
                (f"{row['quantity']} [{units[row['quantity']]}]", *(row[key] for key in ("error", "at", "l2", "bound")),
                 _ok(row))
                for row in record["quantities"]
            ]  # fmt: skip
            shown.append(table(("quantity", "max error:.2e", "at t [s]:.6g", "L2 error:.1e", "bound:.1e", ""), cells))
            names = ("contact", "t [s]:.10f", "reference [s]:.10f", "error [s]:.1e", "bound [s]:.1e", "")
            cells = [
                (row["kind"], "none" if row["time"] is None else row["time"], row["reference"],
                 difference(row["time"], row["reference"]), row["bound"], _ok(row))
                for row in record["events"]
            ]  # fmt: skip
            shown += [table(names, cells)] * bool(cells)
            shown.append(
                f"comparable from {record['from']:.9g} to {record['horizon']:.9g} s of {record['t_end']:.9g} s; there "
                f"a perturbation of the reference has grown {record['growth']:.3g} times"
            )
        verdict: Verdict = record["verdict"]
        over = " over the run that was asked for" * (verdict == "not comparable")
        looks = {"agrees": "bold green", "differs": "bold red", "not comparable": "bold"}
        shown.append(Text(f"{verdict}{over}", style=looks[verdict]))
        told = {name: found for name, found in record.items() if name != "runs"}
        pictures = {self.kind: partial(self._drawn, record["runs"])} if record["runs"] else {}
        tables = {self.kind: record["quantities"]}
        return Findings(told, shown, code=CODES[verdict], tables=tables, pictures=pictures)

    def _drawn(self, recorded: Mapping[str, Row]) -> Any:
        """Draw both motions, forces and impulses."""
        from ..pictures.timeline import draw_compared

        runs = {
            name: Trajectory(
                self.scene,
                {column: np.array(values) for column, values in run["columns"].items()},
                [Event(**event) for event in run["events"]],
            )
            for name, run in recorded.items()
        }
        return draw_compared(runs)


def _ok(row: Mapping[str, Any]) -> str:
    return "ok" if row["passed"] else "DIFFERS"


class Orders(Study):
    """A scene at H, H/2, H/4, … beside the event-driven reference.

    Errors of displacement, velocity and contact force are in the max norm, at the macro points that all runs share and
    two macro steps away from the events.
    """

    kind: ClassVar[str] = "orders"

    scene: Scene

    def cases(self) -> dict[str, Row]:
        """Return the macro steps. Raises SceneError if there is no reference to converge to."""
        event_driven.refuse(self.scene)
        H, halvings = self.scene.coupling.H, range(_HALVINGS + 1 - self.quick)
        return {f"H/{2**k}" if k else "H": {"coupling.macro_step": H / 2**k} for k in halvings}

    @cached_property
    def reference(self) -> Trajectory:
        """The solution at the macro points."""
        return event_driven.simulate(self.scene, sample_times=macro_points(self.scene))

    def measured(self, run: Trajectory, case: Row) -> Row:
        """Return ``errors``: a row per quantity between two changes of contact, with the largest error."""
        reference, times, H = self.reference, macro_points(self.scene), self.scene.coupling.H
        names = [name for name in quantities(self.scene) if name not in ("e_beam", "e_spring")]
        off = {name: np.abs(sample(run, times, name) - reference[name]) for name in names}
        changes = [change.time for change in contact_changes(reference, SHORT * H)]
        found = []
        for begin, end in itertools.pairwise([times[0], *changes, self.scene.time.t_end]):
            inside = np.flatnonzero((times > begin) & (times < end) & away_from(times, (begin, end), H))
            phase = reference.phase[inside[len(inside) // 2]] if len(inside) >= 4 else ""
            for name in (name for name in names if phase and (name, phase) != ("contact_force", "free")):
                error = float(np.nanmax(off[name][inside]))
                found.append({"phase": phase, "begin": begin, "end": end, "quantity": name, "error": error})
        return {"errors": found}

    def findings(self, records: Mapping[str, Row]) -> Findings:
        """Show the errors at all steps, and the orders between neighbours, of each stretch and quantity."""
        rows, steps, cells = list[Row](), list(records), []
        curves, sizes = dict[str, dict[str, Any]](), [case["coupling.macro_step"] for case in self.cases().values()]
        for several in zip(*(record.get("errors", ()) for record in records.values()), strict=False):
            errors = [row["error"] for row in several]
            orders = [float(np.log2(a / b)) if a and b else None for a, b in itertools.pairwise(errors)]
            row = {name: several[0][name] for name in ("phase", "begin", "end", "quantity")}
            cells.append((
                row["phase"], row["begin"], row["quantity"], *errors,
                " ".join(in_words(order, ".1f") or "–" for order in orders),
            ))  # fmt: skip
            of_stretch = curves.setdefault(f"{row['phase']} from {row['begin']:.4g} s", {})
            of_stretch[row["quantity"]] = list(zip(sizes, errors, strict=True))
            row |= {f"error_{step}": error for step, error in zip(steps, errors, strict=True)}
            rows.append(row | {f"order_{step}": order for step, order in zip(steps, orders, strict=False)})
        names = ("phase", "from [s]:.4f", "quantity", *(f"{step}:.1e" for step in steps), "orders")
        shown = table(names, cells, "largest errors")
        labels = "macro step [s]", "unit of the quantity"
        diagrams = [Diagram(*labels, lines, stretch) for stretch, lines in curves.items()]
        draw = partial(draw_diagrams, diagrams, f"{self.scene.title}: largest errors")
        return Findings({"orders": rows}, [shown], tables={self.kind: rows}, pictures={self.kind: draw})
