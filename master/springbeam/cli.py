"""The ``springbeam`` command. A command is a thin function: it reads its input, calls the library, prints.

Exit codes: 0 done, 1 a check failed, 2 bad input, 3 the run stopped early (what was computed is on disk).
Results go to stdout, progress and errors to stderr.
"""

from __future__ import annotations

import signal
import threading
from collections import Counter, deque
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import metadata
from itertools import islice
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from .fmu import FmuError
from .recording import (
    FileRecorder,
    NonFiniteValue,
    ResultsExist,
    RunDirectory,
    load_events,
    load_summary,
    load_trajectory,
)
from .scene import Scene, SceneError, load_scene, shipped_scenes
from .trajectory import Event

if TYPE_CHECKING:
    from .crosscheck import OrderRow, Report

DISAGREES = 1
BAD_INPUT = 2
STOPPED = 3

_FIRST_EVENTS, _LAST_EVENTS = 10, 3
_REFRESH_SECONDS = 0.1

app = typer.Typer(
    help="A Timoshenko beam that strikes a Duffing spring above a rigid foundation: co-simulation of two FMUs.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def main() -> None:
    """Entry point of the console script."""
    app()


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"springbeam {version()}")
        raise typer.Exit


def version() -> str:
    """Version of the installed package."""
    try:
        return metadata.version("springbeam")
    except metadata.PackageNotFoundError:
        return "(not installed)"


@app.callback()
def _common(
    show_version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    pass


def _complete_scene(incomplete: str) -> list[str]:
    return [name for name in shipped_scenes() if name.startswith(incomplete)]


SceneArgument = Annotated[
    str,
    typer.Argument(
        metavar="SCENE",
        help="A scene file (.toml), or the name of a shipped scene (springbeam scenes lists them).",
        autocompletion=_complete_scene,
    ),
]
SettingsOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="TABLE.KEY=VALUE", help="Change a value of the scene; may be repeated."),
]


@app.command()
def run(
    scene: SceneArgument,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", metavar="DIR", help="Where results go. Default: results/SCENE, or results/SCENE-2, …"
        ),
    ] = None,
    settings: SettingsOption = None,
    no_plots: Annotated[bool, typer.Option("--no-plots", help="Do not draw pictures.")] = False,
    force: Annotated[bool, typer.Option("--force", "-f", help="Replace results that are already there.")] = False,
    quiet: Annotated[
        bool, typer.Option("--quiet", "-q", help="No progress bar and no report; print only where the results are.")
    ] = False,
) -> None:
    """Run a scene; write its results, events and pictures into a directory.

    Example: springbeam run soft --set coupling.macro_step=5e-4 --out results/fine
    """
    with _bad_input_reported():
        what = load_scene(scene, settings or ())
        directory = _run_directory(scene, out, force)
    console = Console(quiet=quiet, highlight=False)
    try:
        error = _run_into(directory, what, quiet=quiet)
    except FmuError as missing:
        directory.remove()
        _fail(BAD_INPUT, str(missing))
    _report(console, directory, what)
    if not no_plots:
        _draw(console, directory)
    if quiet:
        typer.echo(directory.path)
    if error is not None:
        _fail(STOPPED, f"{error}\nwhat was computed is in {directory.path}")


def _draw(console: Console, directory: RunDirectory) -> None:
    from .plots import plot_run  # matplotlib takes a second to load

    try:
        pictures = plot_run(load_trajectory(directory.path), directory.path)
    except KeyboardInterrupt:
        _fail(STOPPED, f"interrupted while drawing; the results in {directory.path} are complete")
    if pictures:
        console.print(Text(f"pictures  {directory.path / '*.png'} ({len(pictures)})"), soft_wrap=True)


