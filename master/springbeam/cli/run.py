"""``springbeam run``, and the results of a run in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from math import inf
from pathlib import Path
from time import monotonic
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from ..bodies.protocol import FmuError
from ..results.directory import RunDirectory
from ..results.files import load_events, load_summary, load_trajectory
from ..results.recording import FileRecorder
from ..results.totals import in_words
from ..results.trajectory import Event, Trajectory, rounded
from ..run.checkpoint import Checkpoint
from ..run.outcome import Progress
from ..scene import Scene, load_scene
from ..scene.suspicions import implausible
from ..studies.tables import table
from .common import (
    BAD_INPUT,
    STOPPED,
    ForceOption,
    JsonOption,
    NoPlotsOption,
    QuietOption,
    SceneArgument,
    SettingsOption,
    bad_input_reported,
    cause_of,
    console_for,
    fail,
    print_json,
    progress_bar,
)

#: Most rows that --output-interval may ask for.
_MOST_ROWS = 10_000_000
_REFRESH_SECONDS = 0.1
#: More are in events.csv.
_FIRST_EVENTS = 12


def run(
    scene: SceneArgument,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", metavar="DIR", help="Where results go. Default: results/SCENE, or results/SCENE-2, …"
        ),
    ] = None,
    settings: SettingsOption = None,
    accuracy: Annotated[
        float | None,
        typer.Option(
            "--accuracy",
            metavar="RELATIVE",
            help="Largest relative error of motion, contact times and impulses; picks scheme and steps.",
        ),
    ] = None,
    mesh: Annotated[
        bool,
        typer.Option("--mesh", help="With --accuracy: refine the mesh too, until two meshes agree."),
    ] = False,
    checkpoint: Annotated[
        float | None,
        typer.Option(
            "--checkpoint",
            metavar="SECONDS",
            min=0.0,
            help="Save every so many seconds what springbeam resume needs. Not with an accuracy.",
        ),
    ] = None,
    interval: Annotated[
        float | None,
        typer.Option(
            "--output-interval",
            metavar="DT",
            help="Write rows at multiples of DT [s] into trajectory.csv, not one per step.",
        ),
    ] = None,
    no_plots: NoPlotsOption = False,
    force: ForceOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run a scene; write its results, events and pictures into a directory.

    Example: springbeam run soft --set coupling.macro_step=5e-4 --out results/fine
    """
    with bad_input_reported():
        what = load_scene(scene, settings or (), accuracy)
        _refuse_options(what, checkpoint, interval)
        for line in () if quiet or as_json else implausible(what):
            typer.echo(f"warning: {line}", err=True)
        made = picked(what, mesh)
        what = what if made is None else made.scene
        default = Path("results") / Path(scene).stem
        numbered = out is None and not force
        directory = (
            RunDirectory.create_numbered(default) if numbered else RunDirectory.create(out or default, replace=force)
        )
    carry_out(
        what,
        directory,
        seconds=checkpoint,
        no_plots=no_plots,
        quiet=quiet,
        as_json=as_json,
        made=made,
        interval=interval,
    )


def _refuse_options(scene: Scene, checkpoint: float | None, interval: float | None) -> None:
    """End the command if the run of ``scene`` cannot have an option."""
    apart, end = "leave one of the two out", scene.time.t_end
    if checkpoint is not None and scene.accuracy is not None:
        why = f"a run with accuracy = {scene.accuracy:g} is written when it is done, and has nothing to resume before"
        fail(BAD_INPUT, f"--checkpoint {checkpoint:g}: {why}; {apart}")
    if interval is not None and not end / _MOST_ROWS <= interval < inf:
        rows = f"of which at most {_MOST_ROWS:,} lie before time.t_end = {end:g} s"
        fail(BAD_INPUT, f"--output-interval {interval:g}: must be a time [s], {rows}")
    if interval is not None and scene.contact.algorithm:
        law = f'contact.law = "{scene.contact.law}" has no data between its steps'
        fail(BAD_INPUT, f"--output-interval {interval:g}: {law}; {apart}")


