"""Compare runs with each other, or a run with a file of measurements (``springbeam compare``)."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ..pictures.diagrams import Diagram, draw_diagrams
from ..results.dense import rows_at
from ..results.judged import WORDS
from ..results.totals import LOSS_NAMES, TOTALS
from ..results.trajectory import Trajectory, columns_of
from ..results.window_peak import peak_force
from ..scene import Scene
from ..signals.curves import signal, unit_of
from ..signals.measured import Measured, model, residuals, time_shift
from ..signals.spectra import without_peak
from .metrics import heading
from .tables import Findings, table

#: Points of a curve of a run that is drawn.
_DRAWN = 2000
#: Results of a run with their units, by their names in a summary.
_HEADINGS = {name: heading(name) for name in (*TOTALS, *LOSS_NAMES)}


def beside_one_another(names: list[str], runs: list[Trajectory]) -> Findings:
    """Compare runs."""

    def draw() -> Any:
        from ..pictures.timeline import draw_compared

        return draw_compared(dict(zip(names, runs, strict=True)))

    keys = differing_keys([run.scene for run in runs])
    results = results_of(runs)
    errors = errors_of(runs)
    columns = ("", *(f"{name}:.5g" for name in names))
    beside = ("", *(heading for name in names for heading in (f"{name}:.5g", "±:.1g")))
    unknown = [None] * len(runs)
    rows = [
        (name, *(cell for both in zip(values, errors.get(name, unknown), strict=True) for cell in both))
        for name, values in results.items()
    ]
    shown = [
        table(columns, [(name, *values) for name, values in keys.items()], "keys that differ"),
        table(beside, rows, "results"),
    ]
    document = {"runs": names, "keys": keys, "results": results, "errors": errors}
    return Findings(document, shown, pictures={"comparison": draw})


def beside_measured(run: Trajectory, measured: Measured, shift: float | None) -> Findings:
    """Compare a run with measured curves."""
    moved = time_shift(run, measured) if shift is None else shift
    rows = residuals(run, measured, moved)
    columns = ("curve", "points:", "rms:.4g", "of its spread:.2%", "largest:.4g", "at t [s]:.6g")
    by_what = ", found by correlation" * (shift is None)
    shown = [
        table(columns, rows),
        f"shift     {moved:.6g} s{by_what}",
        *(f"{'read':<10}{note}" for note in measured.notes),
        *filter(None, [without_peak(run, measured.values)]),
    ]
    document = {"shift": moved, "residuals": [row._asdict() for row in rows], "read": measured.notes}
    draw = partial(draw_diagrams, overlaid(run, measured, moved, "run"), "", (8.2, 2.2), wide=1)
    return Findings(document, shown, pictures={"comparison": draw})


def overlaid(run: Trajectory, measured: Measured, shift: float, called: str, *, left: bool = False) -> list[Diagram]:
    """Return diagrams of measured curves and those of a run, ``called`` so, each above what is ``left`` if wanted."""
    covered, curves = model(run, measured, shift)
    time = measured.time[covered] + shift
    dense = np.linspace(time[0], time[-1], _DRAWN)
    between = rows_at(run, dense)
    units = columns_of(run.scene)
    diagrams = []
    for name, curve in curves.items():
        values = measured.values[name][covered]
        unit = unit_of(name, units)
        label = f"{name} [{unit}]" if unit else name
        both = {
            "measured": np.column_stack([time, values]),
            called: np.column_stack([dense, signal(between, name)]),
        }
        diagrams.append(Diagram("" if left else "time t [s]", label, both, log=False, dots=("measured",)))
        if left:
            points = {f"{called} less measured": np.column_stack([time, curve - values])}
            diagrams.append(Diagram("time t [s]", f"left of {label}", points, log=False, dots=tuple(points)))
    return diagrams


def differing_keys(scenes: list[Scene]) -> dict[str, list[Any]]:
    """Return the values of the keys that differ between scenes; ``None`` if a scene has no such key."""
    flat = [scene.flat() for scene in scenes]
    names = dict.fromkeys(name for keys in flat for name in keys)
    values = {name: [keys.get(name) for keys in flat] for name in names}
    return {name: several for name, several in values.items() if any(value != several[0] for value in several)}


def results_of(runs: list[Trajectory]) -> dict[str, list[Any]]:
    """Return the numbers of `springbeam.results.totals` that any of the runs has, with their units, by run."""
    summaries = _over_one_window(runs)
    results = {heading: [s.get(name) for s in summaries] for name, heading in _HEADINGS.items()}
    results = {heading: values for heading, values in results.items() if any(values)}
    return {**results, "warnings": [len(run.summary.get("warnings", ())) for run in runs]}


def errors_of(runs: list[Trajectory]) -> dict[str, list[Any]]:
    """Return the errors of `results_of` that companion runs have shown, by run; relative ones under their own names."""
    judged = [run.summary.get("errors", {}) for run in runs]
    of_results = {
        heading: [errors.get("quantities", {}).get(name) for errors in judged] for name, heading in _HEADINGS.items()
    }
    return of_results | {name: [errors.get(name) for errors in judged] for name in WORDS}


def _over_one_window(runs: list[Trajectory]) -> list[dict[str, Any]]:
    """Return the runs' summaries with their peak forces over one window, the longest of theirs.

    Means over different windows are not comparable. A run without steps, which has no force between its rows, has no
    peak for another window.
    """
    common = max(run.summary.get("contact_force_window", 0.0) for run in runs)
    summaries = [dict(run.summary) for run in runs]
    for run, summary in zip(runs, summaries, strict=True):
        if summary.get("contact_force_window", common) != common:
            del summary["contact_force_max"], summary["contact_force_window"]
            if run.steps is not None:
                peak, _ = peak_force(run.steps, run.events, common)
                summary |= {"contact_force_max": peak, "contact_force_window": common}
    return summaries
