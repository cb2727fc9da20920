"""Arguments, exit codes and errors that all commands use.

A command returns `Findings`. `Command` handles bad input, interruptions, ``--json`` and ``--quiet`` for all of them.

Results go to stdout, progress and errors to stderr. ``--json`` puts one JSON document on stdout and nothing else,
``--quiet`` only the path of the results. Colours are for terminals, and NO_COLOR turns them off (rich sees to both).
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, ClassVar, NoReturn, Protocol

import typer
from rich.console import Console
from rich.text import Text
from typer.core import TyperCommand, TyperGroup

from .. import scene
from ..results.directory import ResultsExist, ResultsInUse, ResultsUnreadable, RunDirectory
from ..studies.tables import Findings


class Show(Protocol):
    """Say how much is done and, if that has changed, what is being done and how much there is."""

    def __call__(self, done: float, words: str | None = None, total: float | None = None) -> None: ...


DISAGREES = 1
BAD_INPUT = 2
STOPPED = 3
#: Former commands and options, with their replacement.
GONE = {
    "--checkpoint": "a run that ends early leaves its results in its directory; run it again for the rest",
    "resume": "run the scene again; the command of a study, given again, continues it",
    "--mesh": "springbeam converge SCENE shows the influence of the mesh",
    "verify": "springbeam doctor compares the FMUs with exact solutions, springbeam crosscheck judges a scene",
}
#: How long a signal waits for Python to act on it [s].
PATIENCE = 5.0
#: After how long a signal is sent again whose exception was lost [s].
_AGAIN = 0.05


def complete_scene(incomplete: str) -> list[str]:
    """Return the shipped scenes that begin with the text typed; without any, the shell offers files."""
    return [name for name in scene.shipped_scenes() if name.startswith(incomplete)]


def complete_key(incomplete: str) -> list[str]:
    """Return the keys of a scene that begin with the text typed, each as ``table.key=``."""
    return [f"{name}=" for name in scene.scene_keys() if name.startswith(incomplete)]


SceneArgument = Annotated[
    str,
    typer.Argument(
        metavar="SCENE",
        help="A scene file (.toml), or the name of a shipped scene (springbeam scenes lists them).",
        autocompletion=complete_scene,
    ),
]
SettingsOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="TABLE.KEY=VALUE",
        help="Change a value of the scene; may be repeated.",
        autocompletion=complete_key,
    ),
]
AccuracyOption = Annotated[
    float | None,
    typer.Option(
        "--accuracy",
        metavar="RELATIVE",
        help="Largest relative error of motion, contact times and impulses; sets degree and steps.",
    ),
]
RunArgument = Annotated[Path, typer.Argument(metavar="DIR", help="Directory with the results of springbeam run.")]
MeasuredArgument = Annotated[
    Path,
    typer.Argument(metavar="FILE", help="Measured columns, time first; the first line names them and their units."),
]
MapOption = Annotated[
    list[str] | None,
    typer.Option("--map", metavar="NAME=COLUMN", help="Column of the run, or module:function, that was measured."),
]
ScaleOption = Annotated[
    list[str] | None,
    typer.Option(
        "--scale", metavar="NAME=FACTOR", help="Factor of a measured column, which may have a unit: CH1=2.5 mm/V."
    ),
]
ReadOption = Annotated[
    list[str] | None,
    typer.Option("--read", metavar="KEY=VALUE", help="Format of the file, such as missing=drop: keys of [[loads]]."),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON document, and nothing else, on stdout.")]
QuietOption = Annotated[
    bool, typer.Option("--quiet", "-q", help="No progress bar and no tables; print only the path of the results.")
]
ForceOption = Annotated[bool, typer.Option("--force", "-f", help="Replace existing results.")]
NoPlotsOption = Annotated[bool, typer.Option("--no-plots", help="Draw no picture.")]


def _with_flags(parameters: list[Any]) -> list[Any]:
    """Show flags without a type, which ``--force true`` would follow, and let one that is not given be false.

    With ``None`` for a flag, Typer loads pydantic to check it.
    """
    for parameter in parameters:
        if getattr(parameter, "is_flag", False):
            parameter.metavar = ""
            parameter.default = parameter.default or False
    return parameters


class Commands(TyperGroup):
    """All commands, each made when it is needed. A former one names its replacement."""

    #: Functions that make the commands, by their names.
    makers: ClassVar[dict[str, Callable[[], Any]]] = {}

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        unmade: dict[str, Any] = dict.fromkeys(self.makers)
        self.commands.update(unmade)

    def get_params(self, ctx: Any) -> list[Any]:
        return _with_flags(super().get_params(ctx))

    def get_command(self, ctx: Any, name: str) -> Any:
        if name in self.makers and self.commands[name] is None:
            self.commands[name] = self.makers[name]()
        return super().get_command(ctx, name)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        _refuse_gone(args[:1])
        return super().resolve_command(ctx, args)


class Command(TyperCommand):
    """A command that can be interrupted. A former option names its replacement.

    Its help is text: what stands in brackets, ``[s]`` or ``[[loads]]``, is no markup of rich.
    """

    def format_help(self, ctx: Any, formatter: Any) -> None:
        from rich.markup import escape

        described: list[Any] = [self, *self.params]
        texts = [one.help or "" for one in described]
        for one, text in zip(described, texts, strict=True):
            one.help = escape(text)
        super().format_help(ctx, formatter)
        for one, text in zip(described, texts, strict=True):
            one.help = text

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """Return the arguments of the usage, ``SCENE`` for Typer's ``{SCENE}``."""
        return [piece.replace("{", "").replace("}", "") for piece in super().collect_usage_pieces(ctx)]

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        _refuse_gone([word for word in args if word.startswith("--")])
        return super().parse_args(ctx, args)

    def get_params(self, ctx: Any) -> list[Any]:
        return _with_flags(super().get_params(ctx))

    def invoke(self, ctx: Any) -> None:
        with interruptible(), closed_output_reported():
            with bad_input_reported():
                findings: Findings = super().invoke(ctx)
            say(findings, quiet=ctx.params.get("quiet", False), as_json=ctx.params.get("as_json", False))
            sys.stdout.flush()


