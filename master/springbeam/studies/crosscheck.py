"""``springbeam crosscheck``: compare a run with the reference of its law, and show the orders of smaller steps."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from rich.text import Text

from ..monolithic import event_driven
from ..pictures.diagrams import Diagram, draw_diagrams
from ..results.contact_changes import contact_changes
from ..results.trajectory import Trajectory, columns_of
from ..run.outcome import RunStopped
from ..scene import Scene, with_changes
from .accuracy import simulate
from .comparison import SHORT, Verdict, away_from, compare, macro_points, quantities, sample
from .tables import Done, Findings, Row, difference, in_words, table, unseen

#: Exit codes of the command.
CODES: dict[Verdict, int] = {"agrees": 0, "differs": 1, "not comparable": 4}
_STOPPED = 3
#: Number of halvings of the macro step; one less if quick.
_HALVINGS = 3


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
    summary = {name: found for name, found in record.items() if name != "runs"}
    pictures = {"crosscheck": partial(_drawn, record["runs"])} if record["runs"] else {}
    tables = {"crosscheck": record["quantities"]}
    return Findings(summary, shown, code=CODES[verdict], tables=tables, pictures=pictures)


def _drawn(runs: Mapping[str, Trajectory]) -> Any:
    """Draw both motions, forces and impulses."""
    from ..pictures.timeline import draw_compared

    return draw_compared(runs)


def _ok(row: Mapping[str, Any]) -> str:
    return "ok" if row["passed"] else "DIFFERS"


def orders(scene: Scene, *, quick: bool = False, done: Done = unseen) -> Findings:
    """Compare ``scene`` at H, H/2, H/4, … with the event-driven reference: errors and observed orders.

    Errors of displacement, velocity and contact force are in the max norm between two changes of contact, at the macro
    points that all runs share and two macro steps away from the events. A run that stops early leaves its column empty;
    fewer than two runs show no order: exit code 3. ``done`` is called after each of `parts_of_orders`.

    Raises
    ------
    SceneError
        If there is no reference to converge to, or ``scene`` asks for an accuracy.
    ReferenceFailure
        If the reference stops early.
    """
    event_driven.refuse(scene)
    H = scene.coupling.H
    sizes = {f"H/{2**k}" if k else "H": H / 2**k for k in range(parts_of_orders(quick) - 1)}
    reference = event_driven.integrate(scene, sample_times=macro_points(scene))
    done()
    found = dict[str, list[Row]]()
    stopped = dict[str, str]()
    for step, size in sizes.items():
        try:
            found[step] = _errors(scene, simulate(with_changes(scene, coupling={"macro_step": size})), reference)
        except RunStopped as error:
            stopped[step] = str(error)
        done()
    rows = list[Row]()
    cells = list[tuple[Any, ...]]()
    curves = dict[str, dict[str, Any]]()
    for several in zip(*found.values(), strict=True):
        errors = dict(zip(found, (row["error"] for row in several), strict=True))
        observed = {
            a: float(np.log2(errors[a] / errors[b])) / float(np.log2(sizes[a] / sizes[b]))
            for a, b in itertools.pairwise(errors)
            if errors[a] and errors[b]
        }
        row = {name: several[0][name] for name in ("phase", "begin", "end", "quantity")}
        between = " ".join(in_words(observed.get(step), ".1f") or "–" for step in list(errors)[:-1])
        shown = (errors.get(step) for step in sizes)
        cells.append((row["phase"], row["begin"], row["quantity"], *shown, between))
        of_stretch = curves.setdefault(f"{row['phase']} from {row['begin']:.4g} s", {})
        of_stretch[row["quantity"]] = [(sizes[step], error) for step, error in errors.items()]
        row |= {f"error_{step}": errors.get(step) for step in sizes}
        rows.append(row | {f"order_{step}": observed.get(step) for step in list(sizes)[:-1]})
    names = ("phase", "from [s]:.4f", "quantity", *(f"{step}:.1e" for step in sizes), "orders")
    diagrams = [Diagram("macro step [s]", "unit of the quantity", lines, stretch) for stretch, lines in curves.items()]
    draw = partial(draw_diagrams, diagrams, f"{scene.title}: largest errors")
    return Findings(
        {"orders": rows, "stopped": stopped},
        [table(names, cells, "largest errors")] + [f"{step}: {why}" for step, why in stopped.items()],
        code=_STOPPED if len(found) < 2 else 0,
        error="no orders: fewer than two of the runs came to their end" if len(found) < 2 else "",
        tables={"orders": rows},
        pictures={"orders": draw} if rows else {},
    )


def parts_of_orders(quick: bool) -> int:
    """Return how many solutions `orders` computes: the reference and the runs."""
    return 1 + _HALVINGS + 1 - quick


def _errors(scene: Scene, run: Trajectory, reference: Trajectory) -> list[Row]:
    """Return a row per quantity between two changes of contact, with the largest error."""
    times = macro_points(scene)
    H = scene.coupling.H
    names = [name for name in quantities(scene) if name not in ("e_beam", "e_spring")]
    sampled = sample(run, times)
    off = {name: np.abs(sampled[name] - reference[name]) for name in names}
    changes = [change.time for change in contact_changes(reference, SHORT * H)]
    found = []
    for begin, end in itertools.pairwise([times[0], *changes, scene.time.t_end]):
        inside = np.flatnonzero((times > begin) & (times < end) & away_from(times, (begin, end), H))
        phase = str(reference.phase[inside[len(inside) // 2]]) if len(inside) >= 4 else ""
        for name in (name for name in names if phase and (name, phase) != ("contact_force", "free")):
            error = float(np.nanmax(off[name][inside]))
            found.append({"phase": phase, "begin": begin, "end": end, "quantity": name, "error": error})
    return found