def picked(scene: Scene, mesh: bool = False) -> Trajectory | None:
    """Return the run that keeps the accuracy asked for, of the ``mesh`` too; ``None`` if none is."""
    if scene.accuracy is None and not mesh:
        return None
    from ..run.outcome import RunStopped
    from ..studies.accuracy import pick, pick_mesh

    try:
        return pick_mesh(scene) if mesh else pick(scene)
    except RunStopped as stopped:
        fail(STOPPED, f"a pilot run for accuracy = {scene.accuracy:g} {stopped}")


def carry_out(
    scene: Scene,
    directory: RunDirectory,
    *,
    seconds: float | None,
    start: Checkpoint | None = None,
    no_plots: bool,
    quiet: bool,
    as_json: bool,
    made: Trajectory | None = None,
    interval: float | None = None,
) -> None:
    """Run ``scene`` into ``directory``, from ``start`` if given, and report; see `springbeam.run.runner.run`.

    A run that is already ``made`` is only written; ``interval`` as of `FileRecorder`.
    """
    console = console_for(silent=quiet or as_json)
    recorder = FileRecorder(scene, directory, interval)
    try:
        with bad_input_reported():
            error = _run_into(recorder, seconds, start, made, quiet=quiet)
    finally:
        if not recorder.begun:
            directory.discard()
    report(console, directory, scene)
    if not no_plots and (trouble := _draw(console, directory)) is not None:
        error = error or f"{trouble}; what was computed is in {directory.path}"
    if as_json:
        print_json({"directory": directory.path, **load_summary(directory.path)})
    elif quiet:
        typer.echo(directory.path)
    if error is not None:
        fail(STOPPED, error)


def _draw(console: Console, directory: RunDirectory) -> str | None:
    """Draw the pictures; return why there are none, or ``None``."""
    from ..pictures.plots import plot_run  # matplotlib takes a second to load

    try:
        pictures = plot_run(load_trajectory(directory.path), directory.path)
    except (KeyboardInterrupt, OSError) as error:
        return f"no pictures: {cause_of(error, directory.path)}"
    if pictures:
        console.print(Text(f"pictures  {directory.path / '*.png'} ({len(pictures)})"), soft_wrap=True)
    return None


def _run_into(
    recorder: FileRecorder,
    seconds: float | None,
    start: Checkpoint | None,
    made: Trajectory | None,
    *,
    quiet: bool,
) -> str | None:
    """Run the scene, or write a run that is ``made``, and return why it stopped early, or ``None``.

    The results are closed and can be loaded either way. Raises what keeps the run from recording anything.
    """
    from ..run.outcome import RunStopped
    from ..run.runner import run as run_scene

    t_end = recorder.scene.time.t_end
    try:
        with _progress(t_end, quiet=quiet) as progress, recorder:
            if made is not None:
                recorder.write(made)
            else:
                run_scene(recorder.scene, recorder, progress, seconds=seconds, start=start)
        return None
    except (RunStopped, OSError, FmuError, KeyboardInterrupt) as error:
        if not recorder.begun and not isinstance(error, RunStopped):
            raise
        directory, cause = recorder.directory, cause_of(error, recorder.directory.path)
        begun = "; a run begun with --checkpoint SECONDS can go on after it has ended early"
        again = f"; springbeam resume {directory.path} goes on from the last checkpoint"
        how = again if directory.checkpoint.exists() else begun * (seconds is None and made is None)
        what = cause if isinstance(error, KeyboardInterrupt) else f"the run stopped early: {cause}"
        where = f"(reached t = {recorder.time:.9g} s of {t_end:g} s)"
        return f"{what} {where}; what was computed is in {directory.path}{how}"