@app.command()
def scenes() -> None:
    """List the scenes that come with the package."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("scene", no_wrap=True)
    table.add_column("contains", no_wrap=True)
    table.add_column(Text("t_end [s]"), justify="right", no_wrap=True)
    table.add_column("title")
    with _bad_input_reported():
        for name, path in shipped_scenes().items():
            scene = load_scene(path)
            parts = {"beam": scene.beam, "spring": scene.spring, "stop": scene.stop}
            contents = ", ".join(part for part, there in parts.items() if there is not None)
            table.add_row(name, contents, f"{scene.time.t_end:g}", Text(scene.title))
    Console(highlight=False).print(table)


@app.command()
def crosscheck(
    scene: SceneArgument,
    settings: SettingsOption = None,
    with_orders: Annotated[
        bool, typer.Option("--orders", help="Repeat at H/2, H/4, H/8 and print observed orders instead.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="PNG", help="Draw both, and errors below bounds, here.")
    ] = None,
) -> None:
    """Compare the co-simulation with the monolithic reference of its law. Exit code 1 if they disagree.

    Example: springbeam crosscheck soft --set coupling.scheme=hermite --set coupling.degree=2 --orders
    """
    from .crosscheck import crosscheck as compare
    from .crosscheck import orders
    from .monolithic.event_driven import ReferenceFailure
    from .plots import plot_crosscheck
    from .runner import RunStopped

    console = Console(highlight=False)
    with _bad_input_reported():
        what = load_scene(scene, settings or ())
        try:
            if with_orders:
                console.print(_orders_table(orders(what)))
                return
            report = compare(what)
        except FmuError as error:
            _fail(BAD_INPUT, str(error))
        except (RunStopped, ReferenceFailure) as error:
            _fail(STOPPED, str(error))
        if out is not None:
            plot_crosscheck(report, out)
    for note in report.notes:
        console.print(Text(note))
    console.print(_error_table(report))
    console.print(_event_errors_table(report))
    begin, end = report.trajectory["time"][0], report.trajectory["time"][-1]
    console.print(Text(
        f"comparable from {begin:.9g} to {report.horizon:.9g} s of {end:.9g} s; there a perturbation of the reference "
        f"has grown {report.growth:.3g} times"
    ))  # fmt: skip
    console.print(Text("passed" if report.passed else "FAILED", style="bold green" if report.passed else "bold red"))
    if not report.passed:
        raise typer.Exit(DISAGREES)


@app.command()
def verify() -> None:
    """Check the FMUs against exact solutions. Exit code 1 if one is missed."""
    from .verify import report

    try:
        passed = report(Console(highlight=False))
    except FmuError as error:
        _fail(BAD_INPUT, str(error))
    if not passed:
        raise typer.Exit(DISAGREES)


def _error_table(report: Report) -> Table:
    table = Table("quantity", box=None, pad_edge=False, header_style="bold")
    for name in ("max error", "at t [s]", "L2 error", "bound", ""):
        table.add_column(Text(name), justify="right", no_wrap=True)
    for row in report.rows:
        verdict = "ok" if row.passed else "FAILED"
        table.add_row(row.quantity, f"{row.error:.2e}", f"{row.at:.6g}", f"{row.l2:.1e}", f"{row.bound:.1e}", verdict)
    return table


def _event_errors_table(report: Report) -> Table:
    table = Table("contact", box=None, pad_edge=False, header_style="bold")
    for name in ("t [s]", "reference [s]", "error [s]", "bound [s]", ""):
        table.add_column(Text(name), justify="right", no_wrap=True)
    for row in report.events:
        error, verdict = row.time - row.reference, "ok" if row.passed else "FAILED"
        table.add_row(
            row.kind, f"{row.time:.10f}", f"{row.reference:.10f}", f"{error:.1e}", f"{row.bound:.1e}", verdict
        )
    return table


def _orders_table(rows: list[OrderRow]) -> Table:
    table = Table(
        "phase",
        r"from \[s]",
        "quantity",
        box=None,
        pad_edge=False,
        header_style="bold",
        title="max errors at H, H/2, …",
        title_justify="left",
    )
    count = len(rows[0].errors) if rows else 0
    for column in table.columns:
        column.no_wrap = True
    for k in range(count):
        table.add_column(f"H/{2**k}" if k else "H", justify="right", no_wrap=True)
    table.add_column("orders", justify="right", no_wrap=True)
    for row in rows:
        observed = " ".join(f"{order:.1f}" for order in row.orders)
        table.add_row(row.phase, f"{row.begin:.4f}", row.quantity, *[f"{error:.1e}" for error in row.errors], observed)
    return table


@contextmanager
def _bad_input_reported() -> Iterator[None]:
    try:
        yield
    except ResultsExist as error:
        _fail(BAD_INPUT, f"{error}; --force replaces them, --out DIR puts the new ones elsewhere")
    except SceneError as error:
        _fail(BAD_INPUT, str(error))
    except OSError as error:
        _fail(BAD_INPUT, f"{error.filename or 'results'}: {error.strerror or error}")


def _fail(code: int, message: str) -> NoReturn:
    typer.echo(f"error: {message}", err=True)
    raise typer.Exit(code)


def _run_directory(scene: str, out: Path | None, force: bool) -> RunDirectory:
    default = Path("results") / Path(scene).stem
    if out is None and not force:
        return RunDirectory.create_numbered(default)
    return RunDirectory.create(out or default, replace=force)


def _run_into(directory: RunDirectory, scene: Scene, *, quiet: bool) -> str | None:
    """Run ``scene``; returns why it stopped early, or ``None``. The results are closed and complete either way."""
    from .runner import RunStopped
    from .runner import run as run_scene

    with FileRecorder(scene, directory) as recorder, _ProgressBar(scene.time.t_end, quiet=quiet) as progress:
        try:
            with _termination_as_interrupt():
                run_scene(scene, recorder, progress)
            return None
        except RunStopped as stopped:
            status, cause = "stopped", str(stopped)
        except NonFiniteValue as error:
            status, cause = "stopped", str(error)
        except OSError as error:
            status, cause = "stopped", f"{error.filename or directory.path}: {error.strerror or error}"
        except KeyboardInterrupt:
            status, cause = "interrupted", "interrupted"
        reached = 0.0 if recorder.time is None else recorder.time
        if not recorder.finished:
            with suppress(OSError):  # on a full disk: the rows that fit are there, and the cause is reported
                recorder.finish({"status": status, "cause": cause, "time": reached})
    where = f"{cause} (reached t = {reached:.9g} s of {scene.time.t_end:g} s)"
    return where if status == "interrupted" else f"the run stopped early: {where}"


@contextmanager
def _termination_as_interrupt() -> Iterator[None]:
    """SIGTERM, which batch systems send, ends a run as Ctrl-C does: with its results on disk."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(*_: Any) -> NoReturn:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


