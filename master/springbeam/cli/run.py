"""``springbeam run``, and the results of a run in words."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from math import inf
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table
from rich.text import Text

from ..results.directory import OVERVIEW
from ..studies.tables import Findings, table
from .common import (
    BAD_INPUT,
    STOPPED,
    AccuracyOption,
    ForceOption,
    JsonOption,
    NoPlotsOption,
    QuietOption,
    SceneArgument,
    SettingsOption,
    cause_of,
    fail,
    in_time,
    progress,
    run_directory,
)

if TYPE_CHECKING:
    from ..motion.events import Event
    from ..results.recording import FileRecorder
    from ..results.trajectory import Contact, Trajectory
    from ..run.outcome import Progress
    from ..scene import Scene

#: Most rows that --output-interval may ask for.
_MOST_ROWS = 10_000_000
_REFRESH_SECONDS = 0.1
#: A run of fewer steps is not timed before it is made; one that takes so long [s] is made if the user agrees.
_MANY_STEPS = 1e6
_LONG = 7200.0
#: Events and cascades of a kind that the table shows; others of this kind are one line, and all are in events.csv.
_FIRST_OF_KIND = 8
#: So many contacts are shown one by one.
_CONTACTS = 10
#: Columns of the table of contacts, and their units.
_OF_CONTACT = {
    "begin": "s",
    "length": "s",
    "impulse": "N·s",
    "peak": "N",
    "at": "s",
    "depth": "m",
    "lost": "J",
    "before": "m/s",
    "after": "m/s",
}
#: Those that have four digits; others have three, so that a row fits into 80 columns.
_TIMES = ("begin", "at")
#: Columns of a contact before its velocities.
_VELOCITIES = 7


def run(
    scene: SceneArgument,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", metavar="DIR", help="Directory for results. Default: results/SCENE, or results/SCENE-2, …"
        ),
    ] = None,
    settings: SettingsOption = None,
    accuracy: AccuracyOption = None,
    interval: Annotated[
        float | None,
        typer.Option(
            "--output-interval",
            metavar="DT",
            help="Write rows at multiples of DT [s] into trajectory.csv, not one per step.",
        ),
    ] = None,
    no_check: Annotated[
        bool, typer.Option("--no-check", help="Leave out the companion run in longer steps, which bounds the errors.")
    ] = False,
    no_plots: NoPlotsOption = False,
    force: ForceOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> Findings:
    """Run a scene; write results, events and an overview into a directory.

    Example: springbeam run soft --set coupling.macro_step=5e-4 --out results/fine
    """
    from ..results.recording import FileRecorder
    from ..scene import load_scene
    from ..scene.plausibility import implausible

    what = load_scene(scene, settings or (), accuracy)
    _refuse_options(what, interval)
    for line in () if quiet or as_json else implausible(what):
        typer.echo(f"warning: {line}", err=True)
    ask_if_long(what)
    accurate = picked(what, silent=quiet or as_json)
    what = what if accurate is None else accurate.scene
    directory = run_directory(Path("results") / Path(scene).stem, out, force=force)
    recorder = FileRecorder(what, directory, interval)
    silent = quiet or as_json
    return carry_out(recorder, made=accurate, check=not no_check, no_plots=no_plots, silent=silent)


def _refuse_options(scene: Scene, interval: float | None) -> None:
    """End the command if the run of ``scene`` cannot have an option."""
    end = scene.time.t_end
    if interval is not None and not end / _MOST_ROWS <= interval < inf:
        rows = f"of which at most {_MOST_ROWS:,} lie before time.t_end = {end:g} s"
        fail(BAD_INPUT, f"--output-interval {interval:g}: must be a time [s], {rows}")


def ask_if_long(scene: Scene) -> None:
    """Ask, on a terminal, whether a run is to be made that takes hours; elsewhere say how long it takes."""
    if scene.accuracy is not None or scene.coupling.adaptive or scene.duration < _MANY_STEPS * scene.coupling.H:
        return
    from ..studies.predict import cost_of

    cost = cost_of(scene)
    seconds = cost["seconds"]
    if seconds is None or seconds < _LONG:
        return
    words = f"{cost['macro_steps']:.3g} macro steps take about {in_time(seconds)}"
    remedy = "a longer coupling.macro_step, or an accuracy, takes fewer"
    if not sys.stdin.isatty():
        typer.echo(f"note: {words}; {remedy}", err=True)
    elif not typer.confirm(f"{words}; {remedy}. Run it all the same?", err=True):
        fail(BAD_INPUT, "not run")


def picked(scene: Scene, *, silent: bool) -> Trajectory | None:
    """Return the run with the accuracy of the scene; ``None`` if the scene has none."""
    if scene.accuracy is None:
        return None
    from ..run.accuracy import pick
    from ..run.outcome import RunStopped

    try:
        with progress_of_run(scene.time.t_end, "pilot runs", silent=silent) as show:
            return pick(scene, show).judged_run()
    except RunStopped as stopped:
        fail(STOPPED, f"a pilot run for accuracy = {scene.accuracy:g} {stopped}")


def carry_out(
    recorder: FileRecorder,
    *,
    made: Trajectory | None = None,
    check: bool = False,
    pictures: Sequence[str] = (OVERVIEW,),
    no_plots: bool,
    silent: bool,
) -> Findings:
    """Run the scene of ``recorder`` and ``check`` the run, or write one that is ``made``; draw ``pictures`` of it.

    Raises what keeps the run from recording anything.
    """
    from ..bodies.protocol import FmuError
    from ..results.contacts import contacts
    from ..results.files import load_events, load_summary
    from ..run.outcome import RunStopped
    from ..run.runner import run as run_scene

    directory = recorder.directory
    t_end = recorder.scene.time.t_end
    error = ""
    try:
        with progress_of_run(t_end, "run", silent=silent) as show, recorder:
            if made is not None:
                recorder.write(made)
            else:
                run_scene(recorder.scene, recorder, show)
                if check:
                    _judge(recorder, silent=silent)
    except (RunStopped, OSError, FmuError, KeyboardInterrupt) as stopped:
        if not recorder.begun and not isinstance(stopped, RunStopped):
            raise
        cause = cause_of(stopped, directory.path)
        if isinstance(stopped, RunStopped):
            what = f"the run {cause} (its end is t = {t_end:g} s)"
        else:
            early = "" if isinstance(stopped, KeyboardInterrupt) else "the run stopped early: "
            what = f"{early}{cause} (reached t = {recorder.time:.9g} s of {t_end:g} s)"
        error = f"{what}; the results so far are in {directory.path}"
    finally:
        if not recorder.begun:
            directory.discard()
    summary = load_summary(directory.path)
    events = load_events(directory.path)
    touching = contacts(recorder.scene, recorder.steps(), events, summary.get("contact_force_window"))
    shown = list(_in_words(recorder.scene, summary, events, touching))
    document = {"directory": directory.path, **summary}
    files = [("results", directory.path)]
    draw = None if no_plots else partial(_drawn, directory.path, pictures)
    return Findings(document, shown, files, directory.path, STOPPED if error else 0, error, draw)


def _judge(recorder: FileRecorder, *, silent: bool) -> None:
    """Check the run of ``recorder``, and write what its companion shows into its summary."""
    from ..run.companion import check as check_run

    with progress_of_run(recorder.scene.time.t_end, "companion run", silent=silent) as show:
        recorder.amend(check_run(recorder.trajectory(), show).as_summary())


def _drawn(directory: Path, names: Sequence[str]) -> Findings:
    """Draw pictures of the run in ``directory``; report an error if that fails."""
    from ..pictures.plots import plot_run  # matplotlib takes a second to load
    from ..results.files import load_trajectory

    try:
        pictures = plot_run(load_trajectory(directory), directory, names)
    except (KeyboardInterrupt, OSError) as trouble:
        lost = f"no picture: {cause_of(trouble, directory)}; the results are in {directory}"
        return Findings(code=STOPPED, error=lost)
    return Findings(files=[("picture", file) for file in pictures])


@contextmanager
def progress_of_run(t_end: float, what: str, *, silent: bool) -> Iterator[Progress]:
    """Show simulated time, phase and speed of a run, or of several one after the other; ``what`` names them."""
    with progress(what, t_end, silent=silent) as bar:
        start = shown = monotonic()

        def show(time: float, phase: str, macro_steps: int) -> None:
            nonlocal shown
            if (now := monotonic()) - shown >= _REFRESH_SECONDS:
                shown = now
                speed = macro_steps / (now - start)
                bar(time, f"{what}  t = {time:.4g}/{t_end:g} s  {phase:<7}{speed:7.0f} steps/s")

        yield show


# -- in words ----------------------------------------------------------------------------------------------------------


def _in_words(
    scene: Scene, summary: Mapping[str, Any], events: list[Event], contacts: list[Contact]
) -> Iterator[str | Text | Table]:
    """Yield the events, contacts, totals, residuals and warnings of a run."""
    from ..results.totals import in_words

    yield Text(scene.title or "(untitled scene)", style="bold")
    if events:
        yield _event_table(events, scene)
        kinds = Counter(event.kind for event in events)
        yield f"events    {', '.join(f'{number} {kind}' for kind, number in kinds.most_common())}"
        yield "          (on tip, of stop: impulses, upward; lost: energy)"
    if contacts:
        yield _contact_table(contacts)
        yield "          (contacts; velocities: of the ends against each other)"
    results = Table.grid(padding=(0, 2))
    for cells in in_words(summary):
        results.add_row(*map(Text, cells))
    yield results
    yield from _lines(summary, scene.duration)


def _lines(summary: Mapping[str, Any], duration: float) -> Iterator[str]:
    """Yield cost, residuals, accuracy, errors and warnings of a run of a ``duration`` [s]."""
    from ..results.judged import judged_in_words

    if "macro_steps" in summary and "wall_time" in summary:
        yield f"run       {summary['macro_steps']} macro steps in {summary['wall_time']:.3g} s"
    if "coupling" in summary:
        yield "coupling  {scheme} {degree}: {because}".format(**summary["coupling"])
    if "max_energy_residual" in summary:
        interface = summary.get("max_interface_residual")
        beside = "" if interface is None else f", of the interface {float(interface):.1e}"
        yield f"energy    largest relative residual {float(summary['max_energy_residual']):.1e}{beside}"
    if (asked := summary.get("accuracy")) is not None:
        yield f"accuracy  {picked_in_words(asked)}, after {asked['pilot_runs']} runs in {asked['pilot_time']:.2g} s"
    if (errors := judged_in_words(summary, duration)) is not None:
        yield f"errors    {errors}"
    yield from (f"warning   {warning}" for warning in summary.get("warnings", ()))


def picked_in_words(accuracy: Mapping[str, Any]) -> str:
    """Return the accuracy and the settings found for it, from ``accuracy`` of a summary."""
    settings = accuracy["picked"]
    return f"{accuracy['asked']:g} asked: {settings['scheme']} {settings['degree']}, H = {settings['macro_step']:.3g} s"


def _event_table(events: list[Event], scene: Scene) -> Table:
    """Return the events as a table; of a cascade the first one, and the sums over the others.

    For many events of a kind, the sums over all but the first stand below, so that events of other kinds stay visible.
    """
    from ..results.trajectory import cascades, rounded

    position, speed = ("u_tip", "v_tip") if scene.lower is None else ("y", "z")
    columns = (
        *("event", "time\n[s]:.8f", f"{position}\n[m]:", f"{speed}\n[m/s]:"),
        *("on tip\n[N·s]:.3g", "of stop\n[N·s]:.3g", "lost\n[J]:.3g"),
    )
    scales = {name: max(abs(getattr(event, name) or 0.0) for event in events) for name in (position, speed)}
    rows: list[tuple[Any, ...]] = []
    shown = Counter[str]()
    hidden: dict[str, list[Event]] = {}
    for first, *others in cascades(events):
        shown[first.kind] += 1
        if shown[first.kind] > _FIRST_OF_KIND:
            hidden.setdefault(first.kind, []).extend([first, *others])
            continue
        places = (getattr(first, name) for name in scales)
        moves = ("" if x is None else rounded(x, scale) for x, scale in zip(places, scales.values(), strict=True))
        rows.append((first.kind, first.time, *moves, *_sums([first])))
        if others:
            rows.append((f"+{len(others)}, until", others[-1].time, None, None, *_sums(others)))
    for kind, some in hidden.items():
        rows.append((f"+{len(some)} {kind}, until", some[-1].time, None, None, *_sums(some)))
    return table(columns, rows)


def _contact_table(contacts: list[Contact]) -> Table:
    """Return the first contacts as a table, and sums or the largest of the others."""
    from ..results.trajectory import rounded
    from ..studies.picture import readable

    fastest = max(abs(v) for contact in contacts for v in (contact.closing, contact.opening or 0.0))

    def upward(velocity: float | None) -> float | None:
        return None if velocity is None else float(rounded(velocity, fastest))

    rows = [(*each[:_VELOCITIES], upward(-each.closing), upward(each.opening)) for each in contacts[:_CONTACTS]]
    if others := contacts[_CONTACTS:]:
        highest = max(others, key=lambda contact: contact.peak_force or 0.0)
        length, impulse, loss = (sum(getattr(c, name) for c in others) for name in ("duration", "impulse", "loss"))
        depth = max(contact.depth for contact in others)
        peak = highest.peak_force, highest.peak_time
        rows.append((others[-1].begin, length, impulse, *peak, depth, loss, None, upward(others[-1].opening)))
    scaled, heads = readable([dict(zip(_OF_CONTACT, row, strict=True)) for row in rows], _OF_CONTACT)
    heads = {name: head.replace(" [", "\n[") for name, head in heads.items()}
    columns = ("", *(f"{head}:.{4 if name in _TIMES else 3}g" for name, head in heads.items()))
    numbers = [*map(str, range(1, min(len(contacts), _CONTACTS) + 1)), *[f"+{len(others)}"] * bool(others)]
    return table(columns, [(number, *row.values()) for number, row in zip(numbers, scaled, strict=True)])


def _sums(events: list[Event]) -> tuple[float | None, ...]:
    """Return impulses on the tip and of the stop [N·s], and the energy lost [J], of all ``events``; ``None`` for 0."""
    names = ("impulse_contact", "impulse_foundation", "energy_loss")
    return tuple(sum(getattr(event, name) for event in events) or None for name in names)
