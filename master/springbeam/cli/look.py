"""``springbeam report``, ``plot``, ``animate``, ``export``, ``compare`` and ``spectrum``: the results of runs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import typer
from rich.progress import BarColumn, MofNCompleteColumn

from ..pictures.diagrams import Diagram, draw_diagrams
from ..results.directory import ANIMATIONS, OVERVIEW, PICTURES, REPORT
from ..results.files import load_trajectory
from ..results.totals import LOSS_NAMES, TOTALS, totals
from ..results.trajectory import Trajectory
from ..scene import Scene
from ..scene.messages import nearest
from ..studies.tables import Findings, table
from .common import (
    BAD_INPUT,
    ForceOption,
    JsonOption,
    MapOption,
    NoPlotsOption,
    QuietOption,
    ReadOption,
    RunArgument,
    fail,
    progress_bar,
    results_directory,
)

#: Power below this share of the highest line is not drawn.
_FLOOR = 1e-12
#: Of a picture of runs beside each other.
_DPI = 160


def report(
    directory: RunArgument,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="FILE", help=f"The file to write. Default: DIR/{REPORT}")
    ] = None,
    force: ForceOption = False,
) -> Findings:
    """Write a run as one HTML page: motion with a time slider, charts, numbers, the scene. It needs no network.

    Example: springbeam report results/soft
    """
    trajectory = load_trajectory(results_directory(directory))
    target = _free(out or directory / REPORT, force)
    from ..pictures.report import page  # plotly takes a second to load

    target.write_text(page(trajectory), encoding="utf-8")
    return Findings(files=[("", target)])


def plot(
    directory: RunArgument,
    names: Annotated[
        list[str] | None,
        typer.Option("--picture", metavar="NAME", help=f"One of {', '.join(PICTURES)}; may be repeated."),
    ] = None,
    everything: Annotated[bool, typer.Option("--all", help="Draw all of them.")] = False,
) -> Findings:
    """Draw pictures of a run into its directory, without options the overview that springbeam run draws.

    Example: springbeam plot results/soft --picture moments --picture gap_and_energy
    """
    if unknown := [name for name in names or () if name not in PICTURES]:
        allowed = f"{nearest(unknown[0], PICTURES)}allowed: {', '.join(PICTURES)}"
        fail(BAD_INPUT, f"--picture {unknown[0]}: unknown; {allowed}")
    trajectory = load_trajectory(results_directory(directory))
    from ..pictures.plots import plot_run

    written = plot_run(trajectory, directory, PICTURES if everything else names or (OVERVIEW,))
    if not written:
        fail(BAD_INPUT, f"{directory}: the run has nothing to show of {', '.join(names or PICTURES)}")
    return Findings(files=[("", file) for file in written])


def export(
    directory: RunArgument,
    form: Annotated[
        Literal["csv", "parquet"],
        typer.Option("--format", help="csv: trajectory.csv anew. parquet: rows, events and shapes."),
    ] = "csv",
) -> Findings:
    """Write the tables of a run from its records (steps.bin), also of one that was killed or still runs.

    Example: springbeam export results/soft --format parquet
    """
    from ..results.files import export as write

    return Findings(files=[("", file) for file in write(results_directory(directory), form)])


def animate(
    directory: RunArgument,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", metavar="FILE", help=f"A .gif, or an .mp4 (needs ffmpeg). Default: DIR/{ANIMATIONS[0]}"
        ),
    ] = None,
    seconds: Annotated[
        float, typer.Option("--seconds", metavar="SECONDS", min=0.1, max=600.0, help="How long it plays.")
    ] = 10.0,
    fps: Annotated[int, typer.Option("--fps", metavar="N", min=1, max=50, help="Frames per second.")] = 20,
    force: ForceOption = False,
    quiet: QuietOption = False,
) -> Findings:
    """Write a run as an animation: beam and spring above their positions over time.

    Example: springbeam animate results/soft --out soft.mp4
    """
    trajectory = load_trajectory(results_directory(directory))
    target = _free(out or directory / ANIMATIONS[0], force)
    from ..pictures.animation import AnimationError
    from ..pictures.animation import animate as write

    def progress(times: Sequence[float]) -> Iterable[float]:
        with progress_bar(BarColumn(bar_width=20), MofNCompleteColumn(), quiet=quiet) as bar:
            yield from bar.track(times)

    try:
        write(trajectory, target, seconds=seconds, fps=fps, progress=progress)
    except AnimationError as error:
        fail(BAD_INPUT, str(error))
    return Findings(files=[("", target)])


def _free(path: Path, force: bool) -> Path:
    if path.exists() and not force:
        fail(BAD_INPUT, f"{path} already exists; --force replaces it, --out FILE writes another")
    return path


def compare(
    runs: Annotated[
        list[Path],
        typer.Argument(metavar="DIR…", help="Directories of two runs or more; or of one, and a file of measurements."),
    ],
    names: MapOption = None,
    read: ReadOption = None,
    shift: Annotated[
        float | None,
        typer.Option("--shift", metavar="SECONDS", help="Move the measurement's clock. Default: by correlation."),
    ] = None,
    out: Annotated[Path, typer.Option("--out", "-o", metavar="FILE", help="Where the picture goes.")] = Path(
        "results/comparison.png"
    ),
    no_plots: NoPlotsOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> Findings:
    """Compare runs: the keys that differ, the results that matter, and their motions and forces in one picture.

    Beside a file of measurements: how far the run is from them.

    Example: springbeam compare results/soft results/light
    """
    if len(runs) > 1 and not runs[-1].exists():
        fail(BAD_INPUT, f"{runs[-1]}: no such file or directory; compare takes runs, or a run and a file")
    measured = runs[-1].is_file()
    of_files = names or read or shift is not None
    if len(runs) < 2 or (measured and len(runs) > 2) or (not measured and of_files):
        what = "compare takes runs; or one run and a file of measurements, with --map, --read and --shift of these"
        fail(BAD_INPUT, what)
    trajectories = [load_trajectory(results_directory(run)) for run in runs[: 1 if measured else None]]
    if measured:
        found = _beside_measured(trajectories[0], runs[1], names or [], shift, read or [])
    else:
        found = _beside_one_another([str(run) for run in runs], trajectories)
    if no_plots:
        return replace(found, document={**found.document, "picture": None})
    out.parent.mkdir(parents=True, exist_ok=True)
    found.pictures["comparison"]().savefig(out, dpi=_DPI)
    return replace(found, document={**found.document, "picture": out}, files=[("picture", out)], where=out)


def _beside_one_another(names: list[str], runs: list[Trajectory]) -> Findings:
    """Compare runs."""

    def draw() -> Any:
        from ..pictures.timeline import draw_compared

        return draw_compared(dict(zip(names, runs, strict=True)))

    keys, results = differing_keys([run.scene for run in runs]), results_of(runs)
    titles = {"keys that differ": keys, "results": results}
    columns = ("", *(f"{name}:.5g" for name in names))
    shown = [table(columns, [(name, *of) for name, of in found.items()], title) for title, found in titles.items()]
    return Findings({"runs": names, "keys": keys, "results": results}, shown, pictures={"comparison": draw})


def _beside_measured(run: Trajectory, file: Path, names: list[str], shift: float | None, read: list[str]) -> Findings:
    """Compare a run with measured curves."""
    from ..signals.measured import model, read_measured, reading_of, residuals, time_shift
    from ..signals.spectra import without_peak
    from ..studies.fit import mapping

    measured = read_measured(file, run.scene, mapping(names), reading_of(read))
    moved = time_shift(run, measured) if shift is None else shift
    found = residuals(run, measured, moved)

    covered, curves = model(run, measured, moved)
    time, diagrams = measured.time[covered] + moved, []
    for name, curve in curves.items():
        both = {"measured": measured.values[name][covered], "run": curve}
        points = {which: np.column_stack([time, values]) for which, values in both.items()}
        diagrams.append(Diagram("time t [s]", name, points, log=False, dots=("measured",)))
    columns = ("curve", "points:", "rms:.4g", "of its spread:.2%", "largest:.4g", "at t [s]:.6g")
    by_what = ", found by correlation" * (shift is None)
    shown = [
        table(columns, found),
        f"shift     {moved:.6g} s{by_what}",
        *(f"{'read':<10}{note}" for note in measured.notes),
        *filter(None, [without_peak(run, measured.values)]),
    ]
    document = {"shift": moved, "residuals": [row._asdict() for row in found], "read": measured.notes}
    draw = partial(draw_diagrams, diagrams, "", (8.2, 2.2), wide=1)
    return Findings(document, shown, pictures={"comparison": draw})


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
    common = max(run.summary.get("contact_force_window", 0.0) for run in runs)
    summaries = [dict(run.summary) for run in runs]
    for run, summary in zip(runs, summaries, strict=True):
        if summary.get("contact_force_window", common) != common:
            del summary["contact_force_max"], summary["contact_force_window"]
            if run.steps is not None:
                found = totals(run.scene, run.steps, run.events, common)
                summary |= {"contact_force_max": found["contact_force_max"], "contact_force_window": common}
    return summaries


def spectrum(
    run: RunArgument,
    of: Annotated[
        list[str] | None,
        typer.Option(
            "--of",
            metavar="COLUMN",
            help="Column whose power is wanted, as a_tip, or module:function of the run; may be repeated.",
        ),
    ] = None,
    low: Annotated[float | None, typer.Option("--low", metavar="HZ", help="Lowest oscillator of the shock.")] = None,
    high: Annotated[float | None, typer.Option("--high", metavar="HZ", help="Highest oscillator of the shock.")] = None,
    quality: Annotated[float, typer.Option("--quality", metavar="Q", help="1/2ζ of the oscillators.")] = 10.0,
    since: Annotated[
        float | None,
        typer.Option(
            "--since", metavar="SECONDS", help="Start of the power spectra. Default: where the motion settles."
        ),
    ] = None,
    segments: Annotated[
        int, typer.Option("--segments", metavar="N", min=1, help="Parts whose power spectra are averaged.")
    ] = 1,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="DIR", help="Where tables and picture go. Default: DIR-spectrum."),
    ] = None,
    no_plots: NoPlotsOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> Findings:
    """Find spectra of a run: shock response, power, and the points and the period of a driven motion.

    Example: springbeam spectrum results/soft --of a_tip --quality 25
    """
    from ..signals.spectra import spectra

    trajectory = load_trajectory(results_directory(run))
    found = spectra(trajectory, of or (), low, high, quality, since, segments)
    directory = out or run.with_name(f"{run.resolve().name}-spectrum")
    directory.mkdir(parents=True, exist_ok=True)
    columns = {f"shock-{end}": shock._asdict() for end, shock in found.shock.items()}
    for number, (what, power) in enumerate(found.power.items()):
        columns[f"power-{what if what.isidentifier() else number}"] = power._asdict()
    swept = {(what, chirp.load): chirp for what, several in found.responses.items() for chirp in several}
    for (what, load), chirp in swept.items():
        name = f"response-{what if what.isidentifier() else 'function'}-load-{load}"
        columns[name] = {"frequency": chirp.frequency, "amplitude": chirp.amplitude}
    if found.points is not None:
        times, points = found.points
        columns["poincare"] = {"time": times, "position": points[:, 0], "velocity": points[:, 1]}
    shocks = {f"shock at the {end}": np.transpose(s[:2]) for end, s in found.shock.items()}
    powers = {f"power of {what}": np.transpose(p[:2])[1:] for what, p in found.power.items()}
    powers = {name: points[points[:, 1] > _FLOOR * points[:, 1].max()] for name, points in powers.items()}
    answers = {f"{what} to load {load}, {c.way}": np.transpose(c[1:]) for (what, load), c in swept.items()}
    once = {} if found.points is None else {"points": found.points[1]}
    diagrams = [
        Diagram("frequency [Hz]", "largest acceleration [m/s²]", shocks),
        Diagram("frequency [Hz]", "power density [unit²/Hz]", powers),
        Diagram("frequency of the chirp [Hz]", "half the range [unit]", answers, log=False),
        Diagram("position once a period of the drive [m]", "velocity [m/s]", once, log=False, dots=tuple(once)),
    ]
    drawn = [diagram for diagram in diagrams if diagram.curves]
    draw = partial(draw_diagrams, drawn, trajectory.scene.title or str(run), (8.2, 2.6), wide=1)
    tables = {
        name: [dict(zip(of, row, strict=True)) for row in np.transpose(list(of.values())).tolist()]
        for name, of in columns.items()
    }
    settled = None if found.settled is None else {**found.settled._asdict(), "period": found.settled.period}
    document = {
        "shock": {end: shock._asdict() for end, shock in found.shock.items()},
        "jumps": found.jumps,
        "highest": {what: power.highest for what, power in found.power.items()},
        "settled": settled,
    }
    lines = [f"{what:<20} {words}" for what, words in found.in_words()]
    return Findings(document, lines, tables=tables, pictures={"spectrum": draw}).written(
        directory, pictures=not no_plots
    )
