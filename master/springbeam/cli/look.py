"""``springbeam report``, ``plot``, ``animate``, ``export``, ``compare`` and ``spectrum``: the results of runs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import typer

from ..results.directory import ANIMATIONS, OVERVIEW, PICTURES, REPORT
from ..studies.tables import Findings
from .common import (
    BAD_INPUT,
    ForceOption,
    JsonOption,
    MapOption,
    NoPlotsOption,
    QuietOption,
    ReadOption,
    RunArgument,
    ScaleOption,
    fail,
    progress,
    results_directory,
)

#: Size of a picture that compares runs.
_DPI = 160


def report(
    directory: RunArgument,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="FILE", help=f"The file to write. Default: DIR/{REPORT}")
    ] = None,
    force: ForceOption = False,
) -> Findings:
    """Write a run as one HTML page without a network: motion with a time slider, charts, results, scene.

    Example: springbeam report results/soft
    """
    from ..pictures.report import page
    from ..results.files import load_trajectory

    run = results_directory(directory)
    target = _free(out or directory / REPORT, force)
    with progress("reads the run", 2, silent=False) as show:
        trajectory = load_trajectory(run)
        show(1, "makes the page")
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
    """Draw pictures of a run into its directory; without options, the overview.

    Example: springbeam plot results/soft --picture moments --picture gap_and_energy
    """
    if unknown := [name for name in names or () if name not in PICTURES]:
        from ..scene.messages import nearest

        allowed = f"{nearest(unknown[0], PICTURES)}allowed: {', '.join(PICTURES)}"
        fail(BAD_INPUT, f"--picture {unknown[0]}: unknown; {allowed}")
    from ..pictures.plots import plot_run
    from ..results.files import load_trajectory

    run = results_directory(directory)
    with progress("reads the run", 2, silent=False) as show:
        trajectory = load_trajectory(run)
        show(1, "draws")
        written = plot_run(trajectory, directory, PICTURES if everything else names or (OVERVIEW,))
    if not written:
        fail(BAD_INPUT, f"{directory}: the run has no data for {', '.join(names or PICTURES)}")
    return Findings(files=[("", file) for file in written])


def export(
    directory: RunArgument,
    form: Annotated[
        Literal["csv", "parquet"],
        typer.Option("--format", help="Of the tables: rows, events and shapes."),
    ] = "csv",
) -> Findings:
    """Write the tables of a run from its arrays, also of a run that was killed or is not finished.

    Example: springbeam export results/soft --format parquet
    """
    from ..results.files import export as write

    run = results_directory(directory)
    with progress("reads the run and writes its tables", None, silent=False):
        return Findings(files=[("", file) for file in write(run, form)])


def animate(
    directory: RunArgument,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", metavar="FILE", help=f"A .gif, or an .mp4 (needs ffmpeg). Default: DIR/{ANIMATIONS[0]}"
        ),
    ] = None,
    seconds: Annotated[
        float, typer.Option("--seconds", metavar="SECONDS", min=0.1, max=600.0, help="Duration of the animation.")
    ] = 10.0,
    fps: Annotated[int, typer.Option("--fps", metavar="N", min=1, max=50, help="Frames per second.")] = 20,
    force: ForceOption = False,
    quiet: QuietOption = False,
) -> Findings:
    """Write a run as an animation: beam and spring above their positions over time.

    Example: springbeam animate results/soft --out soft.mp4
    """
    from ..pictures.animation import AnimationError
    from ..pictures.animation import animate as write
    from ..results.files import load_trajectory

    trajectory = load_trajectory(results_directory(directory))
    target = _free(out or directory / ANIMATIONS[0], force)

    def counted(times: Sequence[float]) -> Iterable[float]:
        with progress("frames", len(times), silent=quiet) as show:
            for number, time in enumerate(times, 1):
                yield time
                show(number)

    try:
        write(trajectory, target, seconds=seconds, fps=fps, progress=counted)
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
        typer.Argument(metavar="DIR", help="Directories of two runs or more; or of one, and a file of measurements."),
    ],
    names: MapOption = None,
    scale: ScaleOption = None,
    read: ReadOption = None,
    shift: Annotated[
        float | None,
        typer.Option("--shift", metavar="SECONDS", help="Move the measurement's clock. Default: by correlation."),
    ] = None,
    out: Annotated[Path, typer.Option("--out", "-o", metavar="FILE", help="File of the picture.")] = Path(
        "results/comparison.png"
    ),
    no_plots: NoPlotsOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> Findings:
    """Compare runs: keys that differ, results, and motions and forces in one picture.

    With a file of measurements: the differences of the run to them.

    Example: springbeam compare results/soft results/light
    """
    if len(runs) > 1 and not runs[-1].exists():
        fail(BAD_INPUT, f"{runs[-1]}: no such file or directory; compare takes runs, or a run and a file")
    measured = runs[-1].is_file()
    of_files = names or scale or read or shift is not None
    if len(runs) < 2 or (measured and len(runs) > 2) or (not measured and of_files):
        what = "compare takes runs; or one run and a file of measurements, with --map, --scale, --read and --shift"
        fail(BAD_INPUT, what)
    from ..results.files import load_trajectory
    from ..signals.measured import measured_as
    from ..studies.beside import beside_measured, beside_one_another

    directories = [results_directory(run) for run in runs[: 1 if measured else None]]
    with progress("reads the runs", 3, silent=quiet or as_json) as show:
        trajectories = [load_trajectory(directory) for directory in directories]
        show(1, "compares")
        if measured:
            run = trajectories[0]
            findings = beside_measured(
                run, measured_as(runs[1], run.scene, names or (), scale or (), read or ()), shift
            )
        else:
            findings = beside_one_another([str(run) for run in runs], trajectories)
        if no_plots:
            return replace(findings, document={**findings.document, "picture": None})
        show(2, "draws")
        out.parent.mkdir(parents=True, exist_ok=True)
        findings.pictures["comparison"]().savefig(out, dpi=_DPI)
    return replace(findings, document={**findings.document, "picture": out}, files=[("picture", out)], where=out)


def spectrum(
    run: Annotated[
        Path, typer.Argument(metavar="DIR|FILE", help="Results of springbeam run, or a file of recorded accelerations.")
    ],
    of: Annotated[
        list[str] | None,
        typer.Option(
            "--of",
            metavar="COLUMN",
            help="Column for the power spectrum, such as a_tip, or module:function of the run; or column of the file; "
            "may be repeated.",
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
    unit: Annotated[
        Literal["m/s²", "g"] | None,
        typer.Option("--unit", help="Unit of accelerations. Default: m/s², or g if the file has g."),
    ] = None,
    over: Annotated[
        str | None,
        typer.Option(
            "--over",
            metavar="NAME",
            help="Also show shock spectra over that of the base, or of a column of the file.",
        ),
    ] = None,
    required: Annotated[
        Path | None,
        typer.Option("--required", metavar="FILE", help="Compare with a shock spectrum: a file of Hz and m/s² or g."),
    ] = None,
    tolerance: Annotated[
        str, typer.Option("--tolerance", metavar="LOW:HIGH", help="Allowed deviation from --required in dB.")
    ] = "-3:6",
    scale: ScaleOption = None,
    read: ReadOption = None,
    segments: Annotated[
        int, typer.Option("--segments", metavar="N", min=1, help="Parts whose power spectra are averaged.")
    ] = 1,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="DIR", help="Directory for tables and picture. Default: DIR-spectrum."),
    ] = None,
    no_plots: NoPlotsOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> Findings:
    """Compute spectra of a run: shock response, power, and the points and the period of a driven motion.

    Of a file: shock response and power of the accelerations in it.

    Example: springbeam spectrum results/soft --of a_tip --quality 25
    """
    from ..results.files import load_trajectory
    from ..signals.measured import by_column, reading_of
    from ..studies.spectrum import Shocks, spectrum_of_record
    from ..studies.spectrum import spectrum as spectra_of

    recorded = run.is_file()
    if not recorded:
        results_directory(run)
    if (recorded and since is not None) or (not recorded and (scale or read)):
        fail(BAD_INPUT, "--since is for runs, --scale and --read are for files")
    try:
        lowest, highest = map(float, tolerance.split(":"))
    except ValueError:
        fail(BAD_INPUT, f"--tolerance {tolerance}: must be LOW:HIGH in dB, as -3:6")
    shocks = Shocks(unit or "m/s²", over, required, (lowest, highest))
    with progress("reads the run", 3, silent=quiet or as_json) as show:
        if recorded:
            show(1, "computes spectra")
            scales = by_column("scale", scale or (), "CH1=2.5 mm/V")
            findings = spectrum_of_record(
                run, of or (), low, high, quality, segments, reading_of(read or ()), scales, shocks, unit
            )
        else:
            trajectory = load_trajectory(run)
            show(1, "computes spectra")
            findings = spectra_of(trajectory, of or (), low, high, quality, since, segments, str(run), shocks)
        show(2, "writes and draws")
        directory = out or run.with_name(f"{run.stem if recorded else run.resolve().name}-spectrum")
        directory.mkdir(parents=True, exist_ok=True)
        return findings.written(directory, pictures=not no_plots)
