"""The study of ``springbeam crosscheck``: one comparison, and what is told of it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from rich.text import Text

from ...pictures.drawing import POSITIONS, present
from ...results.trajectory import Event, Trajectory, columns_of
from ...scene import Scene, with_changes
from ..reference import refuse_without_reference
from ..study import Findings, Record, Study
from ..tables import table, write_csv
from . import crosscheck

_CASE = "comparison"
#: What is told of a compared quantity; the errors at all times are for the picture.
_TOLD = ("quantity", "error", "at", "l2", "bound", "passed")


class Crosscheck(Study):
    """A scene beside the reference of its law."""

    kind: ClassVar[str] = "crosscheck"
    files: ClassVar[tuple[str, ...]] = ("crosscheck.csv", "crosscheck.png")

    scene: Scene  #: its first quarter if quick

    def cases(self) -> dict[str, Scene]:
        """Return the scene to compare. Raises SceneError if there is no reference."""
        scene = self.scene
        if not scene.contact.algorithm:
            refuse_without_reference(scene)
        if self.quick:
            start = scene.contact_time or 0.0
            scene = with_changes(scene, time={"t_end": start + 0.25 * (scene.time.t_end - start)})
        return {_CASE: scene}

    def cost(self) -> str:
        """Say what is run."""
        if self.scene.contact.algorithm:
            return "a run, and Algorithm 1 twice"
        return "2 runs and 2 references, more where the motion is not resolved"

    def record(self, case: Scene) -> Record:
        """Return what was found, and both motions."""
        report = crosscheck(case)
        run, positions = report.trajectory, present(report.trajectory, POSITIONS)
        return {
            "passed": report.passed,
            "horizon": report.horizon,
            "growth": report.growth,
            "quantities": report.rows,
            "events": report.events,
            "notes": report.notes,
            "scene": report.scene.model_dump(exclude_none=True),
            "motion": {name: run[name] for name in ("time", "phase", *positions)},
            "marks": run.events,
            "reference": {name: report.reference[name] for name in ("time", *positions)},
        }

    def findings(self, records: Mapping[str, Record]) -> Findings:
        """Show what was compared: quantities, and changes of contact."""
        record, units = records[_CASE], columns_of(self.scene)
        quantities = [
            (
                f"{row['quantity']} [{units[row['quantity']]}]",
                *(f"{row['error']:.2e}", f"{row['at']:.6g}", f"{row['l2']:.1e}", f"{row['bound']:.1e}"),
                _verdict(row),
            )
            for row in record["quantities"]
        ]
        shown: list[Any] = [*map(Text, record["notes"])]
        shown.append(table(("quantity", "max error", "at t [s]", "L2 error", "bound", ""), quantities))
        if record["events"]:
            names = ("contact", "t [s]", "reference [s]", "error [s]", "bound [s]", "")
            shown.append(table(names, map(_contact, record["events"])))
        begin, *_, end = record["motion"]["time"]
        shown.append(
            f"comparable from {begin:.9g} to {record['horizon']:.9g} s of {end:.9g} s; there a perturbation of the "
            f"reference has grown {record['growth']:.3g} times"
        )
        passed = record["passed"]
        shown.append(Text("passed" if passed else "FAILED", style="bold green" if passed else "bold red"))
        told = {name: record[name] for name in ("passed", "horizon", "growth", "events", "notes", "scene")}
        return Findings({**told, "quantities": _told(record)}, shown, passed)

    def write(self, records: Mapping[str, Record], directory: Path, *, pictures: bool) -> list[Path]:
        """Write a row per quantity, and draw both motions and their errors."""
        from .picture import draw

        record = records[_CASE]
        files = [write_csv(directory / "crosscheck.csv", _told(record))]
        if pictures:
            run, reference = (
                {name: np.array(values) for name, values in record[which].items()} for which in ("motion", "reference")
            )
            trajectory = Trajectory(self.scene, run, [Event(**mark) for mark in record["marks"]])
            files.append(draw(trajectory, reference, record, directory / "crosscheck.png"))
        return files


def _told(record: Record) -> list[dict[str, Any]]:
    return [{name: row[name] for name in _TOLD} for row in record["quantities"]]


def _verdict(row: Mapping[str, Any]) -> str:
    return "ok" if row["passed"] else "FAILED"


def _contact(row: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the row of a change of contact, which the co-simulation may lack."""
    time, exact = row["time"], row["reference"]
    ours, error = ("none", "") if time is None else (f"{time:.10f}", f"{time - exact:.1e}")
    return row["kind"], ours, f"{exact:.10f}", error, f"{row['bound']:.1e}", _verdict(row)