def _refuse_gone(words: list[str]) -> None:
    """End the command if one of ``words`` is in `GONE`."""
    for word in words:
        name = word.partition("=")[0]
        if name in GONE:
            fail(BAD_INPUT, f"{name}: gone; {GONE[name]}")


class _Results(Console):
    """A console that leaves the error of a closed output to `closed_output_reported`."""

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError


def console_for(*, silent: bool) -> Console:
    """Return the console for results, on stdout; it is silent if only a path or JSON is to be printed."""
    return _Results(highlight=False, quiet=silent)


@contextmanager
def progress(words: str, total: float | None, *, silent: bool) -> Iterator[Show]:
    """Show on stderr what a command does, the part done and the time left, if that is a terminal.

    Yields the function by which the command says how much of ``total`` is done. With ``None`` only the time passed is
    shown until the command knows a total.
    """
    console = Console(stderr=True)
    if silent or not console.is_terminal:
        yield lambda done, words=None, total=None: None
        return
    from rich import progress as bars  # which only a terminal needs

    columns = (
        bars.TextColumn("{task.description}"),
        bars.BarColumn(bar_width=20),
        bars.TaskProgressColumn(),
        bars.TimeElapsedColumn(),
        bars.TimeRemainingColumn(),
    )
    with bars.Progress(*columns, console=console, transient=True, redirect_stdout=False) as bar:
        task = bar.add_task(words, total=total)

        def show(done: float, words: str | None = None, total: float | None = None) -> None:
            bar.update(task, completed=done, description=words, total=total)

        yield show


def say(findings: Findings, *, quiet: bool, as_json: bool) -> None:
    """Print findings of a command: one JSON document, or with ``quiet`` only the directory, or all in words.

    Pictures are drawn last. Ends the command with its code and error if it has any. In JSON, NaN and infinity become
    strings.
    """
    if as_json:
        from ..results.document import as_json as json_of

        typer.echo(json_of(findings.document).decode())
    elif quiet and findings.where is not None:
        typer.echo(findings.where)
    console = console_for(silent=quiet or as_json)
    for part in findings.shown:
        console.print(Text(part) if isinstance(part, str) else part)
    _say_where(findings, console)
    if findings.draw is not None:
        with bad_input_reported():
            drawn = findings.draw()
        _say_where(drawn, console)
        findings = findings if findings.code else drawn
    if findings.error:
        fail(findings.code, findings.error)
    if findings.code:
        raise typer.Exit(findings.code)


def _say_where(findings: Findings, console: Console) -> None:
    for word, file in findings.files:
        console.print(Text(f"{word:<10}{file}" if word else str(file)), soft_wrap=True)


def results_directory(path: Path) -> Path:
    """Return ``path`` if it holds a run; otherwise end the command with an error."""
    if not RunDirectory(path).summary.exists():
        fail(BAD_INPUT, f"{path}: holds no run; springbeam run SCENE --out DIR makes one")
    return path