@contextmanager
def _progress(t_end: float, *, quiet: bool) -> Iterator[Progress]:
    """Show simulated time, phase and speed on stderr, if that is a terminal."""
    state, left = TextColumn("{task.fields[state]}"), TimeRemainingColumn()
    with progress_bar(BarColumn(bar_width=20), TaskProgressColumn(), state, left, quiet=quiet) as bar:
        task = bar.add_task("", total=t_end, state="starting")
        start = shown = monotonic()

        def show(time: float, phase: str, macro_steps: int) -> None:
            nonlocal shown
            if not bar.disable and (now := monotonic()) - shown >= _REFRESH_SECONDS:
                shown, speed = now, macro_steps / (now - start)
                bar.update(task, completed=time, state=f"t = {time:.4g}/{t_end:g} s  {phase:<7}{speed:7.0f} steps/s")

        yield show


# -- in words ----------------------------------------------------------------------------------------------------------


def report(console: Console, directory: RunDirectory, scene: Scene) -> None:
    """Print what a run has come to: its events, totals, residuals and warnings."""
    summary, events = load_summary(directory.path), load_events(directory.path)
    console.print(Text(scene.title or "(untitled scene)", style="bold"))
    kinds = Counter(event.kind for event in events)
    if events:
        console.print(_event_table(events[:_FIRST_EVENTS], len(events) - _FIRST_EVENTS, scene))
        counts = ", ".join(f"{number} {kind}" for kind, number in kinds.most_common())
        console.print(f"events    {counts}")
        console.print("          (on the tip, of the stop: impulses, upward; lost: energy that the event takes)")
    results = Table.grid(padding=(0, 2))
    for words, value in in_words(summary):
        results.add_row(Text(words), Text(value))
    console.print(results)
    for line in _lines(summary):
        console.print(Text(line))
    console.print(Text(f"results   {directory.path}"), soft_wrap=True)


def _lines(summary: Mapping[str, Any]) -> Iterator[str]:
    """Yield how the run was made and how far it can be trusted."""
    if "macro_steps" in summary and "wall_time" in summary:
        yield f"run       {summary['macro_steps']} macro steps in {summary['wall_time']:.3g} s"
    if "coupling" in summary:
        yield "coupling  {scheme} {degree}: {because}".format(**summary["coupling"])
    if "max_energy_residual" in summary:
        interface = summary.get("max_interface_residual")
        beside = "" if interface is None else f", of the interface {float(interface):.1e}"
        yield f"energy    largest relative residual {float(summary['max_energy_residual']):.1e}{beside}"
    if (found := summary.get("accuracy")) is not None:
        errors = ", ".join(f"{value:.1e} ({name})" for name, value in found["estimated_errors"].items())
        yield f"accuracy  {picked_in_words(found)}\n          errors at most {errors}"
        if "estimated_mesh_error" in found:
            mesh = f"{found['picked']['n_elements']} elements"
            yield f"mesh      {mesh}: error {found['estimated_mesh_error']:.1e} beside the continuous beam"
    yield from (f"warning   {warning}" for warning in summary.get("warnings", ()))


def picked_in_words(accuracy: Mapping[str, Any]) -> str:
    """Return what was asked for and what was picked, from ``accuracy`` of a summary."""
    found = accuracy["picked"]
    return f"{accuracy['asked']:g} asked: {found['scheme']} {found['degree']}, H = {found['macro_step']:.3g} s"


def _event_table(events: list[Event], more: int, scene: Scene) -> Table:
    position, speed = ("u_tip", "v_tip") if scene.lower is None else ("y", "z")
    names = ("time\n[s]", f"{position}\n[m]", f"{speed}\n[m/s]", "on the\ntip [N·s]", "of the\nstop [N·s]", "lost\n[J]")
    scales = {name: max(abs(getattr(event, name) or 0.0) for event in events) for name in (position, speed)}
    rows = [
        (
            event.kind,
            f"{event.time:.8f}",
            *("" if getattr(event, name) is None else rounded(getattr(event, name), scales[name]) for name in scales),
            *(f"{x:.3g}" if x else "" for x in (event.impulse_contact, event.impulse_foundation, event.energy_loss)),
        )
        for event in events
    ]
    unseen = [("⋮", f"{more} more", *[""] * 5)] * (more > 0)
    return table(("event", *names), rows + unseen)
