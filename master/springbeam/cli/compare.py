"""``springbeam compare``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.text import Text

from ..results.reading import load_trajectory
from ..results.totals import LOSS_NAMES, TOTALS, totals
from ..results.trajectory import Trajectory
from ..scene import Scene
from ..studies.tables import table
from .common import (
    BAD_INPUT,
    JsonOption,
    NoPlotsOption,
    QuietOption,
    bad_input_reported,
    console_for,
    fail,
    print_json,
    results_directory,
)

#: Windows closer than this share are one.
_SAME_WINDOW = 1e-9


def compare(
    runs: Annotated[list[Path], typer.Argument(metavar="DIR…", help="Directories of two runs or more.")],
    out: Annotated[Path, typer.Option("--out", "-o", metavar="FILE", help="Where the picture goes.")] = Path(
        "results/comparison.png"
    ),
    no_plots: NoPlotsOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Compare runs: the keys that differ, the results that matter, and their motions and forces in one picture.

    Example: springbeam compare results/soft results/light
    """
    if len(runs) < 2:
        fail(BAD_INPUT, "one run; compare takes two or more")
    with bad_input_reported():
        trajectories = [load_trajectory(results_directory(run)) for run in runs]
        names = [str(run) for run in runs]
        keys, results = differing_keys([run.scene for run in trajectories]), results_of(trajectories)
        drawn = not no_plots
        if drawn:
            from ..pictures.comparison import draw  # matplotlib takes a second to load

            out.parent.mkdir(parents=True, exist_ok=True)
            draw(dict(zip(names, trajectories, strict=True)), out)
    if as_json:
        print_json({"runs": names, "keys": keys, "results": results, "picture": out if drawn else None})
    elif quiet and drawn:
        typer.echo(out)
    console = console_for(silent=quiet or as_json)
    for title, found in (("keys that differ", keys), ("results", results)):
        console.print(table(("", *names), _rows(found), title))
    if drawn:
        console.print(Text(f"picture   {out}"), soft_wrap=True)


def differing_keys(scenes: list[Scene]) -> dict[str, list[Any]]:
    """Return the values of the keys that are not the same in all scenes, ``None`` where a scene has no such key."""
    flat = [scene.flat() for scene in scenes]
    names = dict.fromkeys(name for keys in flat for name in keys)
    values = {name: [keys.get(name) for keys in flat] for name in names}
    return {name: found for name, found in values.items() if any(value != found[0] for value in found)}


def results_of(runs: list[Trajectory]) -> dict[str, list[Any]]:
    """Return the numbers of `springbeam.results.totals` that any of the runs has, with their units, by run."""
    units = {name: unit for name, (_, unit) in TOTALS.items()} | dict.fromkeys(LOSS_NAMES, "J")
    summaries = _over_one_window(runs)
    found = {f"{name} [{unit}]" if unit else name: [s.get(name) for s in summaries] for name, unit in units.items()}
    found = {name: values for name, values in found.items() if any(values)}
    return {**found, "warnings": [len(run.summary.get("warnings", ())) for run in runs]}


def _over_one_window(runs: list[Trajectory]) -> list[dict[str, Any]]:
    """Return the runs' summaries with their peak forces over one window, the longest of theirs.

    A mean over another window is another quantity. A run without steps, which has no force between its rows, has no
    peak beside those of other windows.
    """
    windows = [run.summary.get("contact_force_window") for run in runs]
    common = max((window for window in windows if window is not None), default=0.0)
    summaries = [dict(run.summary) for run in runs]
    for run, window, summary in zip(runs, windows, summaries, strict=True):
        if window is not None and abs(window - common) > _SAME_WINDOW * common:
            for name in ("contact_force_max", "contact_force_window"):
                del summary[name]
            if run.steps is not None:
                found = totals(run.scene, run.steps, run.events, common, free_at_end=True)
                summary |= {"contact_force_max": found["contact_force_max"], "contact_force_window": common}
    return summaries


def _rows(found: dict[str, list[Any]]) -> list[list[str]]:
    return [[name, *("" if value is None else f"{value:.5g}" if isinstance(value, float) else str(value)
                     for value in values)] for name, values in found.items()]  # fmt: skip