def run_directory(default: Path, out: Path | None, *, force: bool) -> RunDirectory:
    """Make the directory of a new run: ``out``, else the ``default``, or with -2, -3, … behind it if not by force."""
    if out is None and not force:
        return RunDirectory.create_numbered(default)
    return RunDirectory.create(out or default, replace=force)


@contextmanager
def closed_output_reported() -> Iterator[None]:
    """End the command with exit code 3 if its standard output is closed, as by ``| head``."""
    try:
        yield
    except BrokenPipeError:
        # What Python still holds of the output would fail again at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        fail(STOPPED, "standard output: closed before all was written")


@contextmanager
def bad_input_reported() -> Iterator[None]:
    """End the command with exit code 2 and one error if the input or a file is at fault."""
    try:
        yield
    except ResultsExist as error:
        fail(BAD_INPUT, f"{error}; --force replaces them, --out DIR puts the new ones elsewhere")
    except (BrokenPipeError, typer.Exit):
        raise
    except FileExistsError as error:
        fail(BAD_INPUT, f"{error.filename}: is a file; --out DIR names a directory, new or without results")
    except OSError as error:
        fail(BAD_INPUT, cause_of(error, "results"))
    except scene.ArgumentError as error:
        fail(BAD_INPUT, error.typed)
    except (scene.SceneError, ResultsInUse, ResultsUnreadable, _fmu_error()) as error:
        fail(BAD_INPUT, str(error))


def _fmu_error() -> type[Exception]:
    from ..bodies.protocol import FmuError

    return FmuError


def cause_of(error: BaseException, place: Path | str) -> str:
    """Return an error in words; that of a file names the file, or ``place`` if the file is unknown."""
    if isinstance(error, OSError):
        return f"{error.filename or place}: {error.strerror or error}"
    return "interrupted" if isinstance(error, KeyboardInterrupt) else str(error)


@contextmanager
def interruptible() -> Iterator[None]:
    """End the command with exit code 3 on Ctrl-C, on SIGTERM, which batch systems send, and on SIGHUP.

    Python acts on a signal when the call into an FMU returns. The wakeup descriptor gets it at once: if Python has not
    acted within `PATIENCE`, the process ends, and the results so far are on disk. An exception that is raised in a
    finaliser, or in a function that an FMU has called, is lost: the signal is sent again.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    acted = threading.Event()
    receiver, sender = os.pipe()
    os.set_blocking(sender, False)

    def interrupt(*_: Any) -> NoReturn:
        acted.set()
        raise KeyboardInterrupt

    def watch() -> None:
        if os.read(receiver, 1) and not acted.wait(PATIENCE):
            typer.echo(f"error: interrupted: a call into an FMU has not returned within {PATIENCE:g} s", err=True)
            os._exit(STOPPED)

    def lost(unraisable: Any) -> None:
        if issubclass(unraisable.exc_type, KeyboardInterrupt):
            again.append(threading.Timer(_AGAIN, os.kill, (os.getpid(), signal.SIGTERM)))
            again[-1].start()
        else:
            hook(unraisable)

    again = list[threading.Timer]()
    hook = sys.unraisablehook
    numbers = [signal.SIGTERM, signal.SIGINT, *([signal.SIGHUP] if hasattr(signal, "SIGHUP") else [])]
    heard = [number for number in numbers if signal.getsignal(number) is not signal.SIG_IGN]  # nohup ignores SIGHUP
    before = {number: signal.signal(number, interrupt) for number in heard}
    wakeup = signal.set_wakeup_fd(sender, warn_on_full_buffer=False)
    watchdog = threading.Thread(target=watch, name="watchdog", daemon=True)
    watchdog.start()
    sys.unraisablehook = lost
    try:
        yield
    except KeyboardInterrupt:
        fail(STOPPED, "interrupted")
    finally:
        sys.unraisablehook = hook
        for timer in again:
            timer.cancel()
        signal.set_wakeup_fd(wakeup)
        for number, handler in before.items():
            signal.signal(number, handler)
        os.close(sender)  # which ends the watch
        watchdog.join()
        os.close(receiver)


def in_time(seconds: float) -> str:
    """Return a time in words, in the unit that suits it."""
    sizes = {"years": 365.25 * 86400.0, "days": 86400.0, "hours": 3600.0, "minutes": 60.0}
    for unit, size in sizes.items():
        if seconds >= 2.0 * size:
            return f"{seconds / size:.2g} {unit}"
    return f"{seconds:.2g} s"


def fail(code: int, message: str) -> NoReturn:
    """End the command with an error on stderr."""
    typer.echo(f"error: {message}", err=True)
    raise typer.Exit(code)