class _ProgressBar:
    """Simulated time, phase and speed on stderr, when that is a terminal."""

    def __init__(self, t_end: float, *, quiet: bool) -> None:
        console = Console(stderr=True)
        self._bar = Progress(
            BarColumn(bar_width=20),
            TaskProgressColumn(),
            TextColumn("{task.fields[state]}"),
            TimeRemainingColumn(),
            console=console,
            transient=True,
            redirect_stdout=False,
            disable=quiet or not console.is_terminal,
        )
        self._t_end = t_end
        self._task = self._bar.add_task("", total=t_end, state="starting")
        self._start = self._shown = monotonic()

    def __enter__(self) -> _ProgressBar:
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def __call__(self, time: float, phase: str, macro_steps: int) -> None:
        now = monotonic()
        if self._bar.disable or now - self._shown < _REFRESH_SECONDS:
            return
        self._shown = now
        speed = macro_steps / (now - self._start)
        state = f"t = {time:.4g}/{self._t_end:g} s  {phase:<7}{speed:7.0f} steps/s"
        self._bar.update(self._task, completed=time, state=state)


def _report(console: Console, directory: RunDirectory, scene: Scene) -> None:
    summary = load_summary(directory.path)
    console.print(Text(scene.title or "(untitled scene)", style="bold"))
    events = load_events(directory.path)
    first = list(islice(events, _FIRST_EVENTS))
    kinds = Counter(event.kind for event in first)
    last: deque[Event] = deque(maxlen=_LAST_EVENTS)
    for event in events:
        kinds[event.kind] += 1
        last.append(event)
    if first:
        console.print(_event_table(first, list(last), kinds.total() - len(first) - len(last), scene))
        counts = ", ".join(f"{number} {kind}" for kind, number in kinds.most_common())
        console.print(f"events    {counts}")
    if "macro_steps" in summary and "wall_time" in summary:
        console.print(f"run       {summary['macro_steps']} macro steps in {summary['wall_time']:.3g} s")
    if "max_energy_residual" in summary:
        console.print(f"energy    largest relative residual {float(summary['max_energy_residual']):.1e}")
    for warning in summary.get("warnings", ()):
        console.print(Text(f"warning   {warning}"))
    console.print(Text(f"results   {directory.path}"), soft_wrap=True)


def _event_table(first: list[Event], last: list[Event], between: int, scene: Scene) -> Table:
    position, speed = ("u_tip", "v_tip") if scene.spring is None else ("y", "z")
    table = Table(box=None, pad_edge=False, collapse_padding=True, header_style="bold")
    table.add_column("event", no_wrap=True)
    units = {"t": "s", position: "m", speed: "m/s", "J_contact": "N·s", "J_stop": "N·s", "loss": "J"}
    for name, unit in units.items():
        table.add_column(Text(f"{name}\n[{unit}]"), justify="right", no_wrap=True)
    for event in [*first, *last]:
        if between and last and event is last[0]:
            table.add_row("⋮", Text(f"{between} more"))
        impulses = (event.impulse_contact, event.impulse_foundation)
        table.add_row(
            event.kind,
            f"{event.time:.8f}",
            *("" if value is None else f"{value:.4g}" for value in (getattr(event, position), getattr(event, speed))),
            *(f"{value:.3g}" if value else "" for value in (*impulses, event.energy_loss)),
        )
    return table
