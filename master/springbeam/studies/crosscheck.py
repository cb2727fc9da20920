"""``springbeam crosscheck``: compare a run with the reference of its law."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from rich.text import Text

from ..monolithic import event_driven
from ..results.trajectory import Trajectory, columns_of
from ..scene import Scene, with_changes
from .comparison import Verdict, compare
from .tables import Done, Findings, difference, table, unseen

#: Exit codes of the command.
CODES: dict[Verdict, int] = {"agrees": 0, "differs": 1, "not comparable": 4}


def crosscheck(scene: Scene, *, quick: bool = False, done: Done = unseen) -> Findings:
    """Compare ``scene`` with the reference of its law: quantities, changes of contact, and the verdict.

    The table is of the quantities, the exit code that of `CODES`. ``quick`` compares the first quarter. ``done`` and
    what is raised: as of `compare`.
    """
    event_driven.refuse(scene)
    start = scene.contact_time or 0.0
    end = scene.time.t_end
    record = compare(with_changes(scene, time={"t_end": start + 0.25 * (end - start)}) if quick else scene, done)
    units = columns_of(scene)
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
    over = " over the whole run" * (verdict == "not comparable")
    looks = {"agrees": "bold green", "differs": "bold red", "not comparable": "bold"}
    shown.append(Text(f"{verdict}{over}", style=looks[verdict]))
    summary = {name: value for name, value in record.items() if name != "runs"}
    pictures = {"crosscheck": partial(_drawn, record["runs"])} if record["runs"] else {}
    tables = {"crosscheck": record["quantities"]}
    return Findings(summary, shown, code=CODES[verdict], tables=tables, pictures=pictures)


def _drawn(runs: Mapping[str, Trajectory]) -> Any:
    """Draw both motions, forces and impulses."""
    from ..pictures.timeline import draw_compared

    return draw_compared(runs)


def _ok(row: Mapping[str, Any]) -> str:
    return "ok" if row["passed"] else "DIFFERS"
