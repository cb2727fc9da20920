"""``springbeam compare``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table
from rich.text import Text

from ..results.reading import load_trajectory
from ..results.totals import LOSS_NAMES, TOTALS, totals
from ..results.trajectory import Trajectory
from ..scene import Scene
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
    console.print(_table("keys that differ", names, keys))
    console.print(_table("results", names, results))
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
    found = {}
    for name, unit in units.items():
        values = [summary.get(name) for summary in summaries]
        if any(values):
            found[f"{name} [{unit}]" if unit else name] = values
    return {**found, "warnings": [len(run.summary.get("warnings", ())) for run in runs]}


def _over_one_window(runs: list[Trajectory]) -> list[dict[str, Any]]:
    """Return the runs' summaries with their peak forces over one window, the longest of theirs.

    A mean over another window is another quantity. A run without steps, which has no force between its rows, has no
    peak beside those of other windows.
    """
    windows = [run.summary.get("contact_force_window") for run in runs]
    known = [window for window in windows if window is not None]
    common = max(known, default=0.0)
    summaries = []
    for run, window in zip(runs, windows, strict=True):
        summary = dict(run.summary)
        if window is not None and abs(window - common) > _SAME_WINDOW * common:
            peak = None
            if run.steps is not None:
                peak = totals(run.scene, run.steps, run.events, common, free_at_end=True)["contact_force_max"]
            summary |= {"contact_force_max": peak, "contact_force_window": None if peak is None else common}
        summaries.append(summary)
    return summaries


def _table(title: str, names: list[str], rows: dict[str, list[Any]]) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold", title=title, title_justify="left")
    table.add_column("", overflow="fold")
    for name in names:
        table.add_column(Text(name), justify="right", overflow="fold")
    for name, values in rows.items():
        table.add_row(Text(name), *(_shown(value) for value in values))
    return table


def _shown(value: Any) -> Text:
    return Text("" if value is None else f"{value:.5g}" if isinstance(value, float) else str(value))
